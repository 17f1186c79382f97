//! From datagrams to returns in the sensor frame: what every sensor model provides, and how a
//! model is recognised from the content of its packets.
//!
//! A new sensor is one value that implements [`Model`] and one line in [`MODELS`]; nothing else in
//! the library names a model.

pub mod aim;
pub mod beams;
pub mod echoes;
pub mod fan;
pub mod frames;
pub mod hesai;
pub mod leishen;
pub mod livox;
mod models;
pub mod ouster;
pub mod part;
pub mod points;
pub mod proof;
pub mod rays;
pub mod robosense;
pub mod sheet;
pub mod split;
mod strangers;
pub mod unit;
pub mod velodyne;
pub mod writer;

use crate::angle::{Arc, wrap_turn};
use crate::cloud::PointCloud;
use crate::drops::Drops;
use crate::error::UnitError;
use crate::frame::Sensor;
use crate::loss::cycle::Restarts;
use crate::time::{NANOS_PER_HOUR, Timestamp};
pub use models::{MODELS, claimants, closest, companion, model, unit_models};
pub use robosense::solid::joined::pieces;
use split::{Following, Split};
use unit::{Fitted, Gather, UnitFacts, UnitFile};

/// A registered sensor model.
pub type ModelRef = &'static dyn Model;

/// What the library must know of one sensor model.
pub trait Model: Sync + std::fmt::Debug {
    /// Product name in lower case without the vendor, such as `vlp16`.
    fn id(&self) -> &'static str;

    /// Name with vendor, for people.
    fn title(&self) -> &'static str;

    /// Ids of models whose packets cannot be told from this one's.
    fn candidates(&self) -> &'static [&'static str] {
        &[]
    }

    /// What `payload` is to this model, judged by the bytes that identify it; `None` when it is not its own.
    fn recognise(&self, payload: &[u8]) -> Option<PacketKind>;

    /// Whether the identifying bytes are this model's alone, so that the packet period need not
    /// confirm what [`Model::recognise`] says.
    fn is_sure(&self, _payload: &[u8]) -> bool {
        true
    }

    /// Whether all data packets of a stream, taken together, may be of this model.
    fn suits(&self, _packets: &[&[u8]]) -> bool {
        true
    }

    /// What all data packets of a stream, taken together, leave open although this model is taken.
    fn doubt(&self, _packets: &[&[u8]]) -> Option<String> {
        None
    }

    /// What a data packet tells beside its points that a user should know.
    fn remarks(&self, _payload: &[u8]) -> Vec<String> {
        Vec::new()
    }

    /// The model with the timing that all data packets of a stream, taken together, show; `None` where it
    /// is this one's.
    fn as_sent(&self, _packets: &[&[u8]]) -> Option<ModelRef> {
        None
    }

    /// Whether `payload` has the layout of a data packet, whatever its identifying bytes say: for
    /// models that the user names, and to tell how close a foreign packet comes.
    fn fits(&self, payload: &[u8]) -> bool;

    /// Why `payload`, which fits by its size, was not recognised.
    fn misfit(&self, payload: &[u8]) -> Misfit;

    /// Times and angles of a data packet without its returns; `None` where the layout is broken.
    fn head(&self, payload: &[u8]) -> Option<Head>;

    /// Numbers of points and of merged returns in a data packet, without placing them.
    fn tally(&self, payload: &[u8]) -> Tally;

    /// Whether firings may have their returns in two packets.
    fn is_splitting(&self) -> bool {
        false
    }

    /// What of a data packet belongs to firings that the packets around it share.
    fn split(&self, _payload: &[u8]) -> Split {
        Split::default()
    }

    /// Time from the first shot of one packet to that of the next, as the maker states it.
    fn period_ns(&self, mode: ReturnMode) -> i64;

    /// How the sensor numbers and stamps its packets.
    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: Some(NANOS_PER_HOUR),
            sequence_bits: None,
        }
    }

    /// The sequence number starts again after so many.
    fn sequence_wrap(&self) -> Option<i64> {
        let bits = self.counting().sequence_bits;
        bits.map(|bits| 1_i64 << bits.min(62))
    }

    /// How the sequence number starts again with every frame, where it does.
    fn restarts(&self) -> Option<Restarts> {
        None
    }

    /// Whether a rotor turns the beams. Others send frame after frame: one frame counts as one turn.
    fn has_rotor(&self) -> bool {
        true
    }

    /// Number of the frame that a data packet belongs to, where the sensor counts them.
    fn frame_id(&self, _payload: &[u8]) -> Option<u32> {
        None
    }

    /// Models of the single units that `files` describe, where packets mean nothing without: those that are
    /// sure of their packets, then those that take any of the size.
    fn units(&self, _files: &[UnitFile]) -> Vec<ModelRef> {
        Vec::new()
    }

    /// Whether a user who names this model may mean that unit.
    fn covers(&self, _unit: ModelRef) -> bool {
        false
    }

    /// What `files` tell of the unit beside its angles.
    fn describe(&self, _files: &[UnitFile]) -> UnitFacts {
        UnitFacts::default()
    }

    /// Whether `file` describes a unit of this model, judged by its content.
    fn takes(&self, _file: &UnitFile) -> bool {
        false
    }

    /// Gathers a unit's description from its data packets, where they carry one.
    fn gather(&self) -> Option<Box<dyn Gather>> {
        None
    }

    /// Turns data packets into returns, with what `files` say of the unit; a file that is not taken does
    /// not matter.
    ///
    /// # Errors
    /// [`UnitError`] for a file that is taken and broken, or where the model needs one and there is none.
    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError>;
}

