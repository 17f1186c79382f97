//! From records of the CH series to returns.

use std::f64::consts::TAU;

use super::{Ch, MOST_CENTIDEG, packet};
use crate::cloud::{Return, ReturnKind};
use crate::packet::aim::wrapped;
use crate::packet::batch::Batch;
use crate::packet::leishen::mirror::Mirror;
use crate::packet::{Decoded, Decoder, Place, ReturnMode};
use crate::time::Timestamp;

/// Sines and cosines of one line's two angles.
#[derive(Debug, Clone, Copy)]
struct Line {
    first: (f64, f64),
    second: (f64, f64),
}

/// What an azimuth that records state means.
#[derive(Debug, Clone, Copy)]
struct Aim {
    encoder_rad: f32,
    azimuth_rad: f32,
    azimuth: (f64, f64),
    cos_half: f64,
}

impl Aim {
    fn new(mirror: &Mirror, stated_centideg: u16) -> Self {
        let stated_deg = f64::from(stated_centideg) * 0.01;
        let azimuth_rad = mirror.azimuth_deg(stated_deg).to_radians();
        Self {
            encoder_rad: wrapped(stated_deg.to_radians().rem_euclid(TAU)),
            azimuth_rad: wrapped(azimuth_rad.rem_euclid(TAU)),
            azimuth: azimuth_rad.sin_cos(),
            cos_half: (azimuth_rad / 2.0).cos(),
        }
    }
}

pub(super) struct ChDecoder {
    ch: Ch,
    lines: Vec<Line>,
    /// By hundredths of a degree, as far as the model sends them.
    aims: Vec<Aim>,
    /// When each record of a packet was fired, after the first.
    delays_ns: Vec<i64>,
    /// Returns of the packet at hand.
    batch: Batch,
}

impl ChDecoder {
    /// With the offset of the prism and the angles of its faces that the unit tells.
    pub fn new(ch: Ch, told: Option<[f64; 5]>) -> Self {
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
            aims: (0..=MOST_CENTIDEG)
                .map(|angle| Aim::new(mirror, angle))
                .collect(),
            delays_ns: (0..packet::count(ReturnMode::Strongest))
                .map(|number| delay_ns(ch, number))
                .collect(),
            batch: Batch::default(),
        }
    }

    fn aim(&self, stated_centideg: u16) -> Aim {
        let known = self.aims.get(usize::from(stated_centideg)).copied();
        known.unwrap_or_else(|| Aim::new(self.ch.mirror, stated_centideg))
    }
}

/// When a record was fired, after the first of its packet.
fn delay_ns(ch: Ch, number: usize) -> i64 {
    (number as f64 * ch.record_ns).round() as i64
}

/// Direction of a shot.
fn direction(line: &Line, aim: &Aim) -> [f64; 3] {
    let (sin_first, cos_first) = line.first;
    let (sin_second, cos_second) = line.second;
    let incidence = cos_second * cos_first * aim.cos_half - sin_second * sin_first;
    let up = (sin_first + 2.0 * incidence * sin_second).clamp(-1.0, 1.0);
    let level = (1.0 - up * up).sqrt();
    let (sin, cos) = aim.azimuth;
    [level * cos, level * sin, up]
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
        let mut batch = std::mem::take(&mut self.batch);
        for (number, record) in view.numbered() {
            let Some(line) = self.lines.get(usize::from(record.line)) else {
                out.drops.add("line_unknown", 1);
                continue;
            };
            let kinds = kinds(record.echoes.map(|echo| echo.0), mode);
            out.merged += u64::from(kinds[0] == Some(ReturnKind::Merged));
            let aim = self.aim(record.azimuth);
            let direction = direction(line, &aim);
            let delay = self.delays_ns.get(number).copied();
            let delay_ns = delay.unwrap_or_else(|| delay_ns(self.ch, number));
            for (index, ((range, intensity), kind)) in
                record.echoes.into_iter().zip(kinds).enumerate()
            {
                let Some(kind) = kind else { continue };
                let range_m = f64::from(range) * packet::UNIT_M;
                let echo = Return {
                    xyz_m: direction.map(|part| (range_m * part) as f32),
                    time: Timestamp(place.time.0.saturating_add(delay_ns)),
                    range_m: range_m as f32,
                    azimuth_rad: aim.azimuth_rad,
                    ring: record.line.into(),
                    intensity: intensity.into(),
                    return_index: index as u8,
                    return_kind: kind,
                    packet: place.packet,
                    block: number as u16,
                };
                batch.push(echo, aim.encoder_rad);
            }
        }
        batch.flush(out);
        self.batch = batch;
    }
}
