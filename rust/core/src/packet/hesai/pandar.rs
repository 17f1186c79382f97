//! Pandar40P, 40M, 40AC and Pandar64: the models before the common header.
//!
//! Source: their manuals; firing times as the maker's files have them.

use std::sync::LazyLock;

use super::layout::View;
use super::layout::{Layout, Tail};
use super::rotating::{Family, Rotating};
use super::unit::Unit;
use crate::packet::{Counting, ReturnMode};
use crate::time::NANOS_PER_SECOND;

/// Time from one firing to the next.
const FIRING_NS: i64 = 55_560;
/// Unit of ranges, mm, where no header tells it.
const RANGE_UNIT_MM: u8 = 4;
/// Byte of a header that tells it.
const UNIT_MM: usize = 5;
/// Bytes of the tail with a sequence number, and without one.
const TAIL_LENS: [usize; 2] = [26, 22];
/// Bytes of the tail of old units, which ends before the date.
const SHORT_TAIL_LEN: usize = 16;

const TAIL: Tail = Tail {
    azimuth_state: None,
    operation: None,
    return_mode: 14,
    speed: 8,
    speed_rpm: 1.0,
    date: Some(16),
    micros: 10,
    sequence: 22,
    sequence_len: 4,
};

static UNIT_40P: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("pandar40p", include_str!("tables/pandar40p.csv")));
static UNIT_64: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("pandar64", include_str!("tables/pandar64.csv")));

/// Pandar40P and 40M.
pub static PANDAR40P: Rotating<Pandar> = Rotating(Pandar {
    id: "pandar40p",
    title: "Hesai Pandar40P",
    channels: 40,
    blocks: 10,
    most_blocks: 10,
    header_len: 0,
    block_head: [0xFF, 0xEE],
    last_block_ns: -28_580,
    has_date: true,
    unit: &UNIT_40P,
});

/// Old units whose packets end before the date.
pub static PANDAR40AC: Rotating<Pandar> = Rotating(Pandar {
    id: "pandar40ac",
    title: "Hesai Pandar40AC",
    has_date: false,
    ..PANDAR40P.0
});

/// Pandar64.
pub static PANDAR64: Rotating<Pandar> = Rotating(Pandar {
    id: "pandar64",
    title: "Hesai Pandar64",
    channels: 64,
    blocks: 6,
    most_blocks: 7,
    header_len: 8,
    block_head: [0, 0],
    last_block_ns: -42_580,
    has_date: true,
    unit: &UNIT_64,
});

/// One model.
#[derive(Debug, Clone, Copy)]
pub struct Pandar {
    id: &'static str,
    title: &'static str,
    channels: usize,
    blocks: usize,
    /// More blocks, which some units send.
    most_blocks: usize,
    /// Bytes before the first block: none, or `EE FF`, lasers, blocks, return mode, unit of ranges and two more.
    header_len: usize,
    /// First bytes of a block before its azimuth; zeros: none.
    block_head: [u8; 2],
    /// Time of the last block after the packet's.
    last_block_ns: i64,
    has_date: bool,
    unit: &'static LazyLock<Unit>,
}

impl Pandar {
    fn has_block_head(&self) -> bool {
        self.header_len == 0
    }

    fn azimuth(&self) -> usize {
        if self.has_block_head() { 2 } else { 0 }
    }

    fn block_len(&self) -> usize {
        self.azimuth() + 2 + 3 * self.channels
    }

    fn tail(&self, blocks: usize) -> usize {
        self.header_len + blocks * self.block_len()
    }

    fn is_own(&self, payload: &[u8], blocks: usize) -> bool {
        if self.has_block_head() {
            let mut blocks = payload.chunks_exact(self.block_len()).take(blocks);
            blocks.all(|block| block.starts_with(&self.block_head))
        } else {
            payload.starts_with(&[0xEE, 0xFF, self.channels as u8, blocks as u8])
        }
    }

