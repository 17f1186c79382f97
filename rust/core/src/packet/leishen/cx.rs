//! The C series: twelve blocks of 32 channels, little endian, as a Velodyne's; a tail that tells time and
//! product in 6 bytes (version 3) or in 12 (from version 4 on).
//!
//! A packet's time is that of its last shot, as the driver has it. Within a block the shots follow each
//! other at equal steps of azimuth and time; with fewer lasers than channels they fire again.
//!
//! Source: the maker's driver; one real packet of a C16 of version 4.

use super::difop::{self, Difop};
use super::pace;
use super::paced::Units;
use super::products::{PRODUCTS, Product};
use crate::error::UnitError;
use crate::packet::hesai::date;
use crate::packet::unit::{Calibration, Fitted, UnitFacts, UnitFile};
use crate::packet::velodyne::rotation::Rotation;
use crate::packet::velodyne::{self, BLOCKS, CHANNELS, Packet, RawBlock, TURN_CENTIDEG};
use crate::packet::{Counting, Head, Misfit, Model, ModelRef, PacketKind, ReturnMode, Tally};
use crate::time::{NANOS_PER_SECOND, Timestamp};

mod decoder;
use decoder::{CxDecoder, Lasers};

/// How to get the angles of a unit.
pub const OBTAIN: &str = "record the packets that describe the unit as well (DIFOP, port 2369), or give a capture \
    that has one: --beams ADDRESS=FILE";

/// Layout of the tail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Generation {
    /// 1206 bytes: microseconds within the second.
    Third,
    /// 1212 bytes: date, or seconds since 1970, and nanoseconds.
    Fourth,
}

/// Byte ranges of the tails.
mod field {
    use std::ops::Range;

    pub const THIRD_MICROS: Range<usize> = 1200..1204; // u32
    pub const THIRD_MODE: usize = 1204;
    pub const DATE: Range<usize> = 1200..1206; // y m d h m s, or seconds, big endian
    pub const NANOS: Range<usize> = 1206..1210; // u32
    pub const MODE: usize = 1210;
}

impl Generation {
    /// Bytes of a data packet.
    pub const fn packet_len(self) -> usize {
        match self {
            Self::Third => 1206,
            Self::Fourth => 1212,
        }
    }

    const fn mode_at(self) -> usize {
        match self {
            Self::Third => field::THIRD_MODE,
            Self::Fourth => field::MODE,
        }
    }
}

/// Units whose pace or clock is not the usual one, each once: models live as long as the program.
static KNOWN: Units<Cx> = Units::new();

/// A model of the series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cx {
    product: &'static Product,
    shot_ns: f64,
    /// The clock counts microseconds where others count nanoseconds: it follows NTP.
    is_micros: bool,
}

impl Cx {
    /// A model at its usual pace.
    pub const fn of(product: &'static Product) -> Self {
        Self {
            product,
            shot_ns: 1e9 / product.shots_per_s,
            is_micros: false,
        }
    }

