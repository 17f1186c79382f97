//! Packets of one column or a part of one: points tell range and brightness, the header their yaw.
//!
//! EMX: as the maker's driver has it; its manual of the public unit shows the bytes of the column as
//! reserved. EM4: as the manual has it, packets of fixed length. The offsets of zones of 20 rows are taken
//! for single bytes, of which there are as many as zones; the manual's example has two bytes for each.

use super::header::{self, RawHeader, u8_at, u16_at};
use crate::packet::aim::{add, small_turn};

/// Byte ranges of the header beside those of all models.
mod field {
    use std::ops::Range;

    pub const PITCH_OFFSET: usize = 6; // EMX: i16, 1/32768 degree
    pub const REGION: usize = 6; // EM4: 1 = more columns in the middle
    pub const FRAME_RATE: usize = 21; // Hz
    pub const YAW: Range<usize> = 24..26; // i16
    pub const SURFACE: usize = 27;
    pub const INTERVAL: usize = 28; // EM4: i8, us
}

/// Bytes of a point: range, brightness, attribute.
pub const POINT_LEN: usize = 4;

/// The two models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
    /// EMX.
    Emx,
    /// EM4.
    Em4,
}

/// Angles of a row of a unit.
#[derive(Debug, Clone, Copy)]
pub struct RowAngles {
    /// Sine and cosine of its pitch.
    pub pitch: (f64, f64),
    /// What its zone adds to the yaw.
    pub offset_rad: f64,
    /// Sine and cosine of that.
    pub offset: (f64, f64),
    /// Whether its zone fires after those of odd number.
    pub is_late: bool,
}

impl Columns {
    /// Bytes of a packet.
    pub const fn len(self) -> usize {
        match self {
            Self::Emx => 812,
            Self::Em4 => 1084,
        }
    }

    /// Whether a packet has no bytes: never.
    pub const fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Rows of a column.
    pub const fn rows(self) -> usize {
        match self {
            Self::Emx => 192,
            Self::Em4 => 520,
        }
    }

    /// Points of a packet.
    pub const fn count(self) -> usize {
        match self {
            Self::Emx => 192,
            Self::Em4 => 260,
        }
    }

    /// Rows of a zone that fires at once.
    pub const fn zone_rows(self) -> usize {
        match self {
            Self::Emx => 8,
            Self::Em4 => 20,
        }
    }

    /// Whether the header's bytes are such as the model writes.
    pub fn is_sound(self, payload: &[u8]) -> bool {
        match self {
            Self::Emx => u8_at(payload, field::SURFACE) < 2,
            Self::Em4 => (1..=4).contains(&u8_at(payload, field::SURFACE)),
        }
    }

    /// Packets of a frame.
    pub fn frame_len(self, payload: &[u8], returns: usize) -> i64 {
        let single = match self {
            Self::Emx => 1520,
            Self::Em4 if u8_at(payload, field::REGION) & 1 == 1 => 3200,
            Self::Em4 => 2400,
        };
        single * returns as i64
    }

    /// Time of a frame.
    pub fn frame_ns(self, payload: &[u8]) -> i64 {
        match i64::from(u8_at(payload, field::FRAME_RATE)) {
            rate @ 1..=100 => 1_000_000_000 / rate,
            _ => 100_000_000,
        }
    }

    /// First row of a packet.
    pub fn first_row(self, payload: &[u8], returns: usize) -> usize {
        let parts = self.rows() * returns / self.count();
        let number = header::number(payload).wrapping_sub(1) as usize;
        number % parts * (self.count() / returns)
    }

    /// Points of a packet.
    pub fn points(self, payload: &[u8]) -> &[[u8; POINT_LEN]] {
        let body = payload.get(header::LEN..).unwrap_or(&[]);
        let points = body.as_chunks().0;
        &points[..self.count().min(points.len())]
    }

    /// Range and brightness of a point.
    #[inline]
    pub fn echo(self, point: &[u8; POINT_LEN]) -> (u16, u8) {
        let [high, low, intensity, _] = *point;
        (u16::from_be_bytes([high, low]), intensity)
    }

    /// Time by which the zones of odd number fire before the others.
    pub fn lead_ns(self, payload: &[u8]) -> i64 {
        match self {
            Self::Emx => 0,
            Self::Em4 => (256 + i64::from(u8_at(payload, field::INTERVAL) as i8)) * 1000,
        }
    }

    fn yaw_deg(self, payload: &[u8]) -> f64 {
        let raw = f64::from(u16_at(payload, field::YAW.start) as i16);
        match self {
            Self::Emx => raw / 512.0,
            Self::Em4 => raw / 100.0,
        }
    }

    fn pitch_offset_rad(self, payload: &[u8], surface_rad: &[f64]) -> f64 {
        match self {
            Self::Emx => {
                let raw = f64::from(u16_at(payload, field::PITCH_OFFSET) as i16);
                -(raw / 32_768.0).to_radians()
            }
            Self::Em4 => {
                let surface = usize::from(u8_at(payload, field::SURFACE)).wrapping_sub(1);
                surface_rad.get(surface).copied().unwrap_or(0.0)
            }
        }
    }

