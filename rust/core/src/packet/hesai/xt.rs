//! PandarXT-16, XT-32, XT32M2X (protocol 6.1) and PandarQT64 (protocol 3.1).
//!
//! Source: their manuals; firing times as the maker's files have them.

use std::sync::LazyLock;

use super::layout::{Frame, Header, Layout, Tail, View, flag};
use super::rotating::{Family, Rotating};
use super::unit::Unit;
use crate::packet::ReturnMode;

/// Bytes of an echo: range, brightness and one that is not used.
const ECHO_LEN: usize = 4;

const TAIL_XT: Tail = Tail {
    azimuth_state: None,
    operation: None,
    return_mode: 10,
    speed: 11,
    speed_rpm: 1.0,
    date: Some(13),
    micros: 19,
    sequence: 24,
    sequence_len: 4,
};
const TAIL_QT: Tail = Tail {
    return_mode: 16,
    speed: 10,
    date: Some(18),
    micros: 12,
    ..TAIL_XT
};
/// Bytes of both tails without the sequence number, which old units do not send.
const TAIL_LEN: usize = 24;

static UNIT_XT16: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("xt16", include_str!("tables/pandarxt16.csv")));
static UNIT_XT32: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("xt32", include_str!("tables/pandarxt32.csv")));
static UNIT_XT32M: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("xt32m2x", include_str!("tables/xt32m2x.csv")));
static UNIT_QT64: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("qt64", include_str!("tables/pandarqt64.csv")));

/// PandarXT-16.
pub static XT16: Rotating<Xt> = Rotating(Xt {
    id: "xt16",
    title: "Hesai PandarXT-16",
    protocol: (6, 1),
    channels: 16,
    blocks: 8,
    unit_mm: 4,
    tail: &TAIL_XT,
    timing: Timing::BeforeLast { firing_ns: 50_000 },
    unit: &UNIT_XT16,
});

/// PandarXT-32.
pub static XT32: Rotating<Xt> = Rotating(Xt {
    id: "xt32",
    title: "Hesai PandarXT-32",
    channels: 32,
    unit: &UNIT_XT32,
    ..XT16.0
});

/// XT32M2X.
pub static XT32M2X: Rotating<Xt> = Rotating(Xt {
    id: "xt32m2x",
    title: "Hesai XT32M2X",
    blocks: 6,
    unit_mm: 5,
    unit: &UNIT_XT32M,
    ..XT32.0
});

/// PandarQT64.
pub static QT64: Rotating<Xt> = Rotating(Xt {
    id: "qt64",
    title: "Hesai PandarQT64",
    protocol: (3, 1),
    channels: 64,
    blocks: 4,
    unit_mm: 4,
    tail: &TAIL_QT,
    timing: Timing::AfterFirst {
        first_ns: 25_710,
        firing_ns: 166_670,
    },
    unit: &UNIT_QT64,
});

/// When blocks fire.
#[derive(Debug, Clone, Copy)]
enum Timing {
    /// The packet's time is that of its last firing.
    BeforeLast { firing_ns: i64 },
    /// The packet's time is before its first firing.
    AfterFirst { first_ns: i64, firing_ns: i64 },
}

/// One model.
#[derive(Debug, Clone, Copy)]
pub struct Xt {
    id: &'static str,
    title: &'static str,
    protocol: (u8, u8),
    channels: usize,
    blocks: usize,
    /// Unit of ranges that the model usually has.
    unit_mm: u8,
    tail: &'static Tail,
    timing: Timing,
    unit: &'static LazyLock<Unit>,
}

impl Xt {
    fn frame(&self) -> Frame {
        Frame {
            block_head: 2,
            crc_len: 0,
            tail_len: TAIL_LEN,
            fields: *self.tail,
        }
    }
}

impl Family for Xt {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn layout(&self, payload: &[u8]) -> Option<Layout> {
        let header = Header::new(payload)?;
        let is_own = header.protocol == self.protocol
            && (header.lasers, header.blocks) == (self.channels, self.blocks);
        // Of the flags these models have one; some set it not and send the number all the same.
        let sized = [flag::SEQUENCE, header.flags & flag::SEQUENCE].map(|flags| {
            let header = Header { flags, ..header };
            self.frame().layout(&header, ECHO_LEN)
        });
        let found = sized.into_iter().find(|layout| layout.len == payload.len());
        found.filter(|_| is_own)
    }

    fn nominal(&self) -> &'static Unit {
        self.unit
    }

    fn block_ns(&self, view: &View<'_>, block: usize) -> i64 {
        let returns = view.return_mode().returns();
        match self.timing {
            Timing::BeforeLast { firing_ns } => {
                let behind = (self.blocks - 1).saturating_sub(block) / returns;
                -firing_ns * behind as i64
            }
            Timing::AfterFirst {
                first_ns,
                firing_ns,
            } => first_ns + firing_ns * (block / returns) as i64,
        }
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        let (Timing::BeforeLast { firing_ns } | Timing::AfterFirst { firing_ns, .. }) = self.timing;
        (self.blocks / mode.returns()) as i64 * firing_ns
    }

    fn template(&self) -> Vec<u8> {
        let header = Header {
            protocol: self.protocol,
            version: 0,
            lasers: self.channels,
            blocks: self.blocks,
            unit_mm: self.unit_mm,
            returns: 1,
            flags: flag::SEQUENCE,
        };
        self.frame().template(&header, ECHO_LEN)
    }
}
