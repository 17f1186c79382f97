//! Data packets (MSOP): a header, blocks of channels that each begin with a mark and an azimuth, a tail.

use std::ops::{Range, RangeInclusive};

use crate::packet::echoes::RawEcho;
use crate::packet::hesai::date;
use crate::time::NANOS_PER_SECOND;

/// Byte ranges of the header.
pub(in crate::packet) mod field {
    use std::ops::Range;

    pub const COUNTER: Range<usize> = 12..16; // u32
    pub const TYPE: Range<usize> = 30..33; // type in older firmware, type, model
    pub const RANGE_UNIT: usize = 17;
    pub const RETURN_MODE: usize = 7; // Ruby
}

/// First bytes of a packet with the newer header.
pub const ID: [u8; 4] = [0x55, 0xAA, 0x05, 0x5A];
/// First bytes of a packet with the older header.
pub const CLASSIC_ID: [u8; 8] = [0x55, 0xAA, 0x05, 0x0A, 0x5A, 0xA5, 0x50, 0xA0];

/// How the header tells the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stamp {
    /// Year, month, day, hour, minute, second; milliseconds and microseconds of two bytes each.
    Calendar,
    /// Seconds since 1970 in six bytes, then microseconds in four.
    Seconds,
}

/// Sizes and places within a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Bytes of a packet.
    pub len: usize,
    /// First bytes.
    pub id: &'static [u8],
    /// Where blocks begin.
    pub body: usize,
    /// Blocks of a packet.
    pub blocks: usize,
    /// Channels of a block.
    pub channels: usize,
    /// First bytes of a block.
    pub mark: &'static [u8],
    /// How the header tells the time.
    pub stamp: Stamp,
    /// Where the time stands.
    pub time: usize,
    /// Where the packet counter stands.
    pub counter: Option<usize>,
    /// Bits of a range that are the range.
    pub range_mask: u16,
}

/// Bytes before the channels of a block: mark of two bytes, or mark and return number, then the azimuth.
const BLOCK_HEADER_LEN: usize = 4;
const ECHO_LEN: usize = 3;
/// Azimuths are hundredths of a degree.
const TURN: u16 = 36_000;

impl Layout {
    /// The layout of 12 blocks of 32 channels.
    pub const fn of_32(id: &'static [u8], stamp: Stamp, has_counter: bool) -> Self {
        Self {
            len: 1248,
            id,
            body: 42,
            blocks: 12,
            channels: 32,
            mark: &[0xFF, 0xEE],
            stamp,
            time: 20,
            counter: if has_counter {
                Some(field::COUNTER.start)
            } else {
                None
            },
            range_mask: u16::MAX,
        }
    }

    const fn block_len(&self) -> usize {
        BLOCK_HEADER_LEN + self.channels * ECHO_LEN
    }
}

/// Borrowed data packet. Its length was checked, so no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    bytes: &'a [u8],
    layout: Layout,
    blocks: usize,
}

/// A number of several bytes; 0 beyond the end.
pub(super) fn big(bytes: &[u8], range: Range<usize>) -> u64 {
    let known = bytes.get(range).unwrap_or(&[]);
    known
        .iter()
        .fold(0, |value, byte| value << 8 | u64::from(*byte))
}

/// Nanoseconds since 1970 of a time that is told in seconds and microseconds.
pub(super) fn seconds_ns(bytes: &[u8], at: usize) -> i64 {
    let seconds = i64::try_from(big(bytes, at..at + 6)).unwrap_or(i64::MAX);
    let nanos = i64::try_from(big(bytes, at + 6..at + 10) * 1000).unwrap_or(0);
    seconds
        .saturating_mul(NANOS_PER_SECOND)
        .saturating_add(nanos)
}

impl<'a> View<'a> {
    /// Takes a payload of the right size whose first block is one; `None` for any other. Blocks from the
    /// first one on that is none are left out.
    pub fn new(bytes: &'a [u8], layout: Layout) -> Option<Self> {
        if bytes.len() != layout.len || !bytes.starts_with(layout.id) {
            return None;
        }
        let view = Self {
            bytes,
            layout,
            blocks: layout.blocks,
        };
        let blocks = (0..layout.blocks)
            .take_while(|block| view.is_block(*block))
            .count();
        (blocks > 0).then_some(Self { blocks, ..view })
    }

