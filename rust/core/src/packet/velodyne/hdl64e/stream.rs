//! The calibration that HDL-64E units send along, one byte a packet.
//!
//! A cycle is 1820 bytes: `UNIT#`, two noise thresholds, 64 records of 28 bytes of which 21 are used,
//! and 28 bytes about the unit. A lost packet shifts all that follows; the laser numbers of the records
//! then do not count up, and the next cycle is waited for.

use std::collections::VecDeque;

use super::super::Packet;
use super::super::calibration::Laser;
use super::LASERS;
use crate::packet::unit::{Gather, UnitFile};

/// Bytes of a cycle.
const CYCLE: usize = 1820;
const START: &[u8] = b"UNIT#";
/// Types of status bytes that are not of the calibration: time, receiver, temperature, version.
const STATUS: &[u8] = b"HMSDNYGTV";
const RECORDS: usize = 7;
const RECORD_LEN: usize = 28;

/// Byte ranges of a record; lengths in mm, angles in 0.01 degree.
mod field {
    pub const ID: usize = 0;
    pub const VERTICAL: usize = 1; // i16, as all that follow
    pub const ROTATION: usize = 3;
    pub const FAR: usize = 5;
    pub const NEAR_X: usize = 7;
    pub const NEAR_Y: usize = 9;
    pub const VERTICAL_OFFSET: usize = 11;
    pub const HORIZONTAL_OFFSET: usize = 13;
    pub const FOCAL_DISTANCE: usize = 15;
    pub const FOCAL_SLOPE: usize = 17; // 0.1
    pub const MIN_INTENSITY: usize = 19; // u8
    pub const MAX_INTENSITY: usize = 20; // u8
}

/// Whether a file is such a cycle.
pub fn takes(file: &UnitFile) -> bool {
    is_cycle(&file.content)
}

fn is_cycle(bytes: &[u8]) -> bool {
    let is_number =
        |number: usize| bytes[RECORDS + number * RECORD_LEN + field::ID] == number as u8;
    bytes.len() == CYCLE && bytes.starts_with(START) && (0..LASERS).all(is_number)
}

/// Lasers of a cycle.
pub fn lasers(cycle: &[u8]) -> Vec<Laser> {
    let records = cycle[RECORDS..].chunks(RECORD_LEN).take(LASERS);
    records.map(laser).collect()
}

fn laser(record: &[u8]) -> Laser {
    let number = |place: usize| f64::from(i16::from_le_bytes([record[place], record[place + 1]]));
    let metres = |place| number(place) * 1e-3;
    let angle_rad = |place| (number(place) * 0.01).to_radians();
    Laser {
        rotation_rad: angle_rad(field::ROTATION),
        elevation_rad: angle_rad(field::VERTICAL),
        distance_m: metres(field::FAR),
        distance_x_m: Some(metres(field::NEAR_X)),
        distance_y_m: Some(metres(field::NEAR_Y)),
        vertical_offset_m: metres(field::VERTICAL_OFFSET),
        horizontal_offset_m: metres(field::HORIZONTAL_OFFSET),
        focal_distance_m: metres(field::FOCAL_DISTANCE),
        focal_slope: number(field::FOCAL_SLOPE) * 0.1,
        min_intensity: f64::from(record[field::MIN_INTENSITY]),
        max_intensity: f64::from(record[field::MAX_INTENSITY]),
    }
}

/// Gathers a cycle.
#[derive(Debug, Default)]
pub struct Stream {
    bytes: VecDeque<u8>,
    cycle: Option<Vec<u8>>,
}

impl Gather for Stream {
    fn take(&mut self, payload: &[u8]) {
        let Some(packet) = Packet::new(payload) else {
            return;
        };
        let (kind, value) = (packet.return_mode_byte(), packet.product());
        if self.cycle.is_some() || STATUS.contains(&kind) {
            return;
        }
        if self.bytes.len() == CYCLE {
            self.bytes.pop_front();
        }
        self.bytes.push_back(value);
        let is_start = self
            .bytes
            .iter()
            .zip(START)
            .all(|(one, other)| one == other);
        if self.bytes.len() == CYCLE && is_start {
            let bytes: Vec<u8> = self.bytes.iter().copied().collect();
            self.cycle = is_cycle(&bytes).then_some(bytes);
        }
    }

    fn file(&self) -> Option<UnitFile> {
        let cycle = self.cycle.clone()?;
        Some(UnitFile::new("calibration in the packets", cycle))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{BLOCKS, LEN, RawBlock, encode};
    use super::*;
    use crate::packet::ReturnMode;

    fn cycle() -> Vec<u8> {
        let mut bytes = vec![0; CYCLE];
        bytes[..5].copy_from_slice(START);
        for laser in 0..LASERS {
            let record = &mut bytes[RECORDS + laser * RECORD_LEN..];
            record[field::ID] = laser as u8;
            record[field::VERTICAL..][..2].copy_from_slice(&(-715_i16).to_le_bytes());
            record[field::NEAR_Y..][..2].copy_from_slice(&1402_i16.to_le_bytes());
            record[field::FOCAL_SLOPE..][..2].copy_from_slice(&19_i16.to_le_bytes());
            record[field::MAX_INTENSITY] = 200;
        }
        bytes
    }

    fn packet(kind: u8, value: u8) -> [u8; LEN] {
        let blocks = [RawBlock::default(); BLOCKS];
        let mut bytes = encode(&blocks, 0, ReturnMode::Strongest, value);
        bytes[LEN - 2] = kind;
        bytes
    }

    #[test]
    fn a_whole_cycle_is_found_from_any_start_between_status_bytes() {
        let mut stream = Stream::default();
        let cycle = cycle();
        for (number, value) in cycle.iter().cycle().skip(900).take(2 * CYCLE).enumerate() {
            if number % 16 == 0 {
                stream.take(&packet(b'H', 12));
            }
            stream.take(&packet(b'1' + (number % 7) as u8, *value));
        }
        let file = stream.file().unwrap();
        assert!(takes(&file) && file.content == cycle);
        let laser = lasers(&file.content)[63];
        assert!((laser.elevation_rad.to_degrees() + 7.15).abs() < 1e-12);
        assert!((laser.distance_y_m.unwrap() - 1.402).abs() < 1e-12);
        assert_eq!(laser.max_intensity, 200.0);
        assert!((laser.focal_slope - 1.9).abs() < 1e-12);
    }

    #[test]
    fn a_cycle_with_a_lost_packet_is_not_taken_and_the_next_one_is() {
        let mut stream = Stream::default();
        let cycle = cycle();
        for (number, value) in cycle.iter().chain(&cycle).enumerate() {
            if number != 700 {
                stream.take(&packet(b'1', *value));
            }
            if number + 1 < 2 * CYCLE {
                assert!(stream.file().is_none());
            }
        }
        assert_eq!(stream.file().unwrap().content, cycle);
    }
}
