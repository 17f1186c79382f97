//! Decoding and encoding of all models that spin: blocks of channels, each at one azimuth.
//!
//! The packet's time is that of the first laser of its first block. A point's azimuth is the block's, plus
//! what the rotor turns until the laser fires, plus the laser's own.

mod decoder;
mod turn;

use std::fmt::Debug;

use super::difop::{self, Angles, Difop};
use super::layout::{Layout, RawPacket, View, encode};
use crate::error::UnitError;
use crate::packet::echoes::RawEcho;
use crate::packet::split::{Half, Split};
use crate::packet::unit::{Calibration, Fitted, UnitFacts, UnitFile};
use crate::packet::{Counting, Head, Misfit, Model, PacketKind, ReturnMode, Tally};
use decoder::RotatingDecoder;
use turn::Turn;

/// How to get the angles of a unit.
pub const OBTAIN: &str = "record the packets that describe the unit as well (DIFOP, port 7788, about one a second), or give a \
    capture that has one: --beams ADDRESS=FILE";

/// Accelerations and turn rates of Airy and Fairy.
const INERTIAL_LEN: usize = 51;
const INERTIAL_ID: [u8; 4] = [0xAA, 0x55, 0x5A, 0x05];

/// Ranges are whole units, limits are not exact in binary.
const GUARD_M: f64 = 1e-6;

/// What a channel of a block is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Slot {
    /// Number of the laser.
    pub laser: usize,
    /// Which shot of the laser within the firing.
    pub shot: usize,
    /// Which return of the shot.
    pub echo: usize,
    /// Delay after the first shot of the firing.
    pub delay_ns: i64,
}

/// Where the lasers leave: distance from the axis and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// From the axis, metres.
    pub out_m: f64,
    /// Above the origin, metres.
    pub up_m: f64,
}

/// What the models differ in.
pub trait Family: Send + Sync + Debug + Copy + 'static {
    /// Product name in lower case without the vendor.
    fn id(&self) -> &'static str;

    /// Name with vendor, for people.
    fn title(&self) -> &'static str;

    /// Ids of models whose packets cannot be told from this one's.
    fn candidates(&self) -> &'static [&'static str] {
        &[]
    }

    /// Layout of its packets.
    fn layout(&self) -> Layout;

    /// Whether a packet of this layout says that it is of this model.
    fn is_own(&self, payload: &[u8]) -> bool;

    /// Whether all packets of a stream, taken together, may be of this model.
    fn suits(&self, _packets: &[&[u8]]) -> bool {
        true
    }

    /// What the packets of a stream leave open although this model is taken.
    fn doubt(&self, _packets: &[&[u8]]) -> Option<String> {
        None
    }

    /// Bytes by which the header names the model, by place.
    fn header(&self) -> Vec<(usize, u8)> {
        Vec::new()
    }

    /// Number of lasers.
    fn lasers(&self) -> usize;

    /// Returns of a shot in this packet.
    fn returns(&self, view: &View<'_>) -> usize;

    /// Blocks of one firing.
    fn blocks_of_firing(&self, returns: usize) -> usize;

    /// Time from one firing to the next.
    fn firing_ns(&self, returns: usize) -> f64;

    /// What a channel is, in the block at this place of its firing.
    fn slot(&self, returns: usize, place: usize, channel: usize) -> Slot;

    /// Whether what the rotor turns until a shot counts in whole hundredths of a degree.
    fn is_on_grid(&self) -> bool {
        false
    }

    /// Metres of one unit of range.
    fn unit_m(&self, view: &View<'_>) -> f64;

    /// Where the lasers leave.
    fn lens(&self) -> Lens;

    /// Ranges up to the first and beyond the second are none, metres: the maker's limits; up to the first
    /// sensors write it for echoes of their own cover.
    fn limits_m(&self) -> (f64, f64);

    /// Angles of a unit that is not known, where single units are near them.
    fn nominal(&self) -> Option<Angles>;

    /// Angles that a unit tells.
    fn told(&self, difop: &Difop<'_>) -> Option<Angles>;

    /// Meaning of the return mode byte.
    fn mode(&self, byte: u8) -> Option<ReturnMode>;

    /// Width of the packet counter, where there is one.
    fn counter_bits(&self) -> Option<u32> {
        self.layout().counter.map(|_| 32)
    }
}

/// A model that spins.
#[derive(Debug)]
pub struct Rotating<F>(pub F);

impl<F: Family> Rotating<F> {
    fn view<'a>(&self, payload: &'a [u8]) -> Option<View<'a>> {
        View::new(payload, self.0.layout())
    }

    /// Writes a data packet.
    pub fn encode(&self, packet: &RawPacket) -> Vec<u8> {
        encode(&self.0.layout(), packet)
    }

    fn return_mode(&self, view: &View<'_>) -> ReturnMode {
        match self.0.returns(view) {
            1 => ReturnMode::Strongest,
            _ => ReturnMode::Dual,
        }
    }
}