    fn block(&self, block: usize) -> &'a [u8] {
        let start = self.layout.body + block * self.layout.block_len();
        self.bytes
            .get(start..start + self.layout.block_len())
            .unwrap_or(&[])
    }

    fn is_block(&self, block: usize) -> bool {
        self.block(block).starts_with(self.layout.mark) && self.azimuth(block) < TURN
    }

    /// Layout.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Blocks that are there.
    pub fn blocks(&self) -> usize {
        self.blocks
    }

    /// Azimuth of a block, hundredths of a degree.
    pub fn azimuth(&self, block: usize) -> u16 {
        big(self.block(block), 2..4) as u16
    }

    /// Echo of a channel; ranges in the model's unit.
    pub fn echo(&self, block: usize, channel: usize) -> RawEcho {
        let start = BLOCK_HEADER_LEN + channel * ECHO_LEN;
        let bytes = self.block(block);
        RawEcho {
            range: big(bytes, start..start + 2) as u16 & self.layout.range_mask,
            intensity: big(bytes, start + 2..start + 3) as u8,
        }
    }

    fn channels(&self, block: usize) -> &'a [[u8; ECHO_LEN]] {
        let bytes = self.block(block).get(BLOCK_HEADER_LEN..);
        bytes.map_or(&[], |bytes| bytes.as_chunks().0)
    }

    /// Ranges of a block by channel, in the model's unit.
    pub fn ranges(&self, block: usize) -> impl Iterator<Item = u16> + Clone + use<'a> {
        let mask = self.layout.range_mask;
        let channels = self.channels(block).iter();
        channels.map(move |[high, low, _]| u16::from_be_bytes([*high, *low]) & mask)
    }

    /// Reads ranges and brightnesses of a block from a channel on; ranges outside of `kept` are no echo.
    pub fn read(
        &self,
        block: usize,
        channel: usize,
        kept: &RangeInclusive<u16>,
        ranges: &mut [i32],
        intensities: &mut [u16],
    ) {
        let (least, most) = (*kept.start(), *kept.end());
        let channels = self.channels(block).iter().skip(channel);
        let room = ranges.iter_mut().zip(intensities);
        for ((range, intensity), [high, low, brightness]) in room.zip(channels) {
            let raw = u16::from_be_bytes([*high, *low]) & self.layout.range_mask;
            let is_kept = raw >= least && raw <= most;
            *range = if is_kept { raw.into() } else { 0 };
            *intensity = (*brightness).into();
        }
    }

    /// Device time of the first shot, ns since 1970 on the sensor's clock.
    pub fn time_ns(&self) -> i64 {
        let at = self.layout.time;
        let field = |from: usize, to: usize| big(self.bytes, at + from..at + to);
        match self.layout.stamp {
            Stamp::Seconds => seconds_ns(self.bytes, at),
            Stamp::Calendar => {
                let mut day = [0_u8; 6];
                for (place, byte) in day.iter_mut().enumerate() {
                    *byte = field(place, place + 1) as u8;
                }
                let micros = field(6, 8) * 1000 + field(8, 10);
                // The year counts from 2000, and 0 is a year.
                let year = day[0] % 100;
                let calendar = date::calendar_ns(2000 + i64::from(year), &day[1..]);
                calendar.saturating_add(micros as i64 * 1000)
            }
        }
    }

    /// Packet counter.
    pub fn counter(&self) -> Option<u32> {
        let at = self.layout.counter?;
        Some(big(self.bytes, at..at + 4) as u32)
    }

    /// Type byte in older firmware, type byte, model byte.
    pub fn kind(&self) -> [u8; 3] {
        kind(self.bytes)
    }

    /// Whether ranges are in units of 2.5 mm, where the header says so.
    pub fn is_fine(&self) -> bool {
        self.bytes.get(field::RANGE_UNIT) == Some(&1)
    }

    /// Return mode byte of the Ruby header.
    pub fn mode_byte(&self) -> u8 {
        big(self.bytes, field::RETURN_MODE..field::RETURN_MODE + 1) as u8
    }
}

/// Type byte in older firmware, type byte and model byte of a payload.
pub fn kind(payload: &[u8]) -> [u8; 3] {
    let bytes = payload
        .get(field::TYPE)
        .and_then(|bytes| bytes.try_into().ok());
    bytes.unwrap_or_default()
}

