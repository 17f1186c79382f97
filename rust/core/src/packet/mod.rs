//! From datagrams to returns in the sensor frame: what every sensor model provides, and how a
//! model is recognised from the content of its packets.
//!
//! A new sensor is one value that implements [`Model`] and one line in [`MODELS`]; nothing else in
//! the library names a model.

pub mod aim;
pub mod beams;
pub mod echoes;
pub mod frames;
pub mod hesai;
pub mod leishen;
pub mod livox;
pub mod ouster;
pub mod points;
pub mod proof;
pub mod robosense;
pub mod unit;
pub mod velodyne;
pub mod writer;

use crate::angle::{Arc, wrap_turn};
use crate::cloud::PointCloud;
use crate::drops::Drops;
use crate::error::{InvalidValue, UnitError};
use crate::frame::Sensor;
use crate::loss::cycle::Restarts;
use crate::time::{NANOS_PER_HOUR, Timestamp};
use unit::{Fitted, Gather, UnitFacts, UnitFile};

/// A registered sensor model.
pub type ModelRef = &'static dyn Model;

/// All sensor models, the likelier one first where content and timing fit several.
pub static MODELS: &[ModelRef] = &[
    &velodyne::puck::VLP16,
    &velodyne::puck::VLP16_HIRES,
    &velodyne::puck::PUCK_LITE,
    &velodyne::hdl32e::HDL32E,
    &velodyne::vlp32::VLP32C,
    &velodyne::vlp32::VLP32A,
    &velodyne::vls128::VLS128,
    &velodyne::hdl64e::HDL64E_S3,
    &velodyne::hdl64e::HDL64E_S2,
    &hesai::pandar::PANDAR40P,
    &hesai::pandar::PANDAR40AC,
    &hesai::pandar::PANDAR64,
    &hesai::xt::XT16,
    &hesai::xt::XT32,
    &hesai::xt::XT32M2X,
    &hesai::xt::QT64,
    &hesai::qt128::QT128,
    &hesai::pandar128::PANDAR128,
    &hesai::pandar128::PANDAR90,
    &hesai::pandar128::OT128,
    &hesai::pandar128::JT128,
    &hesai::at128::AT128,
    &hesai::atx::ATX,
    &hesai::ft120::FT120,
    &hesai::jt16::JT16,
    &ouster::bare::OUSTER,
    &ouster::bare::OS0,
    &ouster::bare::OS1,
    &ouster::bare::OS2,
    &ouster::bare::OSDOME,
    &ouster::bare::PRODUCTS[0],
    &ouster::bare::PRODUCTS[1],
    &ouster::bare::PRODUCTS[2],
    &ouster::bare::PRODUCTS[3],
    &ouster::bare::PRODUCTS[4],
    &ouster::bare::PRODUCTS[5],
    &ouster::bare::PRODUCTS[6],
    &ouster::bare::PRODUCTS[7],
    &ouster::bare::PRODUCTS[8],
    &ouster::bare::PRODUCTS[9],
    &ouster::bare::PRODUCTS[10],
    &ouster::bare::PRODUCTS[11],
    &ouster::bare::PRODUCTS[12],
    &robosense::helios::HELIOS_16P,
    &robosense::helios::HELIOS_32,
    &robosense::helios::HELIOS_32_31DEG,
    &robosense::helios::HELIOS_32_26DEG,
    &robosense::rs::RS_16,
    &robosense::rs::RS_32,
    &robosense::bpearl::BPEARL,
    &robosense::bpearl::BPEARL_4,
    &robosense::ruby::RUBY_128,
    &robosense::ruby::RUBY_80,
    &robosense::ruby::RUBY_48,
    &robosense::ruby::PLUS_128,
    &robosense::ruby::PLUS_80,
    &robosense::ruby::PLUS_48,
    &robosense::airy::AIRY,
    &robosense::airy::FAIRY,
    &leishen::products::MODELS[0],
    &leishen::products::MODELS[1],
    &leishen::products::MODELS[2],
    &leishen::products::MODELS[3],
    &leishen::products::MODELS[4],
    &leishen::products::MODELS[5],
    &leishen::products::MODELS[6],
    &leishen::products::MODELS[7],
    &leishen::products::MODELS[8],
    &leishen::products::MODELS[9],
    &leishen::products::MODELS[10],
    &leishen::products::MODELS[11],
    &leishen::products::MODELS[12],
    &leishen::products::MODELS[13],
    &leishen::products::MODELS[14],
    &leishen::products::MODELS[15],
    &leishen::products::MODELS[16],
    &leishen::products::MODELS[17],
    &leishen::products::MODELS[18],
    &leishen::products::MODELS[19],
    &leishen::mirror::MODELS[0],
    &leishen::mirror::MODELS[1],
    &leishen::mirror::MODELS[2],
    &leishen::mirror::MODELS[3],
    &leishen::mirror::MODELS[4],
    &leishen::mirror::MODELS[5],
    &leishen::mirror::MODELS[6],
    &leishen::mirror::MODELS[7],
    &robosense::solid::sensor::M1,
    &robosense::solid::sensor::M1_PLUS,
    &robosense::solid::sensor::M2,
    &robosense::solid::sensor::M3,
    &robosense::solid::sensor::MX,
    &robosense::solid::sensor::E1,
    &robosense::solid::sensor::EMX,
    &robosense::solid::sensor::EM4,
    &livox::sensor::MID_40,
    &livox::sensor::MID_70,
    &livox::sensor::AVIA,
    &livox::sensor::HORIZON,
    &livox::sensor::TELE_15,
    &livox::sensor::MID_360,
    &livox::sensor::HAP,
    &points::POINTS,
];

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
}

