//! Where a packet has what: one layout for all models with blocks, as data.

use std::ops::Range;

use super::{date, modes};
use crate::packet::ReturnMode;
use crate::packet::echoes::RawEcho;
use crate::time::Timestamp;

/// First two bytes of modern packets, and the other way round of older blocks.
pub const MAGIC: [u8; 2] = [0xEE, 0xFF];
/// Bytes of the header of modern packets.
pub const HEADER_LEN: usize = 12;

/// Header of modern packets.
mod field {
    pub const MAJOR: usize = 2;
    pub const MINOR: usize = 3;
    pub const VERSION: usize = 4;
    pub const LASERS: usize = 6;
    pub const BLOCKS: usize = 7;
    pub const UNIT_MM: usize = 9;
    pub const RETURNS: usize = 10;
    pub const FLAGS: usize = 11;
}

/// Bits of the header's flags.
pub mod flag {
    /// A sequence number follows the tail.
    pub const SEQUENCE: u8 = 1;
    /// Inertial values follow it.
    pub const INERTIAL: u8 = 1 << 1;
    /// 17 bytes of functional safety precede the tail.
    pub const SAFETY: u8 = 1 << 2;
    /// A signature of 32 bytes ends the packet.
    pub const SIGNATURE: u8 = 1 << 3;
    /// Each echo has a byte of confidence.
    pub const CONFIDENCE: u8 = 1 << 4;
    /// Each echo has a byte of weight.
    pub const WEIGHT: u8 = 1 << 5;
    /// Each echo has a byte of background light.
    pub const LIGHT: u8 = 1 << 6;
}

/// Header of a modern packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Protocol, major and minor.
    pub protocol: (u8, u8),
    /// Version of the status, which tells siblings of one protocol apart.
    pub version: u8,
    /// Channels of a block.
    pub lasers: usize,
    /// Blocks of the packet.
    pub blocks: usize,
    /// Unit of ranges, mm.
    pub unit_mm: u8,
    /// Returns of a firing.
    pub returns: u8,
    /// Optional parts.
    pub flags: u8,
}

impl Header {
    /// Reads it; `None` for other first bytes.
    pub fn new(payload: &[u8]) -> Option<Self> {
        let bytes = payload.get(..HEADER_LEN)?;
        bytes.starts_with(&MAGIC).then(|| Self {
            protocol: (bytes[field::MAJOR], bytes[field::MINOR]),
            version: bytes[field::VERSION],
            lasers: bytes[field::LASERS].into(),
            blocks: bytes[field::BLOCKS].into(),
            unit_mm: bytes[field::UNIT_MM],
            returns: bytes[field::RETURNS],
            flags: bytes[field::FLAGS],
        })
    }

    /// Writes it.
    pub fn write(&self, room: &mut [u8]) {
        room[..2].copy_from_slice(&MAGIC);
        room[field::MAJOR] = self.protocol.0;
        room[field::MINOR] = self.protocol.1;
        room[field::VERSION] = self.version;
        room[field::LASERS] = self.lasers as u8;
        room[field::BLOCKS] = self.blocks as u8;
        room[field::UNIT_MM] = self.unit_mm;
        room[field::RETURNS] = self.returns;
        room[field::FLAGS] = self.flags;
    }

    /// Whether an optional part is there.
    pub fn has(&self, flag: u8) -> bool {
        self.flags & flag != 0
    }

    /// Bytes of an echo where the flags tell them.
    pub fn echo_len(&self) -> usize {
        let options = [flag::CONFIDENCE, flag::WEIGHT, flag::LIGHT];
        3 + options.iter().filter(|option| self.has(**option)).count()
    }

    /// Metres of one unit of range.
    pub fn unit_m(&self) -> f64 {
        f64::from(self.unit_mm) * 1e-3
    }
}