    /// The blocks of a data packet of the right size.
    fn blocks<'a>(&self, payload: &'a [u8]) -> Option<Packet<'a>> {
        let is_size = payload.len() == self.product.generation.packet_len();
        let packet = payload.get(..velodyne::LEN).and_then(Packet::new)?;
        (is_size && packet.has_banks(&[0])).then_some(packet)
    }

    fn mode(&self, payload: &[u8]) -> ReturnMode {
        match payload.get(self.product.generation.mode_at()) {
            Some(0x38) => ReturnMode::Last,
            Some(0x39) => ReturnMode::Dual,
            _ => ReturnMode::Strongest,
        }
    }

    fn row_ns(&self) -> f64 {
        self.shot_ns * CHANNELS as f64
    }

    fn rotation(&self, packet: &Packet<'_>, mode: ReturnMode, mean_rate: f64) -> Rotation {
        let rows = (0..BLOCKS).step_by(mode.returns());
        let azimuths = rows.map(|block| packet.azimuth_centideg(block));
        Rotation::new(azimuths, self.row_ns().round().max(1.0) as i64, mean_rate)
    }

    /// Device time of the last shot, and what is below its seconds.
    fn stamp_ns(&self, payload: &[u8]) -> Option<(i64, u32)> {
        let number = |range: std::ops::Range<usize>| {
            let bytes: [u8; 4] = payload.get(range)?.try_into().ok()?;
            Some(u32::from_le_bytes(bytes))
        };
        if self.product.generation == Generation::Third {
            let micros = number(field::THIRD_MICROS)?;
            return Some((i64::from(micros) * 1000, micros));
        }
        let below = number(field::NANOS)?;
        let scale = if self.is_micros { 1000 } else { 1 };
        let seconds_ns = match payload.get(field::DATE)? {
            // No calendar has a month 0: seconds since 1970, whose first byte is not used.
            [_, 0, rest @ ..] => {
                let seconds = rest.iter().fold(0, |sum, byte| sum << 8 | i64::from(*byte));
                seconds.saturating_mul(NANOS_PER_SECOND)
            }
            [year, rest @ ..] => date::calendar_ns(2000 + i64::from(*year), rest),
            [] => return None,
        };
        Some((seconds_ns.saturating_add(i64::from(below) * scale), below))
    }

    /// Units with their measured angles: of version 3, and the MSC16.
    fn is_measured(&self) -> bool {
        self.product.generation == Generation::Third || self.product.id == "msc16"
    }

    fn lasers(&self, files: &[UnitFile]) -> (Lasers, Calibration) {
        let nominal = Lasers::nominal(self.product);
        if !self.is_measured() {
            return (nominal, Calibration::Factory);
        }
        let told = files.iter().find_map(|file| {
            let bytes = difop::packet(file)?;
            Some((file, nominal.measured(self.product, &Difop::new(&bytes)?)?))
        });
        match told {
            Some((file, lasers)) => (lasers, Calibration::of(&[file], Calibration::Factory)),
            None => (nominal, Calibration::Nominal { obtain: OBTAIN }),
        }
    }

    /// Writes a data packet: the inverse of decoding.
    pub fn encode(&self, packet: &RawPacket) -> Vec<u8> {
        let generation = self.product.generation;
        let mode = packet.mode;
        let mut bytes = velodyne::encode(&packet.blocks, 0, mode, self.product.code).to_vec();
        let below = packet.time_ns.rem_euclid(NANOS_PER_SECOND);
        if generation == Generation::Third {
            let micros = (below / 1000) as u32;
            bytes[field::THIRD_MICROS].copy_from_slice(&micros.to_le_bytes());
            return bytes;
        }
        let mode_byte = bytes[field::THIRD_MODE];
        bytes.resize(generation.packet_len(), 0);
        let (mut day, _) = date::bytes(Timestamp(packet.time_ns));
        day[0] = day[0].wrapping_sub(100); // since 2000, not since 1900
        if packet.is_ptp {
            let seconds = packet.time_ns.div_euclid(NANOS_PER_SECOND) as u32;
            day[..2].fill(0);
            day[2..].copy_from_slice(&seconds.to_be_bytes());
        }
        bytes[field::DATE].copy_from_slice(&day);
        let below = if self.is_micros { below / 1000 } else { below };
        bytes[field::NANOS].copy_from_slice(&(below as u32).to_le_bytes());
        bytes[field::MODE] = mode_byte;
        bytes[generation.packet_len() - 1] = self.product.code;
        bytes
    }

    /// The same with a clock that counts microseconds.
    pub fn with_ntp(self) -> Self {
        Self {
            is_micros: true,
            ..self
        }
    }
}

/// A packet to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawPacket {
    /// Time of the last shot, ns since 1970; version 3 keeps what is below the second.
    pub time_ns: i64,
    /// Whether the time is written as seconds since 1970 and not as a date.
    pub is_ptp: bool,
    /// Return mode.
    pub mode: ReturnMode,
    /// Blocks.
    pub blocks: [RawBlock; BLOCKS],
}

