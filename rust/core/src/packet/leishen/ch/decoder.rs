//! From records of the CH series to returns.

use std::f64::consts::TAU;

use super::packet::Record;
use super::{Ch, MOST_CENTIDEG, packet};
use crate::cloud::ReturnKind;
use crate::packet::aim::wrapped;
use crate::packet::echoes::MOST;
use crate::packet::leishen::mirror::Mirror;
use crate::packet::rays::Rays;
use crate::packet::sheet::{LANES, Sheet, lane, lane_mut};
use crate::packet::{Decoded, Decoder, Place, ReturnMode};
use crate::simd::{Kernel, vectorized};

/// Numbers of lines that a record may state.
const LINES: usize = 256;

/// Sines and cosines of one line's two angles.
#[derive(Debug, Clone, Copy, Default)]
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
    lines: [Line; LINES],
    /// By hundredths of a degree, as far as the model sends them.
    aims: Vec<Aim>,
    /// When each record of a packet was fired, after the first, with room for a chunk behind the last one.
    delays_ns: Vec<i64>,
    numbers: Vec<u16>,
    /// What the records of the packet at hand state, with room for a chunk behind the last one.
    stated_centideg: Vec<u16>,
    rays: Rays,
    sheet: Sheet,
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
        let most = packet::count(ReturnMode::Strongest);
        Self {
            ch,
            // Others than the model's have no echoes.
            lines: std::array::from_fn(|number| match number < mirror.lines {
                true => line(number),
                false => Line::default(),
            }),
            aims: (0..=MOST_CENTIDEG)
                .map(|angle| Aim::new(mirror, angle))
                .collect(),
            delays_ns: (0..most + LANES)
                .map(|number| delay_ns(ch, number))
                .collect(),
            numbers: (0..most as u16).collect(),
            stated_centideg: vec![0; most + LANES],
            rays: Rays::default(),
            sheet: Sheet::default(),
        }
    }

    /// Reads the records of a packet; gives how many are of lines that the model does not have.
    #[inline(always)]
    fn read<const LEN: usize>(&mut self, records: &[[u8; LEN]], returns: usize) -> u64 {
        let shots = records.len();
        self.sheet.open(shots, returns);
        self.rays.open(shots);
        let (sheet, lines) = (&mut self.sheet, self.ch.mirror.lines);
        let (ranges, more_ranges) = sheet.range.split_at_mut(shots);
        let (intensities, more_intensities) = sheet.intensity.split_at_mut(shots);
        let rings = &mut sheet.ring[..shots];
        let stated = &mut self.stated_centideg[..shots];
        let mut unknown = 0;
        for (at, bytes) in records.iter().enumerate() {
            let Some(record) = Record::read(bytes) else {
                continue;
            };
            let is_known = usize::from(record.line) < lines;
            unknown += u64::from(!is_known);
            let range = |range: u32| if is_known { range as i32 } else { 0 };
            let [one, other] = record.echoes;
            (rings[at], stated[at]) = (record.line.into(), record.azimuth);
            (ranges[at], intensities[at]) = (range(one.0), one.1.into());
            if returns > 1 {
                more_ranges[at] = range(other.0);
                more_intensities[at] = other.1.into();
            }
        }
        unknown
    }

    /// Places the echoes.
    fn place(&mut self, mode: ReturnMode, place: Place) {
        vectorized(Point {
            mirror: self.ch.mirror,
            lines: &self.lines,
            aims: &self.aims,
            stated_centideg: &self.stated_centideg,
            delays_ns: &self.delays_ns,
            time_ns: place.time.0,
            rays: &mut self.rays,
            sheet: &mut self.sheet,
        });
        let shots = self.sheet.echoes(0);
        self.sheet.block[shots.clone()].copy_from_slice(&self.numbers[shots]);
        if mode.returns() > 1 {
            self.sheet.repeat();
        }
        for echo in 0..mode.returns() {
            let echoes = self.sheet.echoes(echo);
            self.rays.place(0, packet::UNIT_M, echoes, &mut self.sheet);
        }
    }

    /// Finds what the echoes of records of two are; gives how many were merged into others.
    fn judge(&mut self) -> u64 {
        let [first, second] = [0, 1].map(|echo| self.sheet.echoes(echo));
        let mut merged = 0;
        for (one, other) in first.zip(second) {
            let kinds = kinds([self.sheet.range[one], self.sheet.range[other]]);
            merged += u64::from(kinds[0] == Some(ReturnKind::Merged));
            for (echo, (entry, kind)) in [one, other].into_iter().zip(kinds).enumerate() {
                if let Some(kind) = kind {
                    self.sheet.hit(entry, echo, kind);
                }
            }
        }
        merged
    }
}