/// Echoes beyond the limits of a model are none.
fn cut<F: Family>(family: &F, view: &View<'_>, mut echo: RawEcho) -> RawEcho {
    let (least_m, most_m) = family.limits_m();
    let range_m = f64::from(echo.range) * family.unit_m(view);
    let is_within = range_m > least_m + GUARD_M && range_m <= most_m + GUARD_M;
    if !is_within {
        echo.range = 0;
    }
    echo
}

/// Ranges of the two echoes of all shots of a packet, by firing, shot and laser.
fn ranges<F: Family>(family: &F, view: &View<'_>) -> Vec<[u16; 2]> {
    let turn = Turn::of(family, view, 0.0);
    let (returns, shots) = (family.returns(view), 2 * family.lasers());
    let mut ranges = vec![[0; 2]; turn.firings() * shots];
    for (firing, ranges) in ranges.chunks_exact_mut(shots.max(1)).enumerate() {
        for (block, place) in turn.blocks_of(firing) {
            for channel in 0..view.layout().channels {
                let slot = family.slot(returns, place, channel);
                let shot = ranges.get_mut(slot.shot * family.lasers() + slot.laser);
                if let Some(range) = shot.and_then(|shot| shot.get_mut(slot.echo)) {
                    *range = cut(family, view, view.echo(block, channel)).range;
                }
            }
        }
    }
    ranges
}

