//! The models: what they differ in, how packets become returns.
//!
//! Length and first bytes tell the model, and a type byte where it is known; but for an M1 Plus, which
//! sends what an M1 sends.

use super::blocks::{Blocks, Point};
use super::columns::Columns;
use super::decoder::SolidDecoder;
use super::description::{self, Angles};
use super::header;
use super::joined;
use crate::error::UnitError;
use crate::loss::cycle::Restarts;
use crate::packet::echoes::RawEcho;
use crate::packet::frames::place_rad;
use crate::packet::unit::{Calibration, Fitted, UnitFacts, UnitFile};
use crate::packet::{Counting, Head, Misfit, Model, PacketKind, ReturnMode, Tally};

/// Time of a frame at the rate that sensors are delivered with.
const FRAME_NS: i64 = 100_000_000;
/// Types that are known.
const KINDS: [u8; 4] = [0x10, 0x42, 0x62, 0x70];
/// How to get the pitch of the rows.
const OBTAIN: &str = "record the packets that describe the unit as well (DIFOP2, port 7766, every two seconds), or give a \
    capture that has one: --beams ADDRESS=FILE";

/// What a packet holds.
#[derive(Debug, Clone, Copy)]
pub enum Body {
    /// Blocks of points that tell where they are.
    Blocks(Blocks),
    /// A column or a part of one.
    Columns(Columns),
}

/// A model.
#[derive(Debug, Clone, Copy)]
pub struct Solid {
    id: &'static str,
    title: &'static str,
    candidates: &'static [&'static str],
    /// Type byte, where it is known.
    kind: Option<u8>,
    /// What its packets hold.
    pub body: Body,
    /// Ranges that are echoes: the maker's limits.
    pub(super) limits: Limits,
    /// Number of the first packet of a frame.
    first: u32,
    /// Packets of a frame with one and with two returns.
    frame: (i64, i64),
    /// The two returns of a shot.
    dual: ReturnMode,
    is_told: bool,
}

const fn blocks(
    len: usize,
    count: usize,
    block_len: usize,
    time_len: usize,
    has_return: bool,
    points: usize,
    point: Point,
) -> Body {
    let point_len = match point {
        Point::Angles => 9,
        Point::Vector => 10,
        Point::Pair => 13,
    };
    Body::Blocks(Blocks {
        len,
        count,
        block_len,
        time_len,
        has_return,
        points,
        point,
        point_len,
    })
}

/// M1.
pub static M1: Solid = Solid {
    id: "m1",
    title: "RoboSense M1",
    candidates: &["m1-plus"],
    kind: Some(0x10),
    body: blocks(1210, 25, 47, 1, true, 5, Point::Angles),
    limits: Limits(40, 40_000),
    first: 1,
    frame: (630, 1260),
    dual: ReturnMode::Dual,
    is_told: true,
};
/// M1 Plus, when it is named.
pub static M1_PLUS: Solid = Solid {
    id: "m1-plus",
    title: "RoboSense M1 Plus",
    candidates: &["m1"],
    is_told: false,
    ..M1
};
/// M1 whose packets come joined into large datagrams: points without the two bytes that nothing uses.
pub static M1_JUMBO: Solid = Solid {
    id: "m1-jumbo",
    title: "RoboSense M1 (jumbo)",
    candidates: &[],
    body: Body::Blocks(Blocks {
        len: joined::PIECE_LEN,
        count: 25,
        block_len: 37,
        time_len: 1,
        has_return: true,
        points: 5,
        point: Point::Angles,
        point_len: 7,
    }),
    ..M1
};
/// M2.
pub static M2: Solid = Solid {
    id: "m2",
    title: "RoboSense M2",
    candidates: &[],
    kind: None,
    body: blocks(1342, 25, 52, 1, true, 5, Point::Vector),
    limits: Limits(40, 50_000),
    frame: (1260, 2520),
    ..M1
};
/// M3.
pub static M3: Solid = Solid {
    id: "m3",
    title: "RoboSense M3",
    body: blocks(1448, 5, 282, 2, false, 28, Point::Vector),
    limits: Limits(20, 60_000),
    frame: (2270, 4540),
    ..M2
};
/// MX.
pub static MX: Solid = Solid {
    id: "mx",
    title: "RoboSense MX",
    body: blocks(1404, 50, 27, 1, false, 2, Point::Pair),
    limits: Limits(40, 40_000),
    frame: (630, 630),
    ..M2
};
/// E1.
pub static E1: Solid = Solid {
    id: "e1",
    title: "RoboSense E1",
    kind: Some(0x62),
    body: blocks(1200, 96, 12, 2, false, 1, Point::Vector),
    limits: Limits(1, 40_000),
    first: 0,
    frame: (288, 576),
    ..M2
};
/// EMX.
pub static EMX: Solid = Solid {
    id: "emx",
    title: "RoboSense EMX",
    kind: Some(0x42),
    body: Body::Columns(Columns::Emx),
    limits: Limits(40, 60_000),
    frame: (1520, 3040),
    dual: ReturnMode::FirstLast,
    ..M2
};
/// EM4.
pub static EM4: Solid = Solid {
    id: "em4",
    title: "RoboSense EM4",
    kind: Some(0x70),
    body: Body::Columns(Columns::Em4),
    limits: Limits(1, u16::MAX),
    frame: (2400, 4800),
    dual: ReturnMode::FirstSecond,
    ..M2
};