/// The type, wherever the firmware puts it.
pub fn type_of(payload: &[u8]) -> u8 {
    match kind(payload) {
        [old, 0, _] => old,
        [_, new, _] => new,
    }
}

/// A packet to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawPacket {
    /// Device time, ns since 1970; written to the microsecond.
    pub time_ns: i64,
    /// Packet counter.
    pub counter: u32,
    /// Bytes that the header has beside, by place.
    pub header: Vec<(usize, u8)>,
    /// Azimuths of the blocks, hundredths of a degree, and their echoes.
    pub blocks: Vec<(u16, Vec<RawEcho>)>,
}

/// Writes a data packet; what is too much is left out.
pub fn encode(layout: &Layout, packet: &RawPacket) -> Vec<u8> {
    let mut bytes = vec![0; layout.len];
    bytes[..layout.id.len()].copy_from_slice(layout.id);
    let stamp = stamp_bytes(layout.stamp, packet.time_ns);
    bytes[layout.time..layout.time + 10].copy_from_slice(&stamp);
    if let Some(at) = layout.counter {
        bytes[at..at + 4].copy_from_slice(&packet.counter.to_be_bytes());
    }
    for (place, value) in &packet.header {
        bytes[*place] = *value;
    }
    let places = bytes[layout.body..].chunks_exact_mut(layout.block_len());
    for (place, (azimuth, echoes)) in places.take(layout.blocks).zip(&packet.blocks) {
        place[..layout.mark.len()].copy_from_slice(layout.mark);
        place[2..4].copy_from_slice(&azimuth.to_be_bytes());
        let slots = place[BLOCK_HEADER_LEN..].chunks_exact_mut(ECHO_LEN);
        for (slot, echo) in slots.zip(echoes) {
            slot[..2].copy_from_slice(&(echo.range & layout.range_mask).to_be_bytes());
            slot[2] = echo.intensity;
        }
    }
    bytes
}

/// Bytes of a time, to the microsecond.
pub(super) fn stamp_bytes(stamp: Stamp, time_ns: i64) -> [u8; 10] {
    let micros = time_ns.div_euclid(1000);
    let (seconds, micros) = (micros.div_euclid(1_000_000), micros.rem_euclid(1_000_000));
    let mut bytes = [0; 10];
    match stamp {
        Stamp::Seconds => {
            bytes[..6].copy_from_slice(&seconds.to_be_bytes()[2..]);
            bytes[6..].copy_from_slice(&(micros as u32).to_be_bytes());
        }
        Stamp::Calendar => {
            let (date, _) = date::bytes(crate::time::Timestamp(time_ns));
            bytes[..6].copy_from_slice(&date);
            bytes[0] = bytes[0].wrapping_sub(100); // since 2000, not since 1900
            bytes[6..8].copy_from_slice(&((micros / 1000) as u16).to_be_bytes());
            bytes[8..].copy_from_slice(&((micros % 1000) as u16).to_be_bytes());
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_stamps_come_back() {
        for stamp in [Stamp::Calendar, Stamp::Seconds] {
            let layout = Layout::of_32(&ID, stamp, true);
            let time_ns = 1_709_210_096_123_456_000; // 2024-02-29 12:34:56
            let packet = RawPacket {
                time_ns,
                counter: 77,
                header: vec![(31, 6)],
                blocks: vec![
                    (
                        35_999,
                        vec![
                            RawEcho {
                                range: 9,
                                intensity: 8
                            };
                            32
                        ]
                    );
                    12
                ],
            };
            let bytes = encode(&layout, &packet);
            let view = View::new(&bytes, layout).unwrap();
            assert_eq!((view.time_ns(), view.counter()), (time_ns, Some(77)));
            assert_eq!(
                (view.blocks(), view.azimuth(11), view.echo(11, 31).range),
                (12, 35_999, 9)
            );
            assert_eq!(type_of(&bytes), 6);
        }
    }

    #[test]
    fn blocks_without_a_mark_end_the_packet() {
        let layout = Layout::of_32(&ID, Stamp::Seconds, true);
        let packet = RawPacket {
            time_ns: 0,
            counter: 0,
            header: Vec::new(),
            blocks: vec![(100, Vec::new()), (36_000, Vec::new())],
        };
        let bytes = encode(&layout, &packet);
        assert_eq!(View::new(&bytes, layout).unwrap().blocks(), 1);
        assert!(View::new(&bytes[1..], layout).is_none());
    }
}
