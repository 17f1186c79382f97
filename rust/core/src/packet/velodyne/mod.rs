//! Velodyne: one data packet of 1206 bytes for all models, little endian.
//!
//! Source: the manuals of VLP-16 (63-9243), HDL-32E (63-9113), VLP-32C (63-9325) and VLS-128 (63-9480).

mod board;
mod calibration;
pub mod hdl32e;
pub mod hdl64e;
mod lanes;
mod pairs;
#[cfg(test)]
mod plain;
pub mod position;
pub mod puck;
mod reach;
pub(super) mod rotation;
mod rows;
mod squeeze;
mod table;
mod tally;
pub mod vlp32;
pub mod vls128;
pub mod writer;

use crate::packet::echoes::RawEcho;
use crate::packet::{Misfit, ReturnMode};

/// Bytes of a data packet.
pub const LEN: usize = 1206;
/// Data blocks in a packet.
pub const BLOCKS: usize = 12;
/// Channels in a block.
pub const CHANNELS: usize = 32;
/// Hundredths of a degree in one turn, the unit of azimuths.
pub const TURN_CENTIDEG: u16 = 36_000;

/// Byte ranges; names and order follow the manual.
mod field {
    use std::ops::Range;

    pub const BLOCK_LEN: usize = 100;
    pub const FLAG: Range<usize> = 0..2; // in a block: FF EE for lasers 0 to 31, FF DD, FF CC, FF BB
    pub const AZIMUTH: Range<usize> = 2..4; // in a block: u16, 0.01 deg
    pub const RETURNS: Range<usize> = 4..100; // in a block: 32 x (u16 range, u8 intensity)
    pub const RETURN_LEN: usize = 3;
    pub const TIMESTAMP: Range<usize> = 1200..1204; // u32, microseconds past the hour
    pub const RETURN_MODE: usize = 1204;
    pub const PRODUCT: usize = 1205;
}

/// Which bytes of three words of eight returns belong to ranges.
const RANGE_BYTES: [u64; 3] = [
    0xFFFF_00FF_FF00_FFFF,
    0xFF00_FFFF_00FF_FF00,
    0x00FF_FF00_FFFF_00FF,
];
/// First byte of the flags of all blocks; the second tells the bank of lasers.
const FLAG_FIRST: u8 = 0xFF;
/// Second bytes of the flags of lasers 0 to 31, 32 to 63, 64 to 95 and 96 to 127.
const FLAG_BANKS: [u8; 4] = [0xEE, 0xDD, 0xCC, 0xBB];

/// One echo as it is stored: range in the model's unit; brightness 0 to 100 diffuse, 101 to 255
/// retroreflecting.
pub type RawReturn = RawEcho;

/// One block as it is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RawBlock {
    /// Bank of 32 lasers: 0 for lasers 0 to 31.
    pub bank: u8,
    /// Encoder azimuth at the first shot, 0.01 degree.
    pub azimuth_centideg: u16,
    /// Echoes by channel.
    pub returns: [RawReturn; CHANNELS],
}

/// Borrowed data packet. The array type carries the length, so no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct Packet<'a>(&'a [u8; LEN]);

impl<'a> Packet<'a> {
    /// Takes a payload of the right size; `None` for any other.
    pub fn new(payload: &'a [u8]) -> Option<Self> {
        payload.try_into().ok().map(Self)
    }

