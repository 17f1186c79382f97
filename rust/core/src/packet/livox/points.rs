//! Points as the packets of both protocols carry them: Cartesian or spherical, one, two or three of a shot.

/// How the place of a point is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// x, y, z in millimetres of four bytes each.
    Wide,
    /// x, y, z in centimetres of two bytes each.
    Narrow,
    /// Range in millimetres, zenith angle and azimuth in hundredths of a degree.
    Spherical,
}

/// Layout of one shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Form {
    /// How places are told.
    pub coordinates: Coordinates,
    /// Points of a shot.
    pub echoes: usize,
    /// Whether each has a tag.
    pub has_tag: bool,
}

/// Angles of a shot.
const ANGLES_LEN: usize = 4;
/// Range of a spherical point.
const DEPTH_LEN: usize = 4;

/// A point as it is written; numbers in the unit of its [`Coordinates`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RawPoint {
    /// x, y, z; or range, zenith angle, azimuth.
    pub numbers: [i32; 3],
    /// Brightness: up to 150 of diffuse surfaces, beyond of retroreflectors.
    pub reflectivity: u8,
    /// How much it is to be believed.
    pub tag: u8,
}

impl Form {
    /// A layout.
    pub const fn new(coordinates: Coordinates, echoes: usize, has_tag: bool) -> Self {
        Self {
            coordinates,
            echoes,
            has_tag,
        }
    }

    /// Bytes of a point beside its place.
    const fn rest_len(&self) -> usize {
        1 + self.has_tag as usize
    }

    /// Bytes of a shot.
    pub const fn len(&self) -> usize {
        let place_len = match self.coordinates {
            Coordinates::Wide => 12,
            Coordinates::Narrow => 6,
            Coordinates::Spherical => DEPTH_LEN,
        };
        let angles_len = match self.coordinates {
            Coordinates::Spherical => ANGLES_LEN,
            _ => 0,
        };
        angles_len + self.echoes * (place_len + self.rest_len())
    }

    /// Whether a shot has no byte: never.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the range and the angles of a spherical point begin: a single one has its range first.
    const fn places(&self, echo: usize) -> (usize, usize, usize) {
        if self.echoes == 1 {
            (0, DEPTH_LEN, DEPTH_LEN + ANGLES_LEN)
        } else {
            let depth = ANGLES_LEN + echo * (DEPTH_LEN + self.rest_len());
            (depth, 0, depth + DEPTH_LEN)
        }
    }

    /// A point of a shot; `shot` has [`Form::len`] bytes.
    #[inline]
    pub fn read(&self, shot: &[u8], echo: usize) -> RawPoint {
        let (numbers, rest) = match self.coordinates {
            Coordinates::Wide => {
                let start = echo * (12 + self.rest_len());
                let number = |axis: usize| i32_at(shot, start + 4 * axis);
                ([number(0), number(1), number(2)], start + 12)
            }
            Coordinates::Narrow => {
                let start = echo * (6 + self.rest_len());
                let number = |axis: usize| i32::from(u16_at(shot, start + 2 * axis) as i16);
                ([number(0), number(1), number(2)], start + 6)
            }
            Coordinates::Spherical => {
                let (depth, angles, rest) = self.places(echo);
                let angle = |place: usize| i32::from(u16_at(shot, angles + place));
                // No range has the bit of the sign.
                let range = i32_at(shot, depth) & i32::MAX;
                ([range, angle(0), angle(2)], rest)
            }
        };
        RawPoint {
            numbers,
            reflectivity: shot.get(rest).copied().unwrap_or(0),
            tag: match self.has_tag {
                true => shot.get(rest + 1).copied().unwrap_or(0),
                false => 0,
            },
        }
    }

