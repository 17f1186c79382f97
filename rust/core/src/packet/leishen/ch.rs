//! The CH series: records of a line, an azimuth, a distance and a brightness each, big endian; a mirror
//! sweeps them over 120 degrees.
//!
//! Packets do not name the model: length and line numbers tell it. A packet's time is that of its last
//! record, as the driver has it; the pace follows from the packets.
//!
//! Source: the maker's driver and the manual of the CH128X1. No real packet was at hand.

use std::f64::consts::{PI, TAU};

use super::difop::{self, Difop};
use super::mirror::{MIRRORS, Mirror};
use super::pace;
use super::paced::Units;
use crate::cloud::{Return, ReturnKind};
use crate::error::UnitError;
use crate::packet::aim::wrapped;
use crate::packet::hesai::date;
use crate::packet::unit::{Calibration, Fitted, UnitFacts, UnitFile};
use crate::packet::{
    Counting, Decoded, Decoder, Head, LeftOut, Misfit, Model, ModelRef, PacketKind, Place,
    ReturnMode, Tally,
};
use crate::time::{NANOS_PER_SECOND, Timestamp};

mod packet;
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

/// Sines and cosines of one line's two angles.
#[derive(Debug, Clone, Copy)]
struct Line {
    first: (f64, f64),
    second: (f64, f64),
}

struct ChDecoder {
    ch: Ch,
    lines: Vec<Line>,
}

impl ChDecoder {
    /// With the offset of the prism and the angles of its faces that the unit tells.
    fn new(ch: Ch, told: Option<[f64; 5]>) -> Self {
        let mirror = ch.mirror;
        let line = |line: usize| {
            let (group, face) = (line / mirror.group, line % mirror.group);
            let usual_deg = mirror.second_deg * face as f64;
            let faces = told.filter(|angles| angles[1..].iter().any(|angle| *angle != 0.0));
            let second_deg = faces.map_or(usual_deg, |angles| angles[1 + face % 4]);
            let offset_deg = told
                .filter(|_| group.is_multiple_of(2))
                .map_or(0.0, |angles| angles[0]);
            Line {
                first: (mirror.first_deg(group) + offset_deg)
                    .to_radians()
                    .sin_cos(),
                second: second_deg.to_radians().sin_cos(),
            }
        };
        Self {
            ch,
            lines: (0..mirror.lines).map(line).collect(),
        }
    }

    /// Direction of a shot.
    fn direction(&self, line: &Line, azimuth_rad: f64) -> [f64; 3] {
        let (sin_first, cos_first) = line.first;
        let (sin_second, cos_second) = line.second;
        let incidence = cos_second * cos_first * (azimuth_rad / 2.0).cos() - sin_second * sin_first;
        let up = (sin_first + 2.0 * incidence * sin_second).clamp(-1.0, 1.0);
        let level = (1.0 - up * up).sqrt();
        let (sin, cos) = azimuth_rad.sin_cos();
        [level * cos, level * sin, up]
    }
}

/// Meanings of the echoes of a record: by distance where there are two.
fn kinds([one, other]: [u32; 2], mode: ReturnMode) -> [Option<ReturnKind>; 2] {
    let only = match mode {
        ReturnMode::Strongest => ReturnKind::Strongest,
        _ => ReturnKind::First,
    };
    match (one, other) {
        (0, 0) => [None, None],
        (0, _) => [None, Some(only)],
        (_, 0) => [Some(only), None],
        (one, other) if one == other => [Some(ReturnKind::Merged), None],
        (one, other) if one < other => [Some(ReturnKind::First), Some(ReturnKind::Last)],
        _ => [Some(ReturnKind::Last), Some(ReturnKind::First)],
    }
}

impl Decoder for ChDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(view) = self.ch.view(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let mode = view.mode();
        for (number, record) in view.numbered() {
            let Some(line) = self.lines.get(usize::from(record.line)) else {
                out.drops.add("line_unknown", 1);
                continue;
            };
            let kinds = kinds(record.echoes.map(|echo| echo.0), mode);
            out.merged += u64::from(kinds[0] == Some(ReturnKind::Merged));
            let stated_deg = f64::from(record.azimuth) * 0.01;
            let azimuth_rad = self.ch.mirror.azimuth_deg(stated_deg).to_radians();
            let direction = self.direction(line, azimuth_rad);
            let delay_ns = (number as f64 * self.ch.record_ns).round() as i64;
            for (index, ((range, intensity), kind)) in
                record.echoes.into_iter().zip(kinds).enumerate()
            {
                let Some(kind) = kind else { continue };
                let range_m = f64::from(range) * packet::UNIT_M;
                out.encoder_rad
                    .push(wrapped(stated_deg.to_radians().rem_euclid(TAU)));
                out.cloud.push(&Return {
                    xyz_m: direction.map(|part| (range_m * part) as f32),
                    time: Timestamp(place.time.0.saturating_add(delay_ns)),
                    range_m: range_m as f32,
                    azimuth_rad: wrapped(azimuth_rad.rem_euclid(2.0 * PI)),
                    ring: record.line.into(),
                    intensity: intensity.into(),
                    return_index: index as u8,
                    return_kind: kind,
                    packet: place.packet,
                    block: number as u16,
                });
            }
        }
    }
}
