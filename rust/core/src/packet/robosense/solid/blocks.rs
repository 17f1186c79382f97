//! Packets of blocks that each tell their time, with points that each tell where they are.
//!
//! Where the maker's driver reads the forward part of a direction of the MX without sign, it is read with
//! sign here, as in all other models.

use std::ops::Range;

use super::header::{self, RawHeader, u8_at, u16_at};
use crate::packet::aim::Centidegrees;

/// How a point tells where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Point {
    /// Range, pitch, yaw, brightness.
    Angles,
    /// Range, direction, brightness.
    Vector,
    /// Two ranges, direction, two brightnesses.
    Pair,
}

/// Sizes and places within a packet.
#[derive(Debug, Clone, Copy)]
pub struct Blocks {
    /// Bytes of a packet.
    pub len: usize,
    /// Blocks of it.
    pub count: usize,
    /// Bytes of a block.
    pub block_len: usize,
    /// Bytes of a block's time.
    pub time_len: usize,
    /// Whether a block tells which return it is of.
    pub has_return: bool,
    /// Points of a block.
    pub points: usize,
    /// What they are.
    pub point: Point,
    /// Bytes of a point.
    pub point_len: usize,
}

/// Angles of zero are written so.
const ANGLE_ZERO: i32 = 32_768;
/// A direction of one is written so.
const VECTOR_ONE: f64 = 32_768.0;

/// A point as it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RawPoint {
    /// Ranges in the unit of the model; 0 = no return. The second is there in pairs alone.
    pub ranges: [u16; 2],
    /// Brightnesses.
    pub intensities: [u8; 2],
    /// Pitch and yaw in hundredths of a degree, or the direction in parts of 32768.
    pub aim: [i16; 3],
}

/// Where a shot points.
#[derive(Debug, Clone, Copy)]
pub struct Aim {
    /// Of one metre: forward, left, up.
    pub direction: [f64; 3],
    /// From forward to the left, [0, 2 pi); 0 where it follows from the direction.
    pub azimuth_rad: f32,
}

/// A block of a packet.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a> {
    bytes: &'a [u8],
    layout: Blocks,
}

impl Blocks {
    /// Blocks of a packet of the right length.
    pub fn blocks<'a>(&self, payload: &'a [u8]) -> impl Iterator<Item = Block<'a>> {
        let body = payload.get(header::LEN..).unwrap_or(&[]);
        let layout = *self;
        let blocks = body.chunks_exact(layout.block_len).take(layout.count);
        blocks.map(move |bytes| Block { bytes, layout })
    }

    fn first_point(&self) -> usize {
        self.time_len + usize::from(self.has_return)
    }

    /// Where a block has its points.
    pub fn body(&self) -> Range<usize> {
        let start = self.first_point();
        start..start + self.points * self.point_len
    }

    /// Writes a packet: of each block the time in microseconds, the number of the return and its points.
    pub fn encode(
        &self,
        kind: u8,
        head: &RawHeader,
        blocks: &[(u16, u8, Vec<RawPoint>)],
    ) -> Vec<u8> {
        let mut bytes = vec![0; self.len];
        header::write(&mut bytes, head, kind);
        let places = bytes[header::LEN..].chunks_exact_mut(self.block_len);
        for (place, (micros, number, points)) in places.take(self.count).zip(blocks) {
            let time = micros.to_be_bytes();
            place[..self.time_len].copy_from_slice(&time[2 - self.time_len..]);
            if self.has_return {
                place[self.time_len] = *number;
            }
            let slots = place[self.first_point()..].chunks_exact_mut(self.point_len);
            for (slot, point) in slots.take(self.points).zip(points) {
                self.write(slot, point);
            }
        }
        bytes
    }

    fn write(&self, slot: &mut [u8], point: &RawPoint) {
        let mut numbers = vec![point.ranges[0]];
        if self.point == Point::Pair {
            numbers.push(point.ranges[1]);
        }
        match self.point {
            Point::Angles => {
                let angle = |angle: i16| (i32::from(angle) + ANGLE_ZERO) as u16;
                numbers.extend(point.aim[..2].iter().map(|number| angle(*number)));
            }
            _ => numbers.extend(point.aim.map(|number| number as u16)),
        }
        let places = slot.chunks_exact_mut(2);
        for (place, number) in places.zip(&numbers) {
            place.copy_from_slice(&number.to_be_bytes());
        }
        let rest = 2 * numbers.len();
        slot[rest] = point.intensities[0];
        if self.point == Point::Pair {
            slot[rest + 1] = point.intensities[1];
        }
    }
}