    /// Writes a point of a shot.
    pub fn write(&self, shot: &mut [u8], echo: usize, point: &RawPoint) {
        let [one, two, three] = point.numbers;
        let rest = match self.coordinates {
            Coordinates::Wide => {
                let start = echo * (12 + self.rest_len());
                for (axis, number) in point.numbers.iter().enumerate() {
                    put(shot, start + 4 * axis, &number.to_le_bytes());
                }
                start + 12
            }
            Coordinates::Narrow => {
                let start = echo * (6 + self.rest_len());
                for (axis, number) in point.numbers.iter().enumerate() {
                    put(shot, start + 2 * axis, &(*number as i16).to_le_bytes());
                }
                start + 6
            }
            Coordinates::Spherical => {
                let (depth, angles, rest) = self.places(echo);
                put(shot, depth, &one.to_le_bytes());
                put(shot, angles, &(two as u16).to_le_bytes());
                put(shot, angles + 2, &(three as u16).to_le_bytes());
                rest
            }
        };
        put(shot, rest, &[point.reflectivity]);
        if self.has_tag {
            put(shot, rest + 1, &[point.tag]);
        }
    }

    /// Whether the sensor got no echo.
    #[inline]
    pub fn is_none(&self, point: &RawPoint) -> bool {
        match self.coordinates {
            Coordinates::Spherical => point.numbers[0] == 0,
            _ => point.numbers == [0; 3],
        }
    }

    /// What ranges are compared by: it grows with the range.
    pub fn order(&self, point: &RawPoint) -> u64 {
        let size = |number: &i32| u64::from(number.unsigned_abs());
        match self.coordinates {
            Coordinates::Spherical => size(&point.numbers[0]),
            // Three squares of 31 bits fit.
            _ => point.numbers.iter().map(|n| size(n) * size(n)).sum(),
        }
    }
}

#[inline]
fn i32_at(bytes: &[u8], at: usize) -> i32 {
    let four = bytes.get(at..).and_then(|rest| rest.first_chunk());
    four.map_or(0, |four| i32::from_le_bytes(*four))
}

/// Two bytes, or 0 beyond the end.
#[inline]
pub(super) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    let two = bytes.get(at..).and_then(|rest| rest.first_chunk());
    two.map_or(0, |two| u16::from_le_bytes(*two))
}

/// Eight bytes as a time, nanoseconds; what no clock can tell is the latest that is told.
pub(super) fn time_at(bytes: &[u8], at: usize) -> i64 {
    const LATEST: u64 = 1 << 62;
    let eight = bytes.get(at..).and_then(|rest| rest.first_chunk());
    eight.map_or(0, |eight| u64::from_le_bytes(*eight).min(LATEST) as i64)
}

/// Writes bytes where there is room.
pub(super) fn put(bytes: &mut [u8], at: usize, what: &[u8]) {
    if let Some(place) = bytes.get_mut(at..at + what.len()) {
        place.copy_from_slice(what);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_protocols() {
        use Coordinates::{Narrow, Spherical, Wide};
        let len = |coordinates, echoes, has_tag| Form::new(coordinates, echoes, has_tag).len();
        assert_eq!([len(Wide, 1, false), len(Spherical, 1, false)], [13, 9]);
        assert_eq!([len(Wide, 1, true), len(Spherical, 1, true)], [14, 10]);
        assert_eq!([len(Wide, 2, true), len(Spherical, 2, true)], [28, 16]);
        assert_eq!([len(Wide, 3, true), len(Spherical, 3, true)], [42, 22]);
        assert_eq!(len(Narrow, 1, true), 8);
    }

    #[test]
    fn bytes_of_a_shot_are_where_the_protocol_has_them() {
        let bytes = [0x10, 0x27, 0, 0, 0x28, 0x23, 0x50, 0x46, 77, 5];
        let form = Form::new(Coordinates::Spherical, 1, true);
        let point = form.read(&bytes, 0);
        let expected = RawPoint {
            numbers: [10_000, 9_000, 18_000],
            reflectivity: 77,
            tag: 5,
        };
        assert_eq!(point, expected);
        // The second of two: angles first, then range, brightness and tag of each.
        let pair = [
            0x28, 0x23, 0, 0, 1, 0, 0, 0, 2, 3, 0xE8, 3, 0, 0, 0x50, 0x10,
        ];
        let second = Form::new(Coordinates::Spherical, 2, true).read(&pair, 1);
        assert_eq!(second.numbers, [1000, 9_000, 0]);
        assert_eq!((second.reflectivity, second.tag), (0x50, 0x10));
    }
}
