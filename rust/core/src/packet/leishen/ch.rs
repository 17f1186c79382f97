//! The CH series: records of a line, an azimuth, a distance and a brightness each, big endian; a mirror
//! sweeps them over 120 degrees.
//!
//! Packets do not name the model: length and line numbers tell it. A packet's time is that of its last
//! record, as the driver has it; the pace follows from the packets.
//!
//! Source: the maker's driver and the manual of the CH128X1. No real packet was at hand.

use super::difop::{self, Difop};
use super::mirror::{MIRRORS, Mirror};
use super::pace;
use super::paced::Units;
use crate::error::UnitError;
use crate::packet::hesai::date;
use crate::packet::unit::{Calibration, Fitted, UnitFacts, UnitFile};
use crate::packet::{
    Counting, Head, LeftOut, Misfit, Model, ModelRef, PacketKind, ReturnMode, Tally,
};
use crate::time::NANOS_PER_SECOND;

mod decoder;
mod packet;
use decoder::ChDecoder;
use packet::View;
pub use packet::{RawPacket, RawRecord, Record};

/// Records a second of a CH128X1; where packets come at another pace theirs is taken.
const RECORDS_PER_S: f64 = 760_000.0;
/// Steps beyond this are the way of the mirror back to its start.
const BACK_DEG: f64 = 20.0;
/// The packets of short models tell the second within the minute in every mode.
const MINUTE_NS: i64 = 60 * NANOS_PER_SECOND;

static KNOWN: Units<Ch> = Units::new();

/// A model of the series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ch {
    mirror: &'static Mirror,
    record_ns: f64,
    /// The clock of a short packet counts microseconds, not nanoseconds.
    is_micros: bool,
}

impl Ch {
    /// A model at its usual pace.
    pub const fn of(mirror: &'static Mirror) -> Self {
        Self {
            mirror,
            record_ns: 1e9 / RECORDS_PER_S,
            is_micros: true,
        }
    }

    fn view<'a>(&self, payload: &'a [u8]) -> Option<View<'a>> {
        View::new(payload, self.mirror.len)
    }

    fn is_short(&self) -> bool {
        self.mirror.len == 1206
    }

    /// Device time of the last record, and what is below its seconds.
    fn stamp_ns(&self, view: &View<'_>) -> (i64, u32) {
        let below = view.below();
        if self.is_short() {
            let scale = if self.is_micros { 1000 } else { 1 };
            let seconds = i64::from(view.second());
            return (seconds * NANOS_PER_SECOND + i64::from(below) * scale, below);
        }
        let seconds_ns = match view.date() {
            [0xFF, _, rest @ ..] => {
                let seconds = rest.iter().fold(0, |sum, byte| sum << 8 | i64::from(*byte));
                seconds.saturating_mul(NANOS_PER_SECOND)
            }
            [year, rest @ ..] => date::calendar_ns(2000 + i64::from(year), &rest),
        };
        (seconds_ns.saturating_add(i64::from(below)), below)
    }

    fn is_own(&self, view: &View<'_>) -> bool {
        let is_record = |record: &Record| {
            let is_azimuth = record.azimuth <= MOST_CENTIDEG
                && (!self.is_short()
                    || !record.is_seen()
                    || SHORT_CENTIDEG.contains(&record.azimuth));
            usize::from(record.line) < self.mirror.lines && is_azimuth
        };
        let (_, below) = self.stamp_ns(view);
        let is_time = below < NANOS_PER_SECOND as u32 && (!self.is_short() || view.second() < 60);
        is_time
            && view.records().all(|record| is_record(&record))
            && is_seen(view)
            && (self.is_short() || view.records().any(|record| record.line > 0))
    }

    fn duration_ns(&self, mode: ReturnMode) -> f64 {
        self.record_ns * packet::count(mode) as f64
    }

    /// Writes a data packet: the inverse of decoding.
    pub fn encode(&self, packet: &RawPacket) -> Vec<u8> {
        packet::encode(packet, self.mirror.len, self.is_micros)
    }
}

/// Azimuths that the models of short packets send; a CH64W sends what lies beyond.
const SHORT_CENTIDEG: std::ops::RangeInclusive<u16> = 2_500..=15_500;
/// Azimuths that any model sends.
const MOST_CENTIDEG: u16 = 18_000;

fn is_seen(view: &View<'_>) -> bool {
    const LEAST_ECHOES: usize = 2;
    view.records().filter(Record::is_seen).count() >= LEAST_ECHOES
}

/// Whether a payload is of a CH64W, which is not decoded: lines below 64, azimuths beyond those of its siblings.
pub fn is_wide(payload: &[u8]) -> bool {
    let is_record = |record: Record| record.line < 64 && record.azimuth <= MOST_CENTIDEG;
    let is_beyond = |record: Record| record.is_seen() && !SHORT_CENTIDEG.contains(&record.azimuth);
    View::new(payload, 1206).is_some_and(|view| {
        is_seen(&view) && view.records().all(is_record) && view.records().any(is_beyond)
    })
}

/// Whether a payload is of a CX1S3, which is not decoded: one line.
pub fn is_one_line(payload: &[u8]) -> bool {
    let is_record = |record: Record| record.line == 0 && record.azimuth <= MOST_CENTIDEG;
    View::new(payload, 1212).is_some_and(|view| is_seen(&view) && view.records().all(is_record))
}

