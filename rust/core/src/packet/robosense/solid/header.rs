//! The header of 32 bytes that all data packets begin with.

use super::super::layout::{Stamp, big, seconds_ns, stamp_bytes};
use crate::packet::ReturnMode;

/// Byte ranges.
mod field {
    use std::ops::Range;

    pub const NUMBER: Range<usize> = 4..6; // u16, in the frame
    pub const RETURN_MODE: usize = 8;
    pub const TIME_MODE: usize = 9;
    pub const TIME: usize = 10; // seconds of 6 bytes, microseconds of 4
    pub const TYPE: usize = 30;
}

/// First bytes of a data packet.
pub const ID: [u8; 4] = [0x55, 0xAA, 0x5A, 0xA5];
/// Bytes of the header.
pub const LEN: usize = 32;

/// Whether a payload is a data packet of this length.
pub fn is_packet(payload: &[u8], len: usize) -> bool {
    payload.len() == len && len > LEN && payload.starts_with(&ID)
}

/// Number of the packet in its frame.
pub fn number(payload: &[u8]) -> u32 {
    big(payload, field::NUMBER) as u32
}

/// Time of the packet, ns since 1970 on the sensor's clock.
pub fn time_ns(payload: &[u8]) -> i64 {
    seconds_ns(payload, field::TIME)
}

/// Type of the sensor.
pub fn kind(payload: &[u8]) -> u8 {
    u8_at(payload, field::TYPE)
}

/// Byte of the return mode.
pub fn mode_byte(payload: &[u8]) -> u8 {
    u8_at(payload, field::RETURN_MODE)
}

/// Which returns it carries; `dual` are the two of the model.
pub fn return_mode(payload: &[u8], dual: ReturnMode) -> ReturnMode {
    match mode_byte(payload) {
        0 => dual,
        5 => ReturnMode::Last,
        6 => ReturnMode::First,
        _ => ReturnMode::Strongest,
    }
}

/// Byte of a mode.
pub fn byte_of(mode: ReturnMode) -> u8 {
    match mode {
        ReturnMode::Strongest => 4,
        ReturnMode::Last => 5,
        ReturnMode::First => 6,
        _ => 0,
    }
}

/// A byte, or 0 beyond the end.
pub fn u8_at(payload: &[u8], at: usize) -> u8 {
    payload.get(at).copied().unwrap_or(0)
}

/// Two bytes, or 0 beyond the end.
#[inline]
pub fn u16_at(payload: &[u8], at: usize) -> u16 {
    let two = payload.get(at..).and_then(|rest| rest.first_chunk());
    two.map_or(0, |two| u16::from_be_bytes(*two))
}

/// What a header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawHeader {
    /// Number of the packet in its frame.
    pub number: u16,
    /// Which returns it carries.
    pub return_mode: ReturnMode,
    /// Time, written to the microsecond.
    pub time_ns: i64,
}

/// Writes a header into a packet.
pub fn write(bytes: &mut [u8], header: &RawHeader, kind: u8) {
    bytes[..ID.len()].copy_from_slice(&ID);
    bytes[field::NUMBER].copy_from_slice(&header.number.to_be_bytes());
    bytes[field::RETURN_MODE] = byte_of(header.return_mode);
    bytes[field::TIME_MODE] = 3; // gPTP
    let stamp = stamp_bytes(Stamp::Seconds, header.time_ns);
    bytes[field::TIME..field::TIME + stamp.len()].copy_from_slice(&stamp);
    bytes[field::TYPE] = kind;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_comes_back() {
        let header = RawHeader {
            number: 630,
            return_mode: ReturnMode::Last,
            time_ns: 1_718_000_000_500_001_000,
        };
        let mut bytes = [0; 40];
        write(&mut bytes, &header, 0x10);
        assert!(is_packet(&bytes, 40) && !is_packet(&bytes, 41));
        assert_eq!((number(&bytes), kind(&bytes)), (630, 0x10));
        assert_eq!(time_ns(&bytes), header.time_ns);
        let mode = |byte: u8| return_mode(&[byte; 9], ReturnMode::Dual);
        let found = [0, 4, 5, 6, 9].map(mode);
        use ReturnMode::{Dual, First, Last, Strongest};
        assert_eq!(found, [Dual, Strongest, Last, First, Strongest]);
    }
}