    fn unit_m(&self, payload: &[u8]) -> f64 {
        let told = payload.get(UNIT_MM).filter(|_| !self.has_block_head());
        let told = told.filter(|unit_mm| (1..=10).contains(*unit_mm));
        f64::from(*told.unwrap_or(&RANGE_UNIT_MM)) * 1e-3
    }

    fn layout_of(&self, payload: &[u8], blocks: usize) -> Option<Layout> {
        let tail_len = payload.len().checked_sub(self.tail(blocks))?;
        let is_len = if self.has_date {
            TAIL_LENS.contains(&tail_len)
        } else {
            tail_len == SHORT_TAIL_LEN
        };
        (is_len && self.is_own(payload, blocks)).then(|| Layout {
            blocks,
            channels: self.channels,
            body: self.header_len,
            block_len: self.block_len(),
            azimuth: self.azimuth(),
            echoes: self.azimuth() + 2,
            echo_len: 3,
            unit_m: self.unit_m(payload),
            tail: self.tail(blocks),
            fields: Tail {
                date: TAIL.date.filter(|_| self.has_date),
                ..TAIL
            },
            has_sequence: tail_len == TAIL_LENS[0],
            len: payload.len(),
        })
    }

    fn firings_ns(&self, blocks: usize, mode: ReturnMode) -> i64 {
        (blocks / mode.returns()) as i64 * FIRING_NS
    }
}

impl Family for Pandar {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn layout(&self, payload: &[u8]) -> Option<Layout> {
        let mut counts = self.blocks..=self.most_blocks;
        counts.find_map(|blocks| self.layout_of(payload, blocks))
    }

    fn nominal(&self) -> &'static Unit {
        self.unit
    }

    fn block_ns(&self, view: &View<'_>, block: usize) -> i64 {
        let last = view.layout().blocks - 1;
        let behind = (last - block.min(last)) / view.return_mode().returns();
        self.last_block_ns - FIRING_NS * behind as i64
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        self.firings_ns(self.blocks, mode)
    }

    fn duration_ns(&self, view: &View<'_>) -> i64 {
        self.firings_ns(view.layout().blocks, view.return_mode())
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: (!self.has_date).then_some(NANOS_PER_SECOND),
            sequence_bits: self.has_date.then_some(32),
        }
    }

    fn template(&self) -> Vec<u8> {
        let tail_len = if self.has_date {
            TAIL_LENS[0]
        } else {
            SHORT_TAIL_LEN
        };
        let mut bytes = vec![0; self.tail(self.blocks) + tail_len];
        if self.has_block_head() {
            let blocks = bytes.chunks_exact_mut(self.block_len()).take(self.blocks);
            blocks.for_each(|block| block[..2].copy_from_slice(&self.block_head));
        } else {
            bytes[..4].copy_from_slice(&[0xEE, 0xFF, self.channels as u8, self.blocks as u8]);
            bytes[UNIT_MM] = RANGE_UNIT_MM;
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_units_of_seven_blocks_are_read_in_the_unit_that_their_header_tells() {
        let mut bytes = vec![0; 1388];
        bytes[..6].copy_from_slice(&[0xEE, 0xFF, 64, 7, 0, 2]);
        let layout = PANDAR64.0.layout(&bytes).unwrap();
        assert_eq!(
            (layout.blocks, layout.tail, layout.has_sequence),
            (7, 1366, false)
        );
        assert!((layout.unit_m - 0.002).abs() < 1e-12);
        bytes.resize(1392, 0);
        let view = View::new(&bytes, PANDAR64.0.layout(&bytes).unwrap()).unwrap();
        assert!(view.sequence().is_some());
        assert_eq!(PANDAR64.0.duration_ns(&view), 7 * FIRING_NS);
        assert_eq!(PANDAR64.0.block_ns(&view, 6), -42_580);
        bytes[3] = 6;
        assert!(PANDAR64.0.layout(&bytes).is_none());
    }
}
