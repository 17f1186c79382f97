//! JT16: one column of 16 channels a packet (protocol 1.8).
//!
//! The packet tells neither the speed of the rotor nor the times of the channels: the speed follows from
//! packet to packet, and all channels of a packet share its time.
//!
//! Source: the maker's development kit.

use std::sync::LazyLock;

use super::layout::{Header, Layout, NOWHERE, Tail, View};
use super::rotating::{Family, Rotating};
use super::unit::Unit;
use crate::packet::{Counting, PacketKind, ReturnMode};

const LEN: usize = 80;
const INERTIAL_LEN: usize = 34;
const CHANNELS: usize = 16;
const BODY: usize = 16;
/// Byte of the header that tells points (0) from inertial values (1).
const DATA_TYPE: usize = 5;
/// 0.6 degrees at ten turns a second.
const PERIOD_NS: i64 = 166_667;

/// Places count from the start of the packet.
const FIELDS: Tail = Tail {
    azimuth_state: None,
    operation: None,
    return_mode: NOWHERE,
    speed: NOWHERE,
    speed_rpm: 1.0,
    date: Some(6),
    micros: 12,
    sequence: 74,
    sequence_len: 2,
};

static UNIT: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("jt16", include_str!("tables/jt16.csv")));

/// JT16.
pub static JT16: Rotating<Jt16> = Rotating(Jt16);

/// The model.
#[derive(Debug, Clone, Copy)]
pub struct Jt16;

fn is_own(payload: &[u8]) -> bool {
    Header::new(payload).is_some_and(|header| header.protocol == (1, 8))
}

impl Family for Jt16 {
    fn id(&self) -> &'static str {
        "jt16"
    }

    fn title(&self) -> &'static str {
        "Hesai JT16"
    }

    fn layout(&self, payload: &[u8]) -> Option<Layout> {
        let is_points = is_own(payload) && payload.len() == LEN && payload[DATA_TYPE] == 0;
        is_points.then_some(Layout {
            blocks: 1,
            channels: CHANNELS,
            body: BODY,
            block_len: 2 + 3 * CHANNELS,
            azimuth: 0,
            echoes: 2,
            echo_len: 3,
            unit_m: 0.004,
            tail: 0,
            fields: FIELDS,
            has_sequence: true,
            len: LEN,
        })
    }

    fn companion(&self, payload: &[u8]) -> Option<PacketKind> {
        let is_inertial =
            is_own(payload) && payload.len() == INERTIAL_LEN && payload[DATA_TYPE] == 1;
        is_inertial.then_some(PacketKind::Inertial)
    }

    fn nominal(&self) -> &'static Unit {
        &UNIT
    }

    fn block_ns(&self, _view: &View<'_>, _block: usize) -> i64 {
        0
    }

    fn period_ns(&self, _mode: ReturnMode) -> i64 {
        PERIOD_NS
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: Some(16),
        }
    }

    fn template(&self) -> Vec<u8> {
        let mut bytes = vec![0; LEN];
        bytes[..4].copy_from_slice(&[0xEE, 0xFF, 1, 8]);
        bytes
    }
}
