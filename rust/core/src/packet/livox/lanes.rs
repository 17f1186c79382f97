//! Points of a packet, read and placed side by side.

use super::points::{Coordinates, Form};
use crate::packet::aim::{Centidegrees, bearing, reach};
use crate::packet::sheet::{LANES, Sheet, lane, lane_mut};
use crate::simd::{Kernel, vectorized};

/// Numbers of the points of a packet as they are written, in the order of the packet.
#[derive(Debug, Default)]
pub struct Points {
    numbers: [Vec<i32>; 3],
}

const WIDE: Form = Form::new(Coordinates::Wide, 1, true);
const BARE: Form = Form::new(Coordinates::Wide, 1, false);
const NARROW: Form = Form::new(Coordinates::Narrow, 1, true);
const ANGLES: Form = Form::new(Coordinates::Spherical, 1, true);
const BARE_ANGLES: Form = Form::new(Coordinates::Spherical, 1, false);
const TWO_ANGLES: Form = Form::new(Coordinates::Spherical, 2, true);
const THREE_ANGLES: Form = Form::new(Coordinates::Spherical, 3, true);

impl Points {
    /// Reads the points of a packet; brightnesses go to the sheet, which has as many echoes.
    pub fn read(&mut self, form: Form, body: &[u8], sheet: &mut Sheet) {
        for column in &mut self.numbers {
            column.resize(sheet.len() + LANES, 0);
        }
        let intensity = &mut sheet.intensity;
        // Layouts that are known to the compiler; several Cartesian points of a shot are as many shots of one.
        match form {
            BARE => self.fill::<13>(BARE, body, intensity),
            NARROW => self.fill::<8>(NARROW, body, intensity),
            ANGLES => self.fill::<10>(ANGLES, body, intensity),
            BARE_ANGLES => self.fill::<9>(BARE_ANGLES, body, intensity),
            TWO_ANGLES => self.fill::<16>(TWO_ANGLES, body, intensity),
            THREE_ANGLES => self.fill::<22>(THREE_ANGLES, body, intensity),
            _ => self.fill::<14>(WIDE, body, intensity),
        }
    }

    #[inline(always)]
    fn fill<const LEN: usize>(&mut self, form: Form, body: &[u8], intensity: &mut [u16]) {
        let [ones, twos, threes] = &mut self.numbers;
        let mut rows = ones.iter_mut().zip(twos).zip(threes).zip(intensity);
        for shot in body.as_chunks::<LEN>().0 {
            for echo in 0..form.echoes {
                let Some((((one, two), three), intensity)) = rows.next() else {
                    return;
                };
                let point = form.read(shot, echo);
                [*one, *two, *three] = point.numbers;
                *intensity = point.reflectivity.into();
            }
        }
    }

    /// Places the points.
    pub fn place(&self, form: Form, table: Centidegrees, sheet: &mut Sheet) {
        let points = &self.numbers;
        let unit_m = match form.coordinates {
            Coordinates::Narrow => 0.01,
            _ => 0.001,
        };
        if form.coordinates == Coordinates::Spherical {
            return vectorized(Turned {
                points,
                unit_m,
                table,
                sheet,
            });
        }
        vectorized(Straight {
            points,
            unit_m,
            sheet,
        });
    }

    /// Numbers that grow with the range of each point, 0 of those that are none.
    pub fn orders(&self, form: Form, orders: &mut Vec<u64>) {
        orders.clear();
        if form.coordinates == Coordinates::Spherical {
            let [ranges, ..] = &self.numbers;
            return orders.extend(ranges.iter().map(|range| u64::from(range.unsigned_abs())));
        }
        orders.resize(self.numbers[0].len(), 0);
        vectorized(Squares {
            points: &self.numbers,
            orders,
        });
    }
}

/// Cartesian points.
struct Straight<'a> {
    points: &'a [Vec<i32>; 3],
    unit_m: f64,
    sheet: &'a mut Sheet,
}

impl Kernel for Straight<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self { unit_m, sheet, .. } = self;
        for at in (0..sheet.len()).step_by(LANES) {
            let [x, y, z] = self.points.each_ref().map(|column| lane(column, at));
            let ranges = lane_mut(&mut sheet.range, at);
            let xyz_m = lane_mut(&mut sheet.xyz_m, at);
            let range_m = lane_mut(&mut sheet.range_m, at);
            let azimuth_rad = lane_mut(&mut sheet.azimuth_rad, at);
            let metres = |number: i32| (f64::from(number) * unit_m) as f32;
            let position = |k: usize| [metres(x[k]), metres(y[k]), metres(z[k])];
            for k in 0..LANES {
                ranges[k] = x[k] | y[k] | z[k];
                xyz_m[k] = position(k);
            }
            for k in 0..LANES {
                let [x_m, y_m, z_m] = position(k);
                range_m[k] = reach([x_m, y_m, z_m]);
                azimuth_rad[k] = bearing(x_m, y_m);
            }
        }
    }
}

/// Squares of the ranges of Cartesian points.
struct Squares<'a> {
    points: &'a [Vec<i32>; 3],
    orders: &'a mut [u64],
}

impl Kernel for Squares<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let [x, y, z] = self.points;
        for (((order, x), y), z) in self.orders.iter_mut().zip(x).zip(y).zip(z) {
            // Three squares of 31 bits fit.
            let square = |number: &i32| {
                let size = u64::from(number.unsigned_abs());
                size.wrapping_mul(size)
            };
            *order = square(x).wrapping_add(square(y)).wrapping_add(square(z));
        }
    }
}