/// Where the tail has what, after its start. `None`: nowhere.
#[derive(Debug, Clone, Copy)]
pub struct Tail {
    /// State of the firing of two blocks.
    pub azimuth_state: Option<usize>,
    /// Mode of operation, or the loop of lasers.
    pub operation: Option<usize>,
    /// Return mode.
    pub return_mode: usize,
    /// Motor speed, i16.
    pub speed: usize,
    /// Turns a minute of one unit of speed.
    pub speed_rpm: f64,
    /// Six date bytes.
    pub date: Option<usize>,
    /// Microseconds, u32.
    pub micros: usize,
    /// Sequence number.
    pub sequence: usize,
    /// Bytes of the sequence number: 2 or 4.
    pub sequence_len: usize,
}

/// Bytes of the optional parts of modern packets.
mod option {
    pub const SAFETY_LEN: usize = 17;
    pub const SEQUENCE_LEN: usize = 4;
    pub const INERTIAL_LEN: usize = 22;
    pub const SIGNATURE_LEN: usize = 32;
}

/// What stands around the echoes of a modern packet; the header's flags tell which optional parts are there.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Bytes of a block before its echoes: the azimuth, and its fine part where there is one.
    pub block_head: usize,
    /// Bytes of each of the two checksums, behind the blocks and behind the tail.
    pub crc_len: usize,
    /// Bytes of the tail without optional parts.
    pub tail_len: usize,
    /// What the tail has.
    pub fields: Tail,
}

impl Frame {
    /// The layout of a packet with this header and so many bytes an echo.
    pub fn layout(&self, header: &Header, echo_len: usize) -> Layout {
        let part = |flag: u8, len: usize| if header.has(flag) { len } else { 0 };
        let block_len = self.block_head + echo_len * header.lasers;
        let body_end = HEADER_LEN + header.blocks * block_len + self.crc_len;
        let tail = body_end + part(flag::SAFETY, option::SAFETY_LEN);
        let behind = part(flag::SEQUENCE, option::SEQUENCE_LEN)
            + part(flag::INERTIAL, option::INERTIAL_LEN)
            + part(flag::SIGNATURE, option::SIGNATURE_LEN);
        Layout {
            blocks: header.blocks,
            channels: header.lasers,
            body: HEADER_LEN,
            block_len,
            azimuth: 0,
            echoes: self.block_head,
            echo_len,
            unit_m: header.unit_m(),
            tail,
            fields: self.fields,
            has_sequence: header.has(flag::SEQUENCE),
            len: tail + self.tail_len + self.crc_len + behind,
        }
    }

    /// Bytes of an empty packet with its header.
    pub fn template(&self, header: &Header, echo_len: usize) -> Vec<u8> {
        let mut bytes = vec![0; self.layout(header, echo_len).len];
        header.write(&mut bytes);
        bytes
    }
}

/// A place behind the end of every packet: what stands there is read as 0 and not written.
pub const NOWHERE: usize = 1 << 16;

/// A packet's layout.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Blocks.
    pub blocks: usize,
    /// Channels of a block.
    pub channels: usize,
    /// Start of the first block.
    pub body: usize,
    /// Bytes of a block.
    pub block_len: usize,
    /// In a block: azimuth, u16.
    pub azimuth: usize,
    /// In a block: first echo.
    pub echoes: usize,
    /// Bytes of an echo, of which range (u16) and brightness (u8) are read.
    pub echo_len: usize,
    /// Metres of one unit of range.
    pub unit_m: f64,
    /// Start of the tail.
    pub tail: usize,
    /// What the tail has.
    pub fields: Tail,
    /// Whether there is a sequence number.
    pub has_sequence: bool,
    /// Bytes of the packet.
    pub len: usize,
}

/// A packet whose size its layout fits, so that no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    payload: &'a [u8],
    layout: Layout,
}

impl<'a> View<'a> {
    /// `None` where the payload is not as long as the layout says, or nothing is in it.
    #[inline]
    pub fn new(payload: &'a [u8], layout: Layout) -> Option<Self> {
        let is_full = layout.blocks > 0 && layout.channels > 0;
        let blocks = layout.body + layout.blocks * layout.block_len;
        let is_inside = blocks.max(layout.tail) < layout.len;
        (payload.len() == layout.len && is_full && is_inside).then_some(Self { payload, layout })
    }