impl Model for Cx {
    fn id(&self) -> &'static str {
        self.product.id
    }

    fn title(&self) -> &'static str {
        self.product.title
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        if Difop::new(payload).is_some() {
            return Some(PacketKind::Metadata);
        }
        self.blocks(payload)?;
        let generation = self.product.generation;
        let is_mode = matches!(payload[generation.mode_at()], 0x37..=0x39);
        let is_code = payload.last() == Some(&self.product.code);
        let is_below = self.stamp_ns(payload).is_some_and(|(_, below)| {
            let most = match generation {
                Generation::Third => 1_000_000,
                Generation::Fourth => 1_000_000_000,
            };
            below <= most
        });
        (is_mode && is_code && is_below).then_some(PacketKind::Data)
    }

    fn as_sent(&self, packets: &[&[u8]]) -> Option<ModelRef> {
        const MICROS: u32 = 1_000_000;
        let below = packets.iter().filter_map(|p| Some(self.stamp_ns(p)?.1));
        // Ten packets take far longer than the millisecond in which nanoseconds are as few.
        let is_micros = self.product.generation == Generation::Fourth
            && packets.len() >= 10
            && below.max().is_some_and(|most| most < MICROS);
        let sent = Self { is_micros, ..*self };
        let factor = pace::factor(&sent, packets);
        let shot_ns = sent.shot_ns * factor.unwrap_or(1.0);
        let sent = Self { shot_ns, ..sent };
        (sent != *self)
            .then(|| KNOWN.like(sent))?
            .map(|known| known as ModelRef)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        self.blocks(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let code = payload.last().copied().unwrap_or(0);
        let known = PRODUCTS.iter().find(|product| {
            product.code == code && product.generation.packet_len() == payload.len()
        });
        let what = known.map_or("of no known product".into(), |p| {
            format!("of a {}", p.title)
        });
        let why = format!(
            "the blocks fit a Leishen of the C series, the product byte {code:#04x} is {what}"
        );
        let may_be = known.is_none().then_some(self.product.id);
        Misfit { why, may_be }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let packet = self.blocks(payload)?;
        let mode = self.mode(payload);
        let rotation = self.rotation(&packet, mode, 0.0);
        let (stamp_ns, _) = self.stamp_ns(payload)?;
        let since_ns = (rotation.duration_ns() as f64 - self.shot_ns).round() as i64;
        let device_ns = stamp_ns.saturating_sub(since_ns);
        let wrap_ns = self.counting().clock_wrap_ns;
        rotation.is_valid(0).then(|| Head {
            device_ns: wrap_ns.map_or(device_ns, |wrap_ns| device_ns.rem_euclid(wrap_ns)),
            sequence: None,
            azimuth_rad: rotation.azimuth_rad(0),
            turned_rad: rotation.turned_rad(),
            rate_rad_per_ns: rotation.rate_rad_per_ns(),
            duration_ns: rotation.duration_ns(),
            left_out: rotation.left_out(),
            return_mode: mode,
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let Some(packet) = self.blocks(payload) else {
            return tally;
        };
        let stride = self.mode(payload).returns();
        for block in (0..BLOCKS)
            .step_by(stride)
            .filter(|b| is_usable(&packet, *b))
        {
            let seconds = packet.returns(block + stride - 1);
            for (one, other) in packet.returns(block).zip(seconds) {
                let other = if stride == 1 { 0 } else { other.range };
                tally.add_pair(one.range, other);
            }
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        let rows = BLOCKS / mode.returns().min(2);
        (rows as f64 * self.row_ns()).round() as i64
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: (self.product.generation == Generation::Third)
                .then_some(NANOS_PER_SECOND),
            sequence_bits: None,
        }
    }

    fn takes(&self, file: &UnitFile) -> bool {
        difop::packet(file).is_some()
    }

    fn describe(&self, files: &[UnitFile]) -> UnitFacts {
        let bytes = files.iter().find_map(difop::packet);
        let difop = bytes.as_deref().and_then(Difop::new);
        let mut notes = Vec::new();
        if let Some(difop) = difop.filter(|difop| !difop.is_third()) {
            notes.push(format!("clock source: {}", difop.clock()));
        }
        if self.is_micros {
            notes.push("the clock counts microseconds, as it does when it follows NTP".into());
        }
        let usual_ns = 1e9 / self.product.shots_per_s;
        if (self.shot_ns / usual_ns - 1.0).abs() > 1e-9 {
            let (found_us, usual_us) = (self.shot_ns / 1e3, usual_ns / 1e3);
            notes.push(format!(
                "shots {found_us:.3} us apart by the packets' pace, usually {usual_us:.3} us"
            ));
        }
        UnitFacts {
            return_mode: None,
            notes,
        }
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        let (lasers, calibration) = self.lasers(files);
        Ok(Fitted {
            decoder: Box::new(CxDecoder::new(*self, &lasers)),
            calibration,
        })
    }
}

/// Whether a block states an azimuth within one turn.
fn is_usable(packet: &Packet<'_>, block: usize) -> bool {
    packet.azimuth_centideg(block) < TURN_CENTIDEG
}
