//! Data packets of the CH series, big endian: 171 records of one echo, or 109 of two, and a tail.

use crate::packet::ReturnMode;
use crate::packet::hesai::date;
use crate::time::{NANOS_PER_SECOND, Timestamp};

/// Metres of one unit of distance.
pub const UNIT_M: f64 = 1.0 / 25_600.0;

/// Byte ranges of the tails.
mod field {
    use std::ops::Range;

    pub const SECOND: usize = 1199; // of the minute, short packets
    pub const SHORT_BELOW: Range<usize> = 1200..1204; // u32
    pub const DATE: Range<usize> = 1200..1206; // y m d h m s, or FF, -, seconds
    pub const BELOW: Range<usize> = 1206..1210; // u32, ns
}

/// Begins a new frame in place of a record.
const MARKER: [u8; 4] = [0xFF, 0xAA, 0xBB, 0xCC];

/// Records of a packet.
pub const fn count(mode: ReturnMode) -> usize {
    match mode {
        ReturnMode::Strongest => 171,
        _ => 109,
    }
}

const fn record_len(mode: ReturnMode) -> usize {
    match mode {
        ReturnMode::Strongest => 7,
        _ => 11,
    }
}

/// One shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// Number of the line.
    pub line: u8,
    /// Azimuth, 0.01 degree.
    pub azimuth: u16,
    /// Distances and brightnesses; 0 = no echo.
    pub echoes: [(u32, u8); 2],
}

impl Record {
    /// Reads it; `None` for a marker.
    #[inline(always)]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let echo = |at: usize| {
            let bytes = bytes.get(at..at + 4).unwrap_or(&[0; 4]);
            (big(&bytes[..3]), bytes[3])
        };
        (!bytes.starts_with(&MARKER)).then(|| Self {
            line: bytes[0],
            azimuth: big(&bytes[1..3]) as u16,
            echoes: [echo(3), echo(7)],
        })
    }

    /// Whether there is an echo.
    pub fn is_seen(&self) -> bool {
        self.echoes.iter().any(|(range, _)| *range != 0)
    }
}

#[inline(always)]
fn big(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .fold(0, |sum, byte| sum << 8 | u32::from(*byte))
}

/// Borrowed data packet. Its length was checked, so no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    bytes: &'a [u8],
    mode: ReturnMode,
}

impl<'a> View<'a> {
    /// Takes a payload of the right size whose last byte tells one or two echoes; `None` for any other.
    pub fn new(bytes: &'a [u8], len: usize) -> Option<Self> {
        let mode = match bytes.last()? {
            1 => ReturnMode::Strongest,
            2 => ReturnMode::FirstLast,
            _ => return None,
        };
        let is_block = bytes.starts_with(&[0xFF, 0xEE]);
        (bytes.len() == len && !is_block).then_some(Self { bytes, mode })
    }

    /// Which returns it carries.
    pub fn mode(&self) -> ReturnMode {
        self.mode
    }

    /// Records; `None` for a marker.
    fn slots(&self) -> impl Iterator<Item = Option<Record>> + use<'a> {
        let places = self.bytes.chunks_exact(record_len(self.mode));
        places.take(count(self.mode)).map(Record::read)
    }

    /// Bytes of the records, where they have this length.
    pub fn bytes<const LEN: usize>(&self) -> &'a [[u8; LEN]] {
        let records = self.bytes.as_chunks().0;
        &records[..count(self.mode).min(records.len())]
    }

    /// Records; markers are left out.
    pub fn records(&self) -> impl Iterator<Item = Record> + use<'a> {
        self.slots().flatten()
    }

    /// Second of the minute of a short packet.
    pub fn second(&self) -> u8 {
        self.bytes.get(field::SECOND).copied().unwrap_or(0)
    }

    /// Date bytes of a long packet.
    pub fn date(&self) -> [u8; 6] {
        let bytes = self.bytes.get(field::DATE);
        bytes
            .and_then(|bytes| bytes.try_into().ok())
            .unwrap_or_default()
    }

    /// What is below the second.
    pub fn below(&self) -> u32 {
        let range = if self.bytes.len() > field::BELOW.end {
            field::BELOW
        } else {
            field::SHORT_BELOW
        };
        self.bytes.get(range).map_or(0, big)
    }
}

/// A record to write; `None` for the marker of a frame.
pub type RawRecord = Option<Record>;

/// A packet to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawPacket {
    /// Time of the last record, ns since 1970.
    pub time_ns: i64,
    /// Whether there is room for two echoes.
    pub is_double: bool,
    /// Whether the time of a long packet is written as seconds since 1970 and not as a date.
    pub is_ptp: bool,
    /// Records; what is too much is left out.
    pub records: Vec<RawRecord>,
}

/// Writes a packet of so many bytes.
pub fn encode(packet: &RawPacket, len: usize, is_micros: bool) -> Vec<u8> {
    let mode = if packet.is_double {
        ReturnMode::FirstLast
    } else {
        ReturnMode::Strongest
    };
    let mut bytes = vec![0; len];
    let places = bytes.chunks_exact_mut(record_len(mode)).take(count(mode));
    for (place, record) in places.zip(&packet.records) {
        match record {
            Some(record) => write(record, place),
            None => place[..5].copy_from_slice(&[0xFF, 0xAA, 0xBB, 0xCC, 0xDD]),
        }
    }
    let below = packet.time_ns.rem_euclid(NANOS_PER_SECOND);
    let (mut day, _) = date::bytes(Timestamp(packet.time_ns));
    day[0] = day[0].wrapping_sub(100); // since 2000, not since 1900
    if len == 1206 {
        let below = if is_micros { below / 1000 } else { below };
        let from = if packet.is_double { 5 } else { 3 };
        bytes[field::SECOND + 1 - (6 - from)..=field::SECOND].copy_from_slice(&day[from..]);
        bytes[field::SHORT_BELOW].copy_from_slice(&(below as u32).to_be_bytes());
    } else {
        if packet.is_ptp {
            let seconds = packet.time_ns.div_euclid(NANOS_PER_SECOND) as u32;
            day[..2].copy_from_slice(&[0xFF, 0]);
            day[2..].copy_from_slice(&seconds.to_be_bytes());
        }
        bytes[field::DATE].copy_from_slice(&day);
        bytes[field::BELOW].copy_from_slice(&(below as u32).to_be_bytes());
    }
    bytes[len - 1] = if packet.is_double { 2 } else { 1 };
    bytes
}

fn write(record: &Record, place: &mut [u8]) {
    place[0] = record.line;
    place[1..3].copy_from_slice(&record.azimuth.to_be_bytes());
    for (room, (range, intensity)) in place[3..].chunks_exact_mut(4).zip(record.echoes) {
        room[..3].copy_from_slice(&range.to_be_bytes()[1..]);
        room[3] = intensity;
    }
}