impl<F: Family> Model for Rotating<F> {
    fn id(&self) -> &'static str {
        self.0.id()
    }

    fn title(&self) -> &'static str {
        self.0.title()
    }

    fn candidates(&self) -> &'static [&'static str] {
        self.0.candidates()
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        if Difop::new(payload).is_some() {
            return Some(PacketKind::Metadata);
        }
        if payload.len() == INERTIAL_LEN && payload.starts_with(&INERTIAL_ID) {
            return Some(PacketKind::Inertial);
        }
        let is_own = self.view(payload).is_some() && self.0.is_own(payload);
        is_own.then_some(PacketKind::Data)
    }

    fn suits(&self, packets: &[&[u8]]) -> bool {
        self.0.suits(packets)
    }

    fn doubt(&self, packets: &[&[u8]]) -> Option<String> {
        self.0.doubt(packets)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        self.view(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let [old, kind, model] = super::layout::kind(payload);
        let why = format!(
            "type bytes {old:#04x} {kind:#04x} {model:#04x} are not those of {}",
            self.title()
        );
        Misfit {
            why,
            may_be: Some(self.id()),
        }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let view = self.view(payload)?;
        let turn = Turn::of(&self.0, &view, 0.0);
        Some(Head {
            device_ns: view.time_ns(),
            sequence: view.counter(),
            azimuth_rad: turn.azimuth_rad(0),
            turned_rad: turn.turned_rad(),
            rate_rad_per_ns: turn.rate_rad_per_ns(),
            duration_ns: turn.duration_ns(),
            left_out: turn.left_out(),
            return_mode: self.return_mode(&view),
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let Some(view) = self.view(payload) else {
            return tally;
        };
        for [one, other] in ranges(&self.0, &view) {
            tally.add_pair(one, other);
        }
        tally
    }

    fn is_splitting(&self) -> bool {
        !self
            .0
            .layout()
            .blocks
            .is_multiple_of(self.0.blocks_of_firing(2).max(1))
    }

    fn split(&self, payload: &[u8]) -> Split {
        let Some(view) = self.view(payload).filter(|_| self.is_splitting()) else {
            return Split::default();
        };
        let turn = Turn::of(&self.0, &view, 0.0);
        let half = |block: usize| Half {
            azimuth: view.azimuth(block),
            ranges: (0..view.layout().channels)
                .map(|channel| cut(&self.0, &view, view.echo(block, channel)).range)
                .collect(),
        };
        Split {
            lead: turn.has_lead().then(|| half(0)),
            tail: turn.has_tail().then(|| half(view.blocks() - 1)),
        }
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        let returns = mode.returns().min(2);
        let firings = self.0.layout().blocks as f64 / self.0.blocks_of_firing(returns) as f64;
        (firings * self.0.firing_ns(returns)).round() as i64
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: self.0.counter_bits(),
        }
    }

    fn takes(&self, file: &UnitFile) -> bool {
        difop::packet(file).is_some()
    }

    fn describe(&self, files: &[UnitFile]) -> UnitFacts {
        let Some(bytes) = files.iter().find_map(difop::packet) else {
            return UnitFacts {
                return_mode: None,
                notes: vec![
                    "no packet describes the unit: which return a single one is cannot be told"
                        .into(),
                ],
            };
        };
        let Some(difop) = Difop::new(&bytes) else {
            return UnitFacts::default();
        };
        let (serial, rpm, clock) = (difop.serial(), difop.rpm(), difop.clock());
        let blank = self.0.told(&difop).is_none();
        let mut notes = vec![format!(
            "serial number {serial}, set to {rpm} rpm, clock source: {clock}"
        )];
        notes.extend(blank.then(|| "the unit describes itself without angles".into()));
        let (told, own) = (difop.lasers(), self.0.lasers());
        let is_more = own < 32 && told > own;
        notes.extend(is_more.then(|| {
            format!("the unit describes {told} lasers, of which the first {own} are taken")
        }));
        UnitFacts {
            return_mode: self.0.mode(difop.return_mode()).map(ReturnMode::name),
            notes,
        }
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        let packets = files
            .iter()
            .filter_map(|file| Some((file, difop::packet(file)?)));
        let told = packets.filter_map(|(file, bytes)| {
            let difop = Difop::new(&bytes)?;
            let settings = Settings {
                mode: self.0.mode(difop.return_mode()),
                rpm: Some(difop.rpm()),
            };
            Some((file, self.0.told(&difop)?, settings))
        });
        let (angles, settings, calibration) = match told.into_iter().next() {
            Some((file, angles, settings)) => (
                angles,
                settings,
                Calibration::of(&[file], Calibration::Factory),
            ),
            None => {
                let angles = self.0.nominal().ok_or(UnitError::Missing {
                    model: self.0.title(),
                    obtain: OBTAIN,
                })?;
                (
                    angles,
                    Settings::default(),
                    Calibration::Nominal { obtain: OBTAIN },
                )
            }
        };
        Ok(Fitted {
            decoder: Box::new(RotatingDecoder::new(self.0, &angles, settings)),
            calibration,
        })
    }
}

/// What a unit is set to, where it says so.
#[derive(Debug, Clone, Copy, Default)]
struct Settings {
    mode: Option<ReturnMode>,
    rpm: Option<u16>,
}