impl<'a> Block<'a> {
    /// Time after that of the packet.
    pub fn since_ns(&self) -> i64 {
        let micros = match self.layout.time_len {
            1 => u16::from(u8_at(self.bytes, 0)),
            _ => u16_at(self.bytes, 0),
        };
        i64::from(micros) * 1000
    }

    /// Which return of its shots it has, 0 or 1.
    pub fn return_index(&self) -> u8 {
        let number = u8_at(self.bytes, self.layout.time_len);
        u8::from(self.layout.has_return && number == 2)
    }

    /// Its points.
    pub fn points(&self) -> std::slice::ChunksExact<'a, u8> {
        let bytes = self.bytes.get(self.layout.body()).unwrap_or(&[]);
        bytes.chunks_exact(self.layout.point_len)
    }

    /// The same where they have a length that the compiler knows; `body` is [`Blocks::body`].
    #[inline(always)]
    pub fn points_of<const LEN: usize>(&self, body: &Range<usize>) -> &'a [[u8; LEN]] {
        let bytes = self.bytes.get(body.clone()).unwrap_or(&[]);
        bytes.as_chunks().0
    }
}

impl Point {
    /// Ranges and brightnesses.
    #[inline(always)]
    pub fn echoes(self, point: &[u8]) -> [(u16, u8); 2] {
        match self {
            Self::Angles => [(u16_at(point, 0), u8_at(point, 6)), (0, 0)],
            Self::Vector => [(u16_at(point, 0), u8_at(point, 8)), (0, 0)],
            Self::Pair => [
                (u16_at(point, 0), u8_at(point, 10)),
                (u16_at(point, 2), u8_at(point, 11)),
            ],
        }
    }

    /// Where it is seen.
    #[inline(always)]
    pub fn aim(self, point: &[u8], table: Centidegrees) -> Aim {
        if self == Self::Angles {
            let angle = |at: usize| i32::from(u16_at(point, at)) - ANGLE_ZERO;
            let (up, level) = table.sin_cos(angle(2));
            let (left, forward) = table.sin_cos(angle(4));
            return Aim {
                direction: [level * forward, level * left, up],
                azimuth_rad: table.wrapped(angle(4)),
            };
        }
        let start = if self == Self::Pair { 4 } else { 2 };
        let part = |axis: usize| f64::from(u16_at(point, start + 2 * axis) as i16) / VECTOR_ONE;
        Aim {
            direction: [part(0), part(1), part(2)],
            azimuth_rad: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_and_a_direction_point_the_same_way() {
        let table = Centidegrees::table();
        // Pitch 30 degrees up, yaw 60 degrees to the right.
        let angles = [0x03, 0xFC, 0x8B, 0xB8, 0x68, 0x90, 9, 0, 0];
        assert_eq!(Point::Angles.echoes(&angles)[0], (1020, 9));
        let aim = Point::Angles.aim(&angles, table);
        let expected = [0.433_013, -0.75, 0.5];
        for (found, wanted) in aim.direction.iter().zip(expected) {
            assert!((found - wanted).abs() < 1e-6, "{aim:?}");
        }
        let parts = expected.map(|part: f64| ((part * 32_768.0).round() as i16).to_be_bytes());
        let mut vector = vec![0x03, 0xFC];
        vector.extend(parts.concat());
        vector.extend([7, 1]);
        let other = Point::Vector.aim(&vector, table);
        for (found, wanted) in other.direction.iter().zip(expected) {
            assert!((found - wanted).abs() < 2e-5, "{other:?}");
        }
        assert!((f64::from(aim.azimuth_rad) - 300.0_f64.to_radians()).abs() < 1e-6);
    }
}