/// What a datagram of a sensor is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PacketKind {
    /// Carries returns.
    Data,
    /// Tells position and time of a GNSS receiver, and whether the clock is locked to it.
    Position,
    /// Describes the unit: angles, calibration, settings.
    Metadata,
    /// Accelerations and turn rates.
    Inertial,
    /// Tells the state of the sensor or of what it watches.
    Status,
}

impl PacketKind {
    /// For reports.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Position => "position packets",
            Self::Metadata => "packets that describe the unit",
            Self::Inertial => "packets of accelerations and turn rates",
            Self::Status => "packets of the sensor's state",
        }
    }
}

/// How a sensor numbers and stamps its packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counting {
    /// The device clock starts again after so many nanoseconds; `None`: never.
    pub clock_wrap_ns: Option<i64>,
    /// Width of the sequence number; `None`: there is none.
    pub sequence_bits: Option<u32>,
}

/// Which returns of a shot the sensor was set to report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReturnMode {
    /// The strongest one.
    Strongest,
    /// The last one.
    Last,
    /// The first one.
    First,
    /// The second one.
    Second,
    /// Last and strongest, or last and second strongest where they are the same.
    Dual,
    /// First and second.
    FirstSecond,
    /// First and last.
    FirstLast,
    /// First and strongest.
    FirstStrongest,
    /// Strongest and second strongest.
    StrongestSecond,
    /// First, strongest and last.
    Triple,
}

impl ReturnMode {
    /// Word for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strongest => "strongest",
            Self::Last => "last",
            Self::First => "first",
            Self::Second => "second",
            Self::Dual => "dual",
            Self::FirstSecond => "dual (first, second)",
            Self::FirstLast => "dual (first, last)",
            Self::FirstStrongest => "dual (first, strongest)",
            Self::StrongestSecond => "dual (strongest, second)",
            Self::Triple => "triple",
        }
    }

    /// Echoes that a packet has room for in each shot.
    #[inline]
    pub fn returns(self) -> usize {
        match self {
            Self::Strongest | Self::Last | Self::First | Self::Second => 1,
            Self::Triple => 3,
            _ => 2,
        }
    }
}

/// Times and angles of one data packet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Head {
    /// Device time of the first shot, nanoseconds; starts again as [`Counting`] says.
    pub device_ns: i64,
    /// Sequence number, where the sensor has one.
    pub sequence: Option<u32>,
    /// Encoder azimuth of the first shot, [0, 2 pi).
    pub azimuth_rad: f64,
    /// Angle turned from the first shot of this packet to where the next one starts when nothing is lost.
    pub turned_rad: f64,
    /// Rotation rate in the sensor's own sense; 0 where it stands or has no rotor.
    pub rate_rad_per_ns: f64,
    /// Time from the first shot of this packet to the start of the next when nothing is lost.
    pub duration_ns: i64,
    /// Part of the turn within the packet that the sensor left out: its limited field of view.
    pub left_out: Option<LeftOut>,
    /// Which returns it carries.
    pub return_mode: ReturnMode,
}

/// A gap of a limited field of view inside of a packet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Angle turned from the packet's first shot to the gap.
    pub after_rad: f64,
    /// Width of the gap.
    pub width_rad: f64,
    /// No time passes in it: a mirror starts anew.
    pub is_instant: bool,
}

impl Head {
    /// The same with the time over a gap from the rotation rate over many packets, which is known
    /// better than the rate within one.
    pub fn paced(mut self, mean_rate_rad_per_ns: f64) -> Self {
        if let Some(gap) = self.left_out.filter(|gap| !gap.is_instant)
            && self.rate_rad_per_ns > 0.0
            && mean_rate_rad_per_ns > 0.0
        {
            let longer = 1.0 / mean_rate_rad_per_ns - 1.0 / self.rate_rad_per_ns;
            let longer_ns = (gap.width_rad * longer) as i64;
            self.duration_ns = self.duration_ns.saturating_add(longer_ns);
        }
        self
    }

    /// Angle that was seen between two angles turned since the first shot.
    pub fn seen_rad(&self, from_rad: f64, to_rad: f64) -> f64 {
        let left_out = self.left_out.map_or(0.0, |gap| {
            let end_rad = gap.after_rad + gap.width_rad;
            (to_rad.min(end_rad) - from_rad.max(gap.after_rad)).max(0.0)
        });
        (to_rad - from_rad - left_out).max(0.0)
    }