/// Points the shots of all records.
struct Point<'a> {
    mirror: &'static Mirror,
    lines: &'a [Line; LINES],
    aims: &'a [Aim],
    stated_centideg: &'a [u16],
    delays_ns: &'a [i64],
    time_ns: i64,
    rays: &'a mut Rays,
    sheet: &'a mut Sheet,
}

impl Kernel for Point<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self { sheet, aims, .. } = self;
        for at in sheet.echoes(0).step_by(LANES) {
            let (rings, stated) = (lane(&sheet.ring, at), lane(self.stated_centideg, at));
            let encoder_rad = lane_mut(&mut sheet.encoder_rad, at);
            let azimuth_rad = lane_mut(&mut sheet.azimuth_rad, at);
            let mut sines = [[0.0; LANES]; 7];
            for k in 0..LANES {
                let line = &self.lines[usize::from(rings[k]) % LINES];
                let known = aims.get(usize::from(stated[k])).copied();
                let aim = known.unwrap_or_else(|| Aim::new(self.mirror, stated[k]));
                (encoder_rad[k], azimuth_rad[k]) = (aim.encoder_rad, aim.azimuth_rad);
                (sines[0][k], sines[1][k]) = line.first;
                (sines[2][k], sines[3][k]) = line.second;
                (sines[4][k], sines[5][k]) = aim.azimuth;
                sines[6][k] = aim.cos_half;
            }
            let (delays_ns, time_ns) = (lane(self.delays_ns, at), lane_mut(&mut sheet.time_ns, at));
            let [x, y, z] = self.rays.parts.each_mut().map(|part| lane_mut(part, at));
            for k in 0..LANES {
                time_ns[k] = self.time_ns.saturating_add(delays_ns[k]);
                [x[k], y[k], z[k]] = direction(sines.each_ref().map(|sines| sines[k]));
            }
        }
    }
}

/// When a record was fired, after the first of its packet.
fn delay_ns(ch: Ch, number: usize) -> i64 {
    (number as f64 * ch.record_ns).round() as i64
}

/// Direction of a shot by sine and cosine of the two angles of its line and of the azimuth, and the cosine of half of it.
#[inline(always)]
fn direction(sines: [f64; 7]) -> [f64; 3] {
    let [
        sin_first,
        cos_first,
        sin_second,
        cos_second,
        sin,
        cos,
        cos_half,
    ] = sines;
    let incidence = cos_second * cos_first * cos_half - sin_second * sin_first;
    let up = (sin_first + 2.0 * incidence * sin_second).clamp(-1.0, 1.0);
    let level = (1.0 - up * up).sqrt();
    [level * cos, level * sin, up]
}

/// Meanings of the two echoes of a record, by distance.
fn kinds(echoes: [i32; 2]) -> [Option<ReturnKind>; 2] {
    match echoes {
        [0, 0] => [None, None],
        [0, _] => [None, Some(ReturnKind::First)],
        [_, 0] => [Some(ReturnKind::First), None],
        [one, other] if one == other => [Some(ReturnKind::Merged), None],
        [one, other] if one < other => [Some(ReturnKind::First), Some(ReturnKind::Last)],
        _ => [Some(ReturnKind::Last), Some(ReturnKind::First)],
    }
}

impl Decoder for ChDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(view) = self.ch.view(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let unknown = match view.mode() {
            ReturnMode::Strongest => self.read(view.bytes::<7>(), 1),
            _ => self.read(view.bytes::<11>(), 2),
        };
        if unknown > 0 {
            out.drops.add("line_unknown", unknown);
        }
        self.place(view.mode(), place);
        if view.mode().returns() == 1 {
            let kind = ReturnKind::Strongest;
            return self.sheet.flush_singles(kind, place.packet, out);
        }
        out.merged += self.judge();
        self.sheet.flush([place.packet; MOST], out);
    }
}