    #[inline(always)]
    fn block(&self, block: usize) -> &'a [u8] {
        let start = block % BLOCKS * field::BLOCK_LEN;
        &self.0[start..start + field::BLOCK_LEN]
    }

    /// Whether a block carries lasers 0 to 31.
    #[inline(always)]
    pub fn is_lower(&self, block: usize) -> bool {
        self.block(block)[field::FLAG] == [FLAG_FIRST, FLAG_BANKS[0]]
    }

    /// The bank of 32 lasers that a block carries; `None` where its flag is none.
    pub fn bank(&self, block: usize) -> Option<usize> {
        let flag = &self.block(block)[field::FLAG];
        let bank = FLAG_BANKS.iter().position(|second| *second == flag[1]);
        bank.filter(|_| flag[0] == FLAG_FIRST)
    }

    /// Whether the blocks carry these banks, in turn.
    pub fn has_banks(&self, banks: &[usize]) -> bool {
        let mut expected = banks.iter().cycle();
        (0..BLOCKS).all(|block| self.bank(block) == expected.next().copied())
    }

    /// Azimuth of a block, 0.01 degree; 36000 and above are not valid.
    #[inline(always)]
    pub fn azimuth_centideg(&self, block: usize) -> u16 {
        let bytes = &self.block(block)[field::AZIMUTH];
        u16::from_le_bytes([bytes[0], bytes[1]])
    }

    /// Encoder azimuths of all blocks, 0.01 degree.
    #[inline(always)]
    pub fn azimuths_centideg(&self) -> [u16; BLOCKS] {
        let (blocks, _) = self.0.as_chunks::<{ field::BLOCK_LEN }>();
        std::array::from_fn(|block| u16::from_le_bytes([blocks[block][2], blocks[block][3]]))
    }

    /// Echoes of a block by channel.
    pub fn returns(&self, block: usize) -> impl ExactSizeIterator<Item = RawReturn> + 'a {
        let echoes = self.block(block)[field::RETURNS].chunks_exact(field::RETURN_LEN);
        echoes.map(|bytes| RawReturn {
            range: u16::from_le_bytes([bytes[0], bytes[1]]),
            intensity: bytes[2],
        })
    }

    /// The same, all at once.
    pub fn echoes(&self, block: usize) -> [RawReturn; CHANNELS] {
        let bytes = self.returns_of(block);
        std::array::from_fn(|k| RawReturn {
            range: u16::from_le_bytes([bytes[3 * k], bytes[3 * k + 1]]),
            intensity: bytes[3 * k + 2],
        })
    }

    /// Bytes of the returns of a block.
    #[inline(always)]
    fn returns_of(&self, block: usize) -> &'a [u8; CHANNELS * field::RETURN_LEN] {
        let start = block % BLOCKS * field::BLOCK_LEN + field::RETURNS.start;
        self.0[start..]
            .first_chunk()
            .expect("a block of the packet")
    }

    /// Whether any shot of a block has a range.
    #[inline(always)]
    fn has_echoes(&self, block: usize) -> bool {
        let (words, _) = self.returns_of(block).as_chunks::<8>();
        let ranges = (words.iter().zip(RANGE_BYTES.iter().cycle())).fold(0, |any, (word, mask)| {
            any | u64::from_le_bytes(*word) & mask
        });
        ranges != 0
    }

    /// The same of so many blocks.
    #[inline(always)]
    fn any_has_echoes(&self, block: usize, blocks: usize) -> bool {
        (block..block + blocks).any(|block| self.has_echoes(block))
    }

    /// Bytes of the returns of a block, and to each the one that follows it in the packet.
    #[inline(always)]
    fn returns_and_next(&self, block: usize) -> (&'a [u8], &'a [u8]) {
        let start = block % BLOCKS * field::BLOCK_LEN;
        let place = |from: usize| from + field::RETURNS.start..from + field::RETURNS.end;
        (&self.0[place(start)], &self.0[place(start + 1)])
    }

    /// Device time of the first shot, microseconds past the hour.
    pub fn timestamp_us(&self) -> u32 {
        let bytes = &self.0[field::TIMESTAMP];
        u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
    }

    /// Byte of the return mode.
    pub fn return_mode_byte(&self) -> u8 {
        self.0[field::RETURN_MODE]
    }

    /// Return mode; old firmware leaves 0, which means the strongest.
    pub fn return_mode(&self) -> ReturnMode {
        match self.return_mode_byte() {
            0x38 => ReturnMode::Last,
            0x39 => ReturnMode::Dual,
            _ => ReturnMode::Strongest,
        }
    }

    /// Byte of the product.
    pub fn product(&self) -> u8 {
        self.0[field::PRODUCT]
    }
}

