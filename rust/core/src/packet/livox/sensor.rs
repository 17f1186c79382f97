//! The models: what they differ in, how packets become returns.
//!
//! The first protocol names no model. Its data types and the time between packets tell Mid-40, Mid-70 and
//! the sensors of 240 000 shots a second apart; which of the latter it is, nothing tells. In the second
//! protocol the time between points tells Mid-360 and HAP.

use super::account::{self, Account};
use super::decoder::{LivoxDecoder, meanings};
use super::shots::{Packet, Step};
use super::{sdk1, sdk2};
use crate::error::UnitError;
use crate::loss::cycle::Restarts;
use crate::packet::echoes;
use crate::packet::frames::{RAD_PER_NS, phase_rad};
use crate::packet::unit::{Calibration, Fitted, Gather, UnitFacts, UnitFile};
use crate::packet::{Counting, Head, Misfit, Model, PacketKind, ReturnMode, Tally};

/// Which development kit speaks the protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// The first.
    First,
    /// The second.
    Second,
}

impl Protocol {
    /// Bits of a tag that doubt a point. The first protocol tells the number of the return in two others.
    pub fn doubt_bits(self) -> u8 {
        match self {
            Self::First => 0b1100_1111,
            Self::Second => 0b0011_1111,
        }
    }
}

/// A model.
#[derive(Debug, Clone, Copy)]
pub struct Livox {
    id: &'static str,
    title: &'static str,
    candidates: &'static [&'static str],
    /// Its protocol.
    pub protocol: Protocol,
    /// Data types that it sends.
    types: &'static [u8],
    /// Whether its packets can be told at all, be it together with candidates.
    is_told: bool,
    step: Step,
    /// Lasers that fire one after the other.
    pub(super) lines: u16,
    /// Whether its packets number the frames.
    counts_frames: bool,
}

/// 100 000 shots a second.
const SLOW: Step = Step::new(10_000, 1);
/// 240 000 shots a second.
const FAST: Step = Step::new(12_500, 3);
/// Types of the sensors of the first protocol beside the oldest.
const TAGGED: &[u8] = &[2, 3, 4, 5, 7, 8];
/// Steps between shots may differ from the model's by this share.
const STEP_TOLERANCE: f64 = 0.25;

const fn first(
    id: &'static str,
    title: &'static str,
    candidates: &'static [&'static str],
    types: &'static [u8],
    step: Step,
    lines: u16,
) -> Livox {
    Livox {
        id,
        title,
        candidates,
        protocol: Protocol::First,
        types,
        is_told: true,
        step,
        lines,
        counts_frames: false,
    }
}

const fn second(id: &'static str, title: &'static str, step: Step, lines: u16) -> Livox {
    Livox {
        id,
        title,
        candidates: &[],
        protocol: Protocol::Second,
        types: &[1, 2, 3, 0x11],
        is_told: true,
        step,
        lines,
        counts_frames: false,
    }
}

/// Mid-40; one head of a Mid-100 is one.
pub static MID_40: Livox = first("mid40", "Livox Mid-40", &[], &[0, 1], SLOW, 1);
/// Mid-70.
pub static MID_70: Livox = first("mid70", "Livox Mid-70", &[], TAGGED, SLOW, 1);
/// Avia.
pub static AVIA: Livox = first(
    "avia",
    "Livox Avia",
    &["horizon", "tele15"],
    TAGGED,
    FAST,
    6,
);
/// Horizon, when it is named.
pub static HORIZON: Livox = Livox {
    is_told: false,
    ..first(
        "horizon",
        "Livox Horizon",
        &["avia", "tele15"],
        TAGGED,
        FAST,
        6,
    )
};
/// Tele-15, when it is named.
pub static TELE_15: Livox = Livox {
    is_told: false,
    ..first(
        "tele15",
        "Livox Tele-15",
        &["avia", "horizon"],
        TAGGED,
        FAST,
        6,
    )
};
/// Mid-360: 200 000 shots a second.
pub static MID_360: Livox = second("mid360", "Livox Mid-360", Step::new(5_000, 1), 4);
/// HAP: 452 000 shots a second.
pub static HAP: Livox = Livox {
    counts_frames: true,
    ..second("hap", "Livox HAP", Step::new(250_000, 113), 6)
};