    /// Arcs that were seen: one, or one on each side of the part that was left out.
    pub fn arcs(&self) -> impl Iterator<Item = Arc> {
        let arc = |after_rad: f64, until_rad: f64| Arc {
            from_rad: wrap_turn(self.azimuth_rad + after_rad),
            width_rad: until_rad - after_rad,
        };
        let arcs = match self.left_out {
            None => [Some(arc(0.0, self.turned_rad)), None],
            Some(gap) => {
                let behind_rad = gap.after_rad + gap.width_rad;
                [
                    Some(arc(0.0, gap.after_rad)),
                    Some(arc(behind_rad, self.turned_rad)),
                ]
            }
        };
        arcs.into_iter().flatten()
    }

    /// When the rotor had turned by `turned_rad` since the first shot at `start`.
    pub fn time_at(&self, start: Timestamp, turned_rad: f64) -> Timestamp {
        if self.rate_rad_per_ns > 0.0 {
            start + (turned_rad / self.rate_rad_per_ns).round() as i64
        } else {
            start
        }
    }

    /// Where the next packet starts when nothing is lost, [0, 2 pi).
    pub fn next_azimuth_rad(&self) -> f64 {
        wrap_turn(self.azimuth_rad + self.turned_rad)
    }
}

/// Echoes in one packet.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Points that decoding gives.
    pub points: u32,
    /// Second returns that repeat the first and were merged into it.
    pub merged: u32,
}

impl Tally {
    /// Counts the two ranges of one shot.
    pub fn add_pair(&mut self, one: u16, other: u16) {
        let is_merged = one == other && one != 0;
        self.points += u32::from(one != 0) + u32::from(other != 0) - u32::from(is_merged);
        self.merged += u32::from(is_merged);
    }
}

/// What speaks against a packet that nobody claims.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misfit {
    /// For people.
    pub why: String,
    /// The model that it may still be of, if the user says so.
    pub may_be: Option<&'static str>,
}

/// Where a packet stands in its stream and in time.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// UTC of its first shot.
    pub time: Timestamp,
    /// Number among the data packets of its stream, 0-based.
    pub packet: u32,
    /// Rotation rate over the packets before; 0 where it is not known.
    pub mean_rate_rad_per_ns: f64,
}

/// Returns of one packet, in the order of the shots. The buffer is meant to be used again and again.
#[derive(Debug, Default)]
pub struct Decoded {
    /// The returns.
    pub cloud: PointCloud<Sensor>,
    /// Encoder azimuth of each return's shot, before the channel's own offset: what sweeps are cut by.
    pub encoder_rad: Vec<f32>,
    /// Second returns that repeat the first and were merged into it.
    pub merged: u64,
    /// Blocks that were left out, by reason.
    pub drops: Drops,
    /// Nobody looks at more of the cloud than places, instants, azimuths and beams: a decoder may leave the other
    /// columns empty.
    pub is_slim: bool,
}

impl Decoded {
    /// None yet; all columns, or those that [`Decoded::is_slim`] names.
    pub fn with_columns(is_slim: bool) -> Self {
        Self {
            is_slim,
            ..Self::default()
        }
    }

    /// Number of the first return, from number `from` on, that was shot after the rotor had turned by
    /// `turned_rad` since the first shot of the packet with this head.
    pub fn before(&self, from: usize, head: &Head, turned_rad: f64) -> usize {
        let is_behind = |encoder_rad: &f32| {
            let since_rad = f64::from(*encoder_rad) - head.azimuth_rad + BACKLASH_RAD;
            wrap_turn(since_rad) - BACKLASH_RAD >= turned_rad
        };
        let behind = self.encoder_rad[from..].iter().position(is_behind);
        behind.map_or(self.encoder_rad.len(), |place| from + place)
    }

    /// Empties the columns and keeps their memory; the counts go on.
    pub fn clear(&mut self) {
        self.cloud.clear();
        self.encoder_rad.clear();
    }
}

/// The encoder may seem to step back by so much.
const BACKLASH_RAD: f64 = 0.02;

/// Decodes the data packets of one stream; may carry state from packet to packet.
pub trait Decoder: Send + Sync {
    /// Appends the returns of `payload` to `out`; a payload of another size gives none and is counted.
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded);

    /// The same with the packet that follows, of which returns are taken whose firing began in `payload`: for
    /// models with [`Model::is_splitting`].
    fn decode_before(
        &mut self,
        payload: &[u8],
        _following: Option<Following<'_>>,
        place: Place,
        out: &mut Decoded,
    ) {
        self.decode(payload, place, out);
    }

    /// Whether what it makes of a packet depends on the packets before.
    fn is_following(&self) -> bool {
        false
    }

    /// Whether a return of `payload` may lie in a direction within `bearings`, counted from x towards y,
    /// half a metre or farther from the z axis. A decoder that cannot tell says that it may.
    fn may_meet(&self, _payload: &[u8], _bearings: Arc) -> bool {
        true
    }
}