/// Products that send packets of this size.
const PRODUCTS: [(u8, &str); 8] = [
    (0x10, "a Leishen C16"),
    (0x20, "a Leishen C32"),
    (0x21, "a Velodyne HDL-32E"),
    (0x22, "a Velodyne VLP-16 or Puck LITE"),
    (0x23, "a Velodyne VLP-32A or B"),
    (0x24, "a Velodyne Puck Hi-Res"),
    (0x28, "a Velodyne VLP-32C"),
    (0xA1, "a Velodyne VLS-128"),
];

/// Why a payload is not of the model `id`, which sends packets of this family.
fn misfit(payload: &[u8], id: &'static str) -> Misfit {
    let Some(packet) = Packet::new(payload) else {
        let why = format!("{} bytes instead of {LEN}", payload.len());
        return Misfit { why, may_be: None };
    };
    let (mode, product) = (packet.return_mode_byte(), packet.product());
    if !packet.is_lower(0) {
        let why = "the size fits Velodyne, the block flags do not".into();
        return Misfit { why, may_be: None };
    }
    match PRODUCTS.iter().find(|(known, _)| *known == product) {
        Some((_, name)) => Misfit {
            why: format!("by its factory bytes (0x{mode:02x} 0x{product:02x}) {name}"),
            may_be: None,
        },
        None => Misfit {
            why: format!(
                "the size fits Velodyne, the factory bytes (0x{mode:02x} 0x{product:02x}) do not"
            ),
            may_be: Some(id),
        },
    }
}

/// Writes a data packet: the inverse of [`Packet`].
pub fn encode(
    blocks: &[RawBlock; BLOCKS],
    timestamp_us: u32,
    mode: ReturnMode,
    product: u8,
) -> [u8; LEN] {
    let mut bytes = [0; LEN];
    for (block, room) in blocks.iter().zip(bytes.chunks_exact_mut(field::BLOCK_LEN)) {
        encode_block(block, room);
    }
    bytes[field::TIMESTAMP].copy_from_slice(&timestamp_us.to_le_bytes());
    bytes[field::RETURN_MODE] = match mode {
        ReturnMode::Last => 0x38,
        ReturnMode::Dual => 0x39,
        _ => 0x37,
    };
    bytes[field::PRODUCT] = product;
    bytes
}

fn encode_block(block: &RawBlock, room: &mut [u8]) {
    let second = FLAG_BANKS[usize::from(block.bank) % FLAG_BANKS.len()];
    room[field::FLAG].copy_from_slice(&[FLAG_FIRST, second]);
    room[field::AZIMUTH].copy_from_slice(&block.azimuth_centideg.to_le_bytes());
    let places = room[field::RETURNS].chunks_exact_mut(field::RETURN_LEN);
    for (place, echo) in places.zip(&block.returns) {
        place[..2].copy_from_slice(&echo.range.to_le_bytes());
        place[2] = echo.intensity;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let mut blocks = [RawBlock::default(); BLOCKS];
        for (number, block) in (0_u8..).zip(&mut blocks) {
            block.azimuth_centideg = 35_900 + u16::from(number);
            block.returns[31] = RawReturn {
                range: 0x1234 + u16::from(number),
                intensity: 200 + number,
            };
        }
        let bytes = encode(&blocks, 3_599_999_999, ReturnMode::Dual, 0x22);
        let packet = Packet::new(&bytes).unwrap();
        for (number, block) in blocks.iter().enumerate() {
            assert!(packet.is_lower(number));
            assert_eq!(packet.azimuth_centideg(number), block.azimuth_centideg);
            assert!(packet.returns(number).eq(block.returns));
        }
        assert_eq!(packet.timestamp_us(), 3_599_999_999);
        assert_eq!(packet.return_mode(), ReturnMode::Dual);
        assert_eq!(packet.product(), 0x22);
        // Written out by hand from the manual: block 1, channel 31 at 100 + 4 + 93.
        assert_eq!(bytes[197..200], [0x35, 0x12, 201]);
        assert_eq!(bytes[100..104], [0xFF, 0xEE, 0x3D, 0x8C]);
    }

    #[test]
    fn another_size_is_no_packet() {
        assert!(Packet::new(&[0; LEN - 1]).is_none());
        assert!(Packet::new(&[0; LEN + 1]).is_none());
    }
}
