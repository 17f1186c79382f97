//! QT128C2X (protocol 3.2): two loops of lasers take turns.
//!
//! A unit may be told to send a choice of its lasers; the maker's file of channels says which.
//!
//! Source: its manual and the maker's development kit.

use std::sync::LazyLock;

use super::layout::{Frame, Header, Layout, Tail, View, flag};
use super::rotating::{Family, Rotating};
use super::unit::Unit;
use crate::packet::ReturnMode;

/// Lasers of the model, and most channels of a block.
pub const LASERS: usize = 128;
const BLOCKS: usize = 2;
/// Time of the first firing after the packet's, and from one to the next.
const FIRST_NS: i64 = 9_000;
const FIRING_NS: i64 = 111_110;

const FRAME: Frame = Frame {
    block_head: 2,
    crc_len: 4,
    tail_len: 26,
    fields: Tail {
        azimuth_state: None,
        operation: Some(5),
        return_mode: 12,
        speed: 13,
        speed_rpm: 1.0,
        date: Some(15),
        micros: 21,
        sequence: 26,
        sequence_len: 4,
    },
};

static UNIT: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("qt128", include_str!("tables/qt128.csv")));

/// QT128C2X.
pub static QT128: Rotating<Qt128> = writer(LASERS);

/// The model.
#[derive(Debug, Clone, Copy)]
pub struct Qt128 {
    /// Channels of the blocks that it writes; it reads any number.
    channels: usize,
}

/// The model, which writes packets of a choice of `channels` lasers.
pub const fn writer(channels: usize) -> Rotating<Qt128> {
    Rotating(Qt128 { channels })
}

/// The flag that other models have for light: channels are a choice, as the maker's kit has it.
const CHOICE: u8 = flag::LIGHT;

/// Bytes of an echo; the flag of a choice may bring a byte of light or none.
fn echo_len(header: &Header, has_light: bool) -> usize {
    header.echo_len() - usize::from(header.has(CHOICE) && !has_light)
}

impl Family for Qt128 {
    fn id(&self) -> &'static str {
        "qt128"
    }

    fn title(&self) -> &'static str {
        "Hesai QT128C2X"
    }

    fn layout(&self, payload: &[u8]) -> Option<Layout> {
        let header = Header::new(payload)?;
        let is_own = header.protocol == (3, 2)
            && header.blocks == BLOCKS
            && (1..=LASERS).contains(&header.lasers);
        let sizes =
            [false, true].map(|has_light| FRAME.layout(&header, echo_len(&header, has_light)));
        let found = sizes.into_iter().find(|layout| layout.len == payload.len());
        found.filter(|_| is_own)
    }

    fn nominal(&self) -> &'static Unit {
        &UNIT
    }

    fn block_ns(&self, view: &View<'_>, block: usize) -> i64 {
        FIRST_NS + FIRING_NS * (block / view.return_mode().returns()) as i64
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        (BLOCKS / mode.returns().min(BLOCKS)) as i64 * FIRING_NS
    }

    /// With single returns the blocks are the loops; else the mode of operation tells the packet's loop.
    fn fire_times(&self, view: &View<'_>, block: usize) -> (usize, usize) {
        let is_second = if view.return_mode().returns() == 1 {
            block % 2 == 1
        } else {
            view.operation() & 1 == 0
        };
        (usize::from(is_second), usize::from(is_second))
    }

    /// Blocks that are not of all lasers, or that say so.
    fn chosen_loop(&self, view: &View<'_>, block: usize) -> Option<usize> {
        let is_choice = view.header().is_some_and(|header| header.has(CHOICE));
        let is_part = view.layout().channels < LASERS;
        (is_choice || is_part).then(|| self.fire_times(view, block).0)
    }

    fn remarks(&self, view: &View<'_>) -> Vec<String> {
        let channels = view.layout().channels;
        let remark = || {
            format!(
                "blocks of {channels} channels: only the sensor's channel configuration file tells which of its \
                 lasers they are, and without it they give no points: --beams ADDRESS=FILE"
            )
        };
        (channels < LASERS).then(remark).into_iter().collect()
    }

    fn template(&self) -> Vec<u8> {
        let choice = if self.channels < LASERS { CHOICE } else { 0 };
        let header = Header {
            protocol: (3, 2),
            version: 0,
            lasers: self.channels,
            blocks: BLOCKS,
            unit_mm: 4,
            returns: 1,
            flags: flag::SEQUENCE | flag::SAFETY | flag::SIGNATURE | flag::CONFIDENCE | choice,
        };
        FRAME.template(&header, echo_len(&header, false))
    }
}