/// Azimuth of the first record, how far the records go on from it, and the way of the mirror back.
fn swept(view: &View<'_>) -> Option<(f64, f64, Option<LeftOut>)> {
    let mut azimuths = view
        .records()
        .map(|record| f64::from(record.azimuth) * 0.01);
    let first_deg = azimuths.next()?;
    let (mut last_deg, mut turned_deg, mut left_out) = (first_deg, 0.0_f64, None);
    for azimuth_deg in azimuths {
        let step_deg = (azimuth_deg - last_deg + 180.0).rem_euclid(360.0) - 180.0;
        let is_back = step_deg.abs() > BACK_DEG;
        let step_deg = if is_back {
            step_deg.rem_euclid(360.0)
        } else {
            step_deg
        };
        if is_back && left_out.is_none() {
            left_out = Some(LeftOut {
                after_rad: turned_deg.max(0.0).to_radians(),
                width_rad: step_deg.to_radians(),
                is_instant: true,
            });
        }
        turned_deg += step_deg;
        last_deg = azimuth_deg;
    }
    let turned_rad = turned_deg.clamp(0.0, 359.0).to_radians();
    Some((
        first_deg.to_radians(),
        turned_rad,
        left_out.filter(|gap| gap.after_rad + gap.width_rad <= turned_rad),
    ))
}

impl Model for Ch {
    fn id(&self) -> &'static str {
        self.mirror.id
    }

    fn title(&self) -> &'static str {
        self.mirror.title
    }

    fn candidates(&self) -> &'static [&'static str] {
        self.mirror.candidates
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        if Difop::new(payload).is_some() {
            return Some(PacketKind::Metadata);
        }
        let view = self.view(payload)?;
        self.is_own(&view).then_some(PacketKind::Data)
    }

    /// The highest line is one that smaller models do not have.
    fn suits(&self, packets: &[&[u8]]) -> bool {
        let views = packets.iter().filter_map(|payload| self.view(payload));
        let highest = views
            .flat_map(|view| view.records().map(|record| record.line).max())
            .max();
        highest.is_some_and(|line| usize::from(line) >= self.mirror.least_line)
    }

    fn doubt(&self, _packets: &[&[u8]]) -> Option<String> {
        let id = self.mirror.id;
        let others: Vec<&str> = MIRRORS
            .iter()
            .map(|mirror| mirror.id)
            .filter(|other| *other != id)
            .collect();
        let others = others.join(", ");
        Some(format!(
            "told by its length and line numbers alone: if it is one of {others}, name it: --sensor SOURCE=MODEL"
        ))
    }

    fn as_sent(&self, packets: &[&[u8]]) -> Option<ModelRef> {
        const MICROS: u32 = 1_000_000;
        let below = packets.iter().filter_map(|p| Some(self.view(p)?.below()));
        let is_micros = below.max().is_none_or(|most| most < MICROS);
        let sent = Self { is_micros, ..*self };
        let factor = pace::factor(&sent, packets);
        let record_ns = sent.record_ns * factor.unwrap_or(1.0);
        let sent = Self { record_ns, ..sent };
        (sent != *self)
            .then(|| KNOWN.like(sent))?
            .map(|known| known as ModelRef)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        self.view(payload)
            .is_some_and(|view| view.records().any(|record| record.is_seen()))
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let why = format!(
            "{} bytes end as those of a Leishen of the CH series, their lines or azimuths are not those of a {}",
            payload.len(),
            self.mirror.title
        );
        Misfit {
            why,
            may_be: Some(self.mirror.id),
        }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let view = self.view(payload)?;
        let (azimuth_rad, turned_rad, left_out) = swept(&view)?;
        let mode = view.mode();
        let duration_ns = self.duration_ns(mode);
        let seen_rad = turned_rad - left_out.map_or(0.0, |gap| gap.width_rad);
        let since_ns = (duration_ns - self.record_ns).round() as i64;
        let device_ns = self.stamp_ns(&view).0.saturating_sub(since_ns);
        let wrap_ns = self.counting().clock_wrap_ns;
        Some(Head {
            device_ns: wrap_ns.map_or(device_ns, |wrap_ns| device_ns.rem_euclid(wrap_ns)),
            sequence: None,
            azimuth_rad,
            turned_rad,
            rate_rad_per_ns: seen_rad.max(0.0) / duration_ns,
            duration_ns: duration_ns.round() as i64,
            left_out,
            return_mode: mode,
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let records = self
            .view(payload)
            .into_iter()
            .flat_map(|view| view.records());
        for record in records.filter(|record| usize::from(record.line) < self.mirror.lines) {
            let [one, other] = record.echoes.map(|echo| echo.0);
            let is_merged = one == other && one != 0;
            tally.points += u32::from(one != 0) + u32::from(other != 0) - u32::from(is_merged);
            tally.merged += u32::from(is_merged);
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        self.duration_ns(mode).round() as i64
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: self.is_short().then_some(MINUTE_NS),
            sequence_bits: None,
        }
    }

    fn takes(&self, file: &UnitFile) -> bool {
        difop::packet(file).is_some()
    }

    fn describe(&self, _files: &[UnitFile]) -> UnitFacts {
        UnitFacts::default()
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        let told = files.iter().find_map(|file| {
            let bytes = difop::packet(file)?;
            Some((file, Difop::new(&bytes)?.prism_deg()?))
        });
        let calibration = match told {
            Some((file, _)) => Calibration::of(&[file], Calibration::Factory),
            None => Calibration::Nominal {
                obtain: super::cx::OBTAIN,
            },
        };
        Ok(Fitted {
            decoder: Box::new(ChDecoder::new(*self, told.map(|(_, angles)| angles))),
            calibration,
        })
    }
}