    /// Its layout.
    #[inline]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Header, where it is a modern packet.
    pub fn header(&self) -> Option<Header> {
        Header::new(self.payload)
    }

    #[inline]
    fn block(&self, block: usize) -> &'a [u8] {
        let block = match block < self.layout.blocks {
            true => block,
            false => block % self.layout.blocks,
        };
        let start = self.layout.body + block * self.layout.block_len;
        &self.payload[start..start + self.layout.block_len]
    }

    /// Azimuth of a block, in the model's unit.
    #[inline]
    pub fn azimuth(&self, block: usize) -> u16 {
        u16_at(self.block(block), self.layout.azimuth)
    }

    /// The byte behind the azimuth: its fine part where the model has one.
    pub fn fine_azimuth(&self, block: usize) -> u8 {
        self.block(block)[self.layout.azimuth + 2]
    }

    /// Echoes of a block by channel.
    pub fn echoes(&self, block: usize) -> impl Iterator<Item = RawEcho> + 'a {
        let echoes = self.block(block)[self.layout.echoes..].chunks_exact(self.layout.echo_len);
        let echoes = echoes.take(self.layout.channels);
        echoes.map(|bytes| RawEcho {
            range: u16::from_le_bytes([bytes[0], bytes[1]]),
            intensity: bytes[2],
        })
    }

    /// Reads ranges and brightnesses of a block by channel; ranges below the least are no echo.
    #[inline]
    pub fn read(&self, block: usize, least: u16, ranges: &mut [i32], intensities: &mut [u16]) {
        let bytes = &self.block(block)[self.layout.echoes..];
        let length = self.layout.channels * self.layout.echo_len;
        let bytes = &bytes[..length.min(bytes.len())];
        match self.layout.echo_len {
            3 => read(bytes.as_chunks::<3>().0, least, ranges, intensities),
            4 => read(bytes.as_chunks::<4>().0, least, ranges, intensities),
            len => read(bytes.chunks_exact(len), least, ranges, intensities),
        }
    }

    #[inline]
    fn tail(&self) -> &'a [u8] {
        &self.payload[self.layout.tail..]
    }

    /// A byte of the tail; 0 where the tail ends before.
    #[inline]
    pub fn tail_byte(&self, place: usize) -> u8 {
        self.tail().get(place).copied().unwrap_or(0)
    }

    /// Mode of operation; 0 where the tail has none.
    #[inline]
    pub fn operation(&self) -> u8 {
        self.layout
            .fields
            .operation
            .map_or(0, |place| self.tail_byte(place))
    }

    /// State of the firing of a block, 0 to 3.
    #[inline]
    pub fn azimuth_state(&self, block: usize) -> u8 {
        let Some(place) = self.layout.fields.azimuth_state else {
            return 0;
        };
        let shift = 14_usize.saturating_sub(2 * block);
        (u16_at(self.tail(), place) >> shift & 3) as u8
    }

    /// Which returns it carries.
    #[inline]
    pub fn return_mode(&self) -> ReturnMode {
        modes::mode(self.tail_byte(self.layout.fields.return_mode))
    }

    /// Turns a minute; negative against the usual sense.
    #[inline]
    pub fn rpm(&self) -> f64 {
        let raw = u16_at(self.tail(), self.layout.fields.speed) as i16;
        f64::from(raw) * self.layout.fields.speed_rpm
    }

    /// Time in the tail.
    pub fn time(&self) -> Timestamp {
        let tail = self.tail();
        let micros = u32_at(tail, self.layout.fields.micros);
        let Some(place) = self.layout.fields.date else {
            return Timestamp(i64::from(micros) * 1000);
        };
        let date = tail
            .get(place..place + 6)
            .and_then(|bytes| bytes.try_into().ok());
        date::utc(date.unwrap_or_default(), micros)
    }

    /// Sequence number, where there is one.
    pub fn sequence(&self) -> Option<u32> {
        let Tail {
            sequence,
            sequence_len,
            ..
        } = self.layout.fields;
        let read = || match sequence_len {
            2 => u16_at(self.tail(), sequence).into(),
            _ => u32_at(self.tail(), sequence),
        };
        self.layout.has_sequence.then(read)
    }
}