/// Points by range, zenith angle and azimuth.
struct Turned<'a> {
    points: &'a [Vec<i32>; 3],
    unit_m: f64,
    table: Centidegrees,
    sheet: &'a mut Sheet,
}

impl Kernel for Turned<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self {
            unit_m,
            table,
            sheet,
            ..
        } = self;
        for at in (0..sheet.len()).step_by(LANES) {
            let [range, zenith, azimuth] = self.points.each_ref().map(|column| lane(column, at));
            let mut sines = [[0.0; LANES]; 4];
            for k in 0..LANES {
                (sines[0][k], sines[1][k]) = table.sin_cos(zenith[k]);
                (sines[2][k], sines[3][k]) = table.sin_cos(azimuth[k]);
            }
            let [level, up, left, forward] = sines;
            *lane_mut(&mut sheet.range, at) = *range;
            let range_m = lane_mut(&mut sheet.range_m, at);
            let azimuth_rad = lane_mut(&mut sheet.azimuth_rad, at);
            let xyz_m = lane_mut(&mut sheet.xyz_m, at);
            for k in 0..LANES {
                let metres = f64::from(range[k]) * unit_m;
                let level_m = metres * level[k];
                range_m[k] = metres as f32;
                azimuth_rad[k] = table.wrapped(azimuth[k]);
                xyz_m[k] =
                    [level_m * forward[k], level_m * left[k], metres * up[k]].map(|m| m as f32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::livox::points::RawPoint;

    /// Place, range and azimuth of a point, worked out alone.
    fn plain(form: Form, point: &RawPoint) -> ([f32; 3], f32, f32) {
        if form.coordinates == Coordinates::Spherical {
            let [range, zenith, azimuth] = point.numbers;
            let table = Centidegrees::table();
            let ((level, up), (left, forward)) = (table.sin_cos(zenith), table.sin_cos(azimuth));
            let range_m = f64::from(range) * 0.001;
            let level_m = range_m * level;
            let place = [level_m * forward, level_m * left, range_m * up];
            let azimuth_rad = table.wrapped(azimuth);
            return (place.map(|m| m as f32), range_m as f32, azimuth_rad);
        }
        let unit_m = if form.coordinates == Coordinates::Narrow {
            0.01
        } else {
            0.001
        };
        let place = point
            .numbers
            .map(|number| (f64::from(number) * unit_m) as f32);
        (place, reach(place), bearing(place[0], place[1]))
    }

    fn point(form: Form, number: u32) -> RawPoint {
        let bits = |shift: u32| number.wrapping_mul(2_654_435_761).rotate_left(shift) as i32;
        let numbers = match form.coordinates {
            Coordinates::Spherical => [bits(0) & 0xF_FFFF, bits(7) & 0xFFFF, bits(13) & 0xFFFF],
            Coordinates::Narrow => [0, 7, 13].map(|shift| i32::from(bits(shift) as i16)),
            Coordinates::Wide => [0, 7, 13].map(bits),
        };
        RawPoint {
            numbers: if number.is_multiple_of(5) {
                [0; 3]
            } else {
                numbers
            },
            reflectivity: number as u8,
            tag: 0,
        }
    }

    #[test]
    fn points_side_by_side_have_the_bits_of_points_alone() {
        use Coordinates::{Narrow, Spherical, Wide};
        let tagged = [(Wide, 1), (Wide, 2), (Wide, 3), (Narrow, 1), (Spherical, 1)];
        let more = [(Spherical, 2), (Spherical, 3)];
        let tagged = tagged.into_iter().chain(more);
        let tagged = tagged.map(|(coordinates, echoes)| Form::new(coordinates, echoes, true));
        let bare = [Wide, Spherical].map(|coordinates| Form::new(coordinates, 1, false));
        for form in tagged.chain(bare) {
            const SHOTS: usize = 37;
            let mut body = vec![0; SHOTS * form.len()];
            for (shot, bytes) in body.chunks_exact_mut(form.len()).enumerate() {
                for echo in 0..form.echoes {
                    form.write(
                        bytes,
                        echo,
                        &point(form, (shot * form.echoes + echo) as u32),
                    );
                }
            }
            let (mut points, mut sheet) = (Points::default(), Sheet::default());
            sheet.open(SHOTS * form.echoes, 1);
            points.read(form, &body, &mut sheet);
            points.place(form, Centidegrees::table(), &mut sheet);
            let mut orders = Vec::new();
            points.orders(form, &mut orders);
            for at in 0..SHOTS * form.echoes {
                let shot = &body[at / form.echoes * form.len()..][..form.len()];
                let raw = form.read(shot, at % form.echoes);
                let found = (sheet.xyz_m[at], sheet.range_m[at], sheet.azimuth_rad[at]);
                assert_eq!(found, plain(form, &raw), "{form:?} {at}");
                assert_eq!(sheet.intensity[at], u16::from(raw.reflectivity));
                assert_eq!(sheet.range[at] == 0, form.is_none(&raw));
                assert_eq!(orders[at], form.order(&raw));
            }
        }
    }

    #[test]
    fn a_point_straight_behind_lies_on_the_axis() {
        // 10 m level.
        let bytes = [0x10, 0x27, 0, 0, 0x28, 0x23, 0x50, 0x46, 77, 5];
        let (mut points, mut sheet) = (Points::default(), Sheet::default());
        sheet.open(1, 1);
        points.read(ANGLES, &bytes, &mut sheet);
        points.place(ANGLES, Centidegrees::table(), &mut sheet);
        let [x, y, z] = sheet.xyz_m[0];
        assert!((x + 10.0).abs() < 1e-6 && y.abs() < 1e-6 && z.abs() < 1e-6);
    }
}