    /// Where the rows of a packet point, with what the surfaces of the mirror add to their pitch.
    pub fn aims(self, payload: &[u8], surface_rad: &[f64]) -> ColumnAim {
        let yaw_rad = self.yaw_deg(payload).to_radians();
        ColumnAim {
            yaw_rad,
            yaw: yaw_rad.sin_cos(),
            pitch_offset: small_turn(self.pitch_offset_rad(payload, surface_rad)),
        }
    }

    /// Writes a packet.
    pub fn encode(self, kind: u8, column: &RawColumn) -> Vec<u8> {
        let mut bytes = vec![0; self.len()];
        header::write(&mut bytes, &column.header, kind);
        if self == Self::Emx {
            bytes[field::PITCH_OFFSET..field::PITCH_OFFSET + 2]
                .copy_from_slice(&column.pitch_offset.to_be_bytes());
        } else {
            bytes[field::INTERVAL] = column.interval_us as u8;
        }
        bytes[field::FRAME_RATE] = 10;
        bytes[field::YAW].copy_from_slice(&column.yaw.to_be_bytes());
        bytes[field::SURFACE] = column.surface;
        let slots = bytes[header::LEN..].chunks_exact_mut(POINT_LEN);
        for (slot, (range, intensity)) in slots.take(self.count()).zip(&column.points) {
            slot[..2].copy_from_slice(&range.to_be_bytes());
            slot[2] = *intensity;
        }
        bytes
    }
}

/// Direction of a column.
#[derive(Debug, Clone, Copy)]
pub struct ColumnAim {
    yaw_rad: f64,
    yaw: (f64, f64),
    pitch_offset: (f64, f64),
}

impl ColumnAim {
    /// Direction of a row of one metre: forward, left, up; and its yaw.
    #[inline(always)]
    pub fn row(&self, row: &RowAngles) -> ([f64; 3], f64) {
        let (up, level) = add(row.pitch, self.pitch_offset);
        let (left, forward) = add(self.yaw, row.offset);
        (
            [level * forward, level * left, up],
            self.yaw_rad + row.offset_rad,
        )
    }
}

/// A packet to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawColumn {
    /// Its header.
    pub header: RawHeader,
    /// Yaw of the column in the model's unit.
    pub yaw: i16,
    /// EMX: offset of the pitches, 1/32768 degree.
    pub pitch_offset: i16,
    /// Surface of the mirror.
    pub surface: u8,
    /// EM4: how much more than 256 us the odd zones lead.
    pub interval_us: i8,
    /// Ranges and brightnesses.
    pub points: Vec<(u16, u8)>,
}

#[cfg(test)]
mod tests {
    use super::super::description::Angles;
    use super::*;
    use crate::packet::ReturnMode;

    fn column(number: u16, yaw: i16, surface: u8) -> RawColumn {
        RawColumn {
            header: RawHeader {
                number,
                return_mode: ReturnMode::Strongest,
                time_ns: 0,
            },
            yaw,
            pitch_offset: 0,
            surface,
            interval_us: -67,
            points: Vec::new(),
        }
    }

    #[test]
    fn the_manuals_example_of_an_em4() {
        // Yaw 54.56 degrees, zone offset -0.03, pitch -15.46, surface A +0.15; 263.197 m.
        let mut pitches = vec![0; 520];
        pitches[21] = -1546;
        let bytes = crate::packet::robosense::solid::description::encode_em4(
            &pitches,
            &[0, -3],
            &[15, 0, 0, 0],
        );
        let angles = Angles::of_em4(&bytes).unwrap();
        let payload = Columns::Em4.encode(0x70, &column(1, 5456, 1));
        let aim = Columns::Em4.aims(&payload, &angles.surface_rad);
        let (direction, yaw_rad) = aim.row(&angles.row(Columns::Em4, 21));
        // The manual rounds to 147.31, 206.75 and -69.49; its z for y and the pitch it states is -69.50.
        for (part, metres) in direction.iter().zip([147.31, 206.75, -69.49]) {
            assert!((part * 263.197 - metres).abs() < 0.03, "{direction:?}");
        }
        assert!((yaw_rad.to_degrees() - 54.53).abs() < 1e-9);
        // 256 us - 67 us before the even zones.
        let lead_ns = Columns::Em4.lead_ns(&payload);
        assert_eq!(lead_ns, 189_000);
        let is_late = |row| angles.row(Columns::Em4, row).is_late;
        assert_eq!([19, 20].map(is_late), [false, true]);
    }

    #[test]
    fn parts_of_columns_follow_the_number_of_the_packet() {
        let row = |columns: Columns, number: u16, returns: usize| {
            let payload = columns.encode(0, &column(number, 0, 1));
            columns.first_row(&payload, returns)
        };
        assert_eq!(row(Columns::Em4, 1, 1), 0);
        assert_eq!(row(Columns::Em4, 2, 1), 260);
        assert_eq!(row(Columns::Em4, 7, 2), 260);
        assert_eq!(row(Columns::Emx, 5, 1), 0);
        assert_eq!(row(Columns::Emx, 6, 2), 96);
    }
}
