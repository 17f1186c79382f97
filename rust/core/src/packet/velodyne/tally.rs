//! Numbers of points in a packet, without placing them.

use super::rows::is_usable;
use super::{BLOCKS, CHANNELS, Packet};
use crate::packet::Tally;
use crate::simd::{Kernel, vectorized};

/// Numbers of points in a data packet of one bank.
pub fn tally(payload: &[u8]) -> Tally {
    let Some(packet) = Packet::new(payload) else {
        return Tally::default();
    };
    if packet.return_mode().returns() == 1 {
        return Tally {
            points: vectorized(CountHits(packet)),
            ..Tally::default()
        };
    }
    let mut tally = Tally::default();
    for row in (0..BLOCKS / 2).filter(|row| is_usable(&packet, *row, 2)) {
        let (first, second) = (packet.returns(2 * row), packet.returns(2 * row + 1));
        for (last, strongest) in first.zip(second) {
            tally.add_pair(last.range, strongest.range);
        }
    }
    tally
}

/// Which pairs of bytes are ranges: the first of every three, told by all bits.
const IS_RANGE: [u8; 3 * CHANNELS] = {
    let mut is_range = [0; 3 * CHANNELS];
    let mut shot = 0;
    while shot < CHANNELS {
        is_range[3 * shot] = u8::MAX;
        shot += 1;
    }
    is_range
};

/// Shots of a packet of single returns that hit.
struct CountHits<'a>(Packet<'a>);

impl Kernel for CountHits<'_> {
    type Out = u32;

    /// Looks at all pairs of bytes that follow each other, side by side: every third is a range.
    #[inline(always)]
    fn run(self) -> u32 {
        let mut hits = [0_u8; 3 * CHANNELS];
        for block in (0..BLOCKS).filter(|block| is_usable(&self.0, *block, 1)) {
            let (low, high) = self.0.returns_and_next(block);
            for (hits, (low, high)) in hits.iter_mut().zip(low.iter().zip(high)) {
                *hits = hits.wrapping_add(u8::from(low | high != 0)); // at most one per block
            }
        }
        let of_ranges = hits.iter().zip(&IS_RANGE);
        of_ranges.map(|(hits, own)| u32::from(hits & own)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::ReturnMode;
    use crate::packet::velodyne::{RawBlock, RawReturn, encode};

    #[test]
    fn shots_with_a_range_of_usable_blocks_are_counted() {
        let mut blocks = [RawBlock::default(); BLOCKS];
        for (number, block) in blocks.iter_mut().enumerate() {
            for (shot, echo) in block.returns.iter_mut().enumerate() {
                let range = [0, 1, 0x100, 0xFFFF, 0][(shot + number) % 5];
                *echo = RawReturn {
                    range,
                    intensity: 9,
                };
            }
        }
        blocks[3].bank = 1;
        blocks[11].azimuth_centideg = 36_000;
        let payload = encode(&blocks, 1, ReturnMode::Strongest, 0x22);
        let usable = [0, 1, 2, 4, 5, 6, 7, 8, 9, 10].map(|number: usize| &blocks[number]);
        let echoes = usable.iter().flat_map(|block| block.returns);
        let hits = echoes.filter(|echo| echo.range != 0).count();
        assert_eq!(tally(&payload).points as usize, hits);
    }
}