/// Smallest and largest range that is one, in units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits(u16, u16);

impl Limits {
    /// An echo, without range where it lies outside.
    #[inline(always)]
    pub fn cut(self, (range, intensity): (u16, u8)) -> RawEcho {
        let is_inside = (self.0..=self.1).contains(&range);
        RawEcho {
            range: if is_inside { range } else { 0 },
            intensity,
        }
    }
}

impl Solid {
    fn len(&self) -> usize {
        match self.body {
            Body::Blocks(blocks) => blocks.len,
            Body::Columns(columns) => columns.len(),
        }
    }

    /// Type byte of its packets.
    pub fn kind(&self) -> u8 {
        self.kind.unwrap_or(0)
    }

    /// Packets of a frame as the maker states them.
    pub fn packets(&self, mode: ReturnMode) -> i64 {
        if mode.returns() == 1 {
            self.frame.0
        } else {
            self.frame.1
        }
    }

    /// Number of the first packet of a frame.
    pub fn first_number(&self) -> u32 {
        self.first
    }

    /// Return mode that stands for two returns.
    pub fn dual(&self) -> ReturnMode {
        self.dual
    }

    fn is_packet(&self, payload: &[u8]) -> bool {
        let is_sound = match self.body {
            Body::Blocks(_) => true,
            Body::Columns(columns) => columns.is_sound(payload),
        };
        is_sound && header::is_packet(payload, self.len())
    }

    pub(super) fn mode(&self, payload: &[u8]) -> ReturnMode {
        header::return_mode(payload, self.dual)
    }

    /// Returns of a shot that stand side by side in a packet.
    pub(super) fn returns(&self, payload: &[u8]) -> usize {
        match self.body {
            Body::Blocks(blocks) if blocks.point != Point::Pair => 1,
            _ => self.mode(payload).returns(),
        }
    }

    /// Packets of a frame and its time.
    fn frame(&self, payload: &[u8]) -> (i64, i64) {
        let mode = self.mode(payload);
        match self.body {
            Body::Blocks(_) => (self.packets(mode), FRAME_NS),
            Body::Columns(columns) => {
                let len = columns.frame_len(payload, mode.returns());
                (len, columns.frame_ns(payload))
            }
        }
    }

    fn device_ns(&self, payload: &[u8]) -> i64 {
        let lead_ns = match self.body {
            Body::Blocks(_) => 0,
            Body::Columns(columns) => columns.lead_ns(payload),
        };
        header::time_ns(payload).saturating_sub(lead_ns)
    }