impl Decoded {
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
}

/// Other names of models, in the spelling of [`squeezed`].
const ALIASES: &[(&str, &str)] = &[
    ("pandar128e3x", "pandar128"),
    ("pandar90e3x", "pandar90"),
    ("pandar40m", "pandar40p"),
    ("pandarqt64", "qt64"),
    ("pandarqt", "qt64"),
    ("pandarqt128", "qt128"),
    ("pandarxt16", "xt16"),
    ("pandarxt32", "xt32"),
    ("xt32m", "xt32m2x"),
    ("pandarat128", "at128"),
    ("hdl64es3", "hdl64e"),
    ("hdl64", "hdl64e"),
    ("hdl32", "hdl32e"),
    ("vlp16lite", "puck-lite"),
    ("puckhires", "vlp16-hires"),
    ("alphaprime", "vls128"),
    ("helios5515", "helios32"),
    ("helios1615", "helios32-31deg"),
    ("rslidar16", "rs16"),
    ("rslidar32", "rs32"),
    ("rsbpearl", "bpearl"),
    ("rshelios16p", "helios16p"),
    ("rshelios", "helios32"),
    ("rubylite", "ruby-80"),
];

/// A name without the dashes, spaces and capitals in which spellings differ.
fn squeezed(name: &str) -> String {
    let kept = name.chars().filter(char::is_ascii_alphanumeric);
    kept.map(|c| c.to_ascii_lowercase()).collect()
}

/// The model with this id; dashes and capitals do not matter, and older names are taken as well.
///
/// # Errors
/// [`InvalidValue`] that lists the known ids.
pub fn model(id: &str) -> Result<ModelRef, InvalidValue> {
    let name = squeezed(id);
    let alias = ALIASES.iter().find(|(other, _)| *other == name);
    let name = alias.map_or(name, |(_, id)| squeezed(id));
    let known = MODELS.iter().find(|model| squeezed(model.id()) == name);
    known.copied().ok_or_else(|| InvalidValue {
        name: "sensor model",
        expected: MODELS.iter().map(|m| m.id()).collect::<Vec<_>>().join(", "),
        found: id.into(),
    })
}

/// Models that claim `payload` as their data packet, the likelier one first.
pub fn claimants(payload: &[u8]) -> impl Iterator<Item = ModelRef> + '_ {
    let claims = |model: &ModelRef| model.recognise(payload) == Some(PacketKind::Data);
    MODELS.iter().copied().filter(claims)
}

/// Models of the single units that `files` describe.
pub fn unit_models(files: &[UnitFile]) -> Vec<ModelRef> {
    MODELS.iter().flat_map(|model| model.units(files)).collect()
}

/// What `payload` is beside data, if any model knows.
pub fn companion(payload: &[u8]) -> Option<PacketKind> {
    let mut kinds = MODELS.iter().filter_map(|model| model.recognise(payload));
    kinds.find(|kind| *kind != PacketKind::Data)
}

/// How close a packet that nobody claims comes to a known model.
pub fn closest(payload: &[u8]) -> Option<Misfit> {
    let model = MODELS.iter().find(|model| model.fits(payload))?;
    Some(model.misfit(payload))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_candidates_exist() {
        for (place, one) in MODELS.iter().enumerate() {
            assert!(MODELS[..place].iter().all(|other| other.id() != one.id()));
            assert!(one.candidates().iter().all(|id| model(id).is_ok()));
        }
        assert!(model("vlp61").unwrap_err().expected.contains("vlp16"));
    }

    #[test]
    fn spellings_and_older_names_are_taken_and_never_clash() {
        for (place, one) in MODELS.iter().enumerate() {
            let is_same = |other: &&ModelRef| squeezed(other.id()) == squeezed(one.id());
            assert_eq!(MODELS[..place].iter().find(is_same).map(|m| m.id()), None);
            assert_eq!(model(&one.id().to_uppercase()).unwrap().id(), one.id());
        }
        for (alias, id) in ALIASES {
            assert!(MODELS.iter().all(|model| squeezed(model.id()) != *alias));
            assert_eq!(model(alias).unwrap().id(), *id);
        }
        assert_eq!(model("helios-16p").unwrap().id(), "helios16p");
        assert_eq!(model("RS-16").unwrap().id(), "rs16");
    }
}