/// Reads echoes of a size that the compiler may know.
#[inline(always)]
fn read<'a, E: AsRef<[u8]> + ?Sized + 'a>(
    echoes: impl IntoIterator<Item = &'a E>,
    least: u16,
    ranges: &mut [i32],
    intensities: &mut [u16],
) {
    let room = ranges.iter_mut().zip(intensities);
    for ((range, intensity), echo) in room.zip(echoes) {
        let [low, high, brightness, ..] = *echo.as_ref() else {
            continue;
        };
        let raw = u16::from_le_bytes([low, high]);
        *range = if raw < least { 0 } else { raw.into() };
        *intensity = brightness.into();
    }
}

#[inline]
fn u16_at(bytes: &[u8], place: usize) -> u16 {
    let pair = bytes
        .get(place..place + 2)
        .and_then(|two| two.try_into().ok());
    u16::from_le_bytes(pair.unwrap_or_default())
}

fn u32_at(bytes: &[u8], place: usize) -> u32 {
    let four = bytes
        .get(place..place + 4)
        .and_then(|four| four.try_into().ok());
    u32::from_le_bytes(four.unwrap_or_default())
}

/// Content of a packet, for tests and simulations.
#[derive(Debug, Clone, PartialEq)]
pub struct RawPacket {
    /// Time in the tail, whole microseconds.
    pub time: Timestamp,
    /// Sequence number, where the layout has one.
    pub sequence: u32,
    /// Return mode.
    pub return_mode: ReturnMode,
    /// Turns a minute.
    pub rpm: f64,
    /// Mode of operation or loop, where the tail has one.
    pub operation: u8,
    /// State of the firing by block, two bits each, the first block's highest.
    pub azimuth_state: u16,
    /// Azimuth in the model's unit, its fine part, and echoes by channel; for each block.
    pub blocks: Vec<RawBlock>,
}

/// One block.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RawBlock {
    /// Azimuth in the model's unit.
    pub azimuth: u16,
    /// Fine part of the azimuth, where the model has one.
    pub fine: u8,
    /// Echoes by channel.
    pub echoes: Vec<RawEcho>,
}

/// Writes a packet over `bytes`, which have the size and the header: the inverse of [`View`].
pub fn write(bytes: &mut [u8], layout: &Layout, packet: &RawPacket) {
    for (number, block) in packet.blocks.iter().enumerate().take(layout.blocks) {
        let start = layout.body + number * layout.block_len;
        let room = &mut bytes[start..start + layout.block_len];
        put(room, layout.azimuth, &block.azimuth.to_le_bytes());
        if layout.echoes > layout.azimuth + 2 {
            put(room, layout.azimuth + 2, &[block.fine]);
        }
        let places = room[layout.echoes..].chunks_exact_mut(layout.echo_len);
        for (place, echo) in places.zip(&block.echoes).take(layout.channels) {
            put(place, 0, &echo.range.to_le_bytes());
            put(place, 2, &[echo.intensity]);
        }
    }
    let fields = &layout.fields;
    let tail = &mut bytes[layout.tail..];
    let (date, micros) = date::bytes(packet.time);
    if let Some(place) = fields.date {
        put(tail, place, &date);
    }
    put(tail, fields.micros, &micros.to_le_bytes());
    put(tail, fields.return_mode, &[modes::byte(packet.return_mode)]);
    let speed = (packet.rpm / fields.speed_rpm).round() as i16;
    put(tail, fields.speed, &speed.to_le_bytes());
    if let Some(place) = fields.operation {
        put(tail, place, &[packet.operation]);
    }
    if let Some(place) = fields.azimuth_state {
        put(tail, place, &packet.azimuth_state.to_le_bytes());
    }
    if layout.has_sequence {
        let number = packet.sequence.to_le_bytes();
        put(tail, fields.sequence, &number[..fields.sequence_len]);
    }
}

fn put(room: &mut [u8], place: usize, bytes: &[u8]) {
    let range: Range<usize> = place..place + bytes.len();
    if let Some(room) = room.get_mut(range) {
        room.copy_from_slice(bytes);
    }
}