    /// Echoes of each shot, the second where two returns stand side by side.
    fn echoes(&self, blocks: &Blocks, payload: &[u8]) -> impl Iterator<Item = [RawEcho; 2]> {
        let points = blocks.blocks(payload).flat_map(|block| block.points());
        points.map(move |point| blocks.point.echoes(point).map(|echo| self.limits.cut(echo)))
    }
}

impl Model for Solid {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn candidates(&self) -> &'static [&'static str] {
        self.candidates
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        if let Some(kind) = description::kind(payload) {
            return Some(kind);
        }
        let kind = header::kind(payload);
        let is_others = self.kind != Some(kind) && KINDS.contains(&kind);
        let is_own = self.is_told && !is_others && self.is_packet(payload);
        is_own.then_some(PacketKind::Data)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        self.is_packet(payload)
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let kind = header::kind(payload);
        Misfit {
            why: format!(
                "{} bytes of type {kind:#04x} are not those of {}",
                payload.len(),
                self.title
            ),
            may_be: Some(self.id),
        }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        if !self.is_packet(payload) {
            return None;
        }
        let number = header::number(payload);
        let (len, frame_ns) = self.frame(payload);
        let (azimuth_rad, turned_rad) = place_rad(i64::from(number) - i64::from(self.first), len);
        let duration_ns = (frame_ns / len).max(1);
        Some(Head {
            device_ns: self.device_ns(payload),
            sequence: Some(number),
            azimuth_rad,
            turned_rad,
            rate_rad_per_ns: turned_rad / duration_ns as f64,
            duration_ns,
            left_out: None,
            return_mode: self.mode(payload),
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        if !self.is_packet(payload) {
            return tally;
        }
        let returns = self.returns(payload);
        match self.body {
            Body::Blocks(blocks) => {
                for [one, other] in self.echoes(&blocks, payload) {
                    tally.add_pair(one.range, if returns == 2 { other.range } else { 0 });
                }
            }
            Body::Columns(columns) => {
                let echo = |point| self.limits.cut(columns.echo(point)).range;
                for shot in columns.points(payload).chunks_exact(returns) {
                    let other = shot.get(1).map_or(0, echo);
                    tally.add_pair(echo(&shot[0]), other);
                }
            }
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        FRAME_NS / self.packets(mode)
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: Some(16),
        }
    }

    fn restarts(&self) -> Option<Restarts> {
        Some(Restarts::EveryFrame)
    }

    fn has_rotor(&self) -> bool {
        false
    }

    fn takes(&self, file: &UnitFile) -> bool {
        match self.body {
            Body::Columns(columns) => Angles::of_file(columns, file).is_some(),
            Body::Blocks(_) => self.id == E1.id && description::is_e1(file),
        }
    }

    fn describe(&self, files: &[UnitFile]) -> UnitFacts {
        match self.body {
            Body::Blocks(_) if self.id == E1.id => description::of_e1(files),
            _ => UnitFacts::default(),
        }
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        let Body::Columns(columns) = self.body else {
            return Ok(Fitted {
                decoder: Box::new(SolidDecoder::new(*self, None)),
                calibration: Calibration::Factory,
            });
        };
        let told = files
            .iter()
            .find_map(|file| Some((file, Angles::of_file(columns, file)?)));
        let (angles, calibration) = match (told, columns) {
            (Some((file, angles)), _) => (angles, Calibration::of(&[file], Calibration::Factory)),
            (None, Columns::Emx) => (
                Angles::nominal_emx(),
                Calibration::Nominal { obtain: OBTAIN },
            ),
            (None, Columns::Em4) => {
                return Err(UnitError::Missing {
                    model: self.title,
                    obtain: OBTAIN,
                });
            }
        };
        Ok(Fitted {
            decoder: Box::new(SolidDecoder::new(*self, Some(&angles))),
            calibration,
        })
    }
}