impl Livox {
    /// Reads a data packet of this protocol and of a type that the model sends.
    pub fn read<'a>(&self, payload: &'a [u8]) -> Option<Packet<'a>> {
        match self.protocol {
            Protocol::First => {
                let kind = sdk1::data_type(payload)?;
                let is_own = self.types.contains(&kind);
                sdk1::read(payload, self.step).filter(|_| is_own)
            }
            Protocol::Second => sdk2::read(payload, self.step),
        }
    }

    /// Data types of its packets.
    pub fn types(&self) -> &'static [u8] {
        self.types
    }

    /// Time from shot to shot.
    pub fn step(&self) -> Step {
        self.step
    }
}

impl Model for Livox {
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
        let (is_inertial, is_command) = match self.protocol {
            Protocol::First => (sdk1::is_inertial(payload), sdk1::is_command(payload)),
            Protocol::Second => (sdk2::is_inertial(payload), sdk2::is_command(payload)),
        };
        if is_inertial {
            return Some(PacketKind::Inertial);
        }
        if is_command {
            return Some(PacketKind::Status);
        }
        let packet = self.read(payload).filter(|_| self.is_told);
        packet.map(|_| PacketKind::Data)
    }

    /// Packets of the second protocol tell the step between shots; those of the first have to come in time.
    fn is_sure(&self, payload: &[u8]) -> bool {
        let told = match self.protocol {
            Protocol::First => return false,
            Protocol::Second => sdk2::told_step(payload),
        };
        let rate = |step: Step| step.ns as f64 / step.shots as f64;
        told.is_some_and(|told| (rate(told) / rate(self.step) - 1.0).abs() < STEP_TOLERANCE)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        self.read(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let why = match self.read(payload) {
            Some(packet) => format!(
                "{} shots {} ns apart are not those of {}",
                packet.count(),
                packet.step.until(1),
                self.title
            ),
            None => format!("{} bytes are not those of {}", payload.len(), self.title),
        };
        Misfit {
            why,
            may_be: Some(self.id),
        }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let packet = self.read(payload)?;
        let duration_ns = packet.duration_ns();
        Some(Head {
            device_ns: packet.device_ns,
            sequence: packet.sequence,
            azimuth_rad: phase_rad(packet.device_ns),
            turned_rad: duration_ns as f64 * RAD_PER_NS,
            rate_rad_per_ns: RAD_PER_NS,
            duration_ns,
            left_out: None,
            return_mode: packet.return_mode(),
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let Some(packet) = self.read(payload) else {
            return tally;
        };
        let echoes = packet.form.echoes.min(echoes::MOST);
        let order = |shot, echo| packet.form.order(&packet.form.read(shot, echo));
        for shot in packet.shots() {
            let mut orders = [0; echoes::MOST];
            for (echo, place) in orders.iter_mut().enumerate().take(echoes) {
                *place = order(shot, echo);
            }
            let (kinds, merged) = meanings(packet.return_mode(), &orders[..echoes]);
            tally.points += kinds.iter().flatten().count() as u32;
            tally.merged += merged;
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        let shots = match (self.protocol, mode.returns()) {
            (Protocol::Second, _) => sdk2::POINTS,
            (Protocol::First, 1) => self.shots_of_single(),
            (Protocol::First, 2) => 48,
            (Protocol::First, _) => 30,
        };
        self.step.until(shots)
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: (self.protocol == Protocol::Second).then_some(16),
        }
    }

    /// The protocol has the number start again with every frame; a Mid-360 counts on through 16 bits.
    fn restarts(&self) -> Option<Restarts> {
        (self.protocol == Protocol::Second).then_some(Restarts::Perhaps)
    }

    fn has_rotor(&self) -> bool {
        false
    }

    /// A Mid-360 leaves the number at 0 in all its packets, and the first protocol has none.
    fn frame_id(&self, payload: &[u8]) -> Option<u32> {
        if !self.counts_frames || !self.fits(payload) {
            return None;
        }
        sdk2::frame(payload).map(u32::from)
    }

    fn takes(&self, file: &UnitFile) -> bool {
        account::takes(file)
    }

    fn describe(&self, files: &[UnitFile]) -> UnitFacts {
        account::describe(files)
    }

    fn gather(&self) -> Option<Box<dyn Gather>> {
        Some(Box::new(Account::new(*self)))
    }

    fn fit(&self, _files: &[UnitFile]) -> Result<Fitted, UnitError> {
        Ok(Fitted {
            decoder: Box::new(LivoxDecoder::new(*self)),
            calibration: Calibration::Factory,
        })
    }
}

impl Livox {
    fn shots_of_single(&self) -> usize {
        let kind = self.types.first().copied().unwrap_or_default();
        sdk1::form(kind).map_or(1, |(shots, _)| shots)
    }
}
