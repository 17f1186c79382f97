//! How packets become returns.

use super::lanes::Points;
use super::sensor::Livox;
use super::shots::{Packet, Step};
use crate::cloud::ReturnKind;
use crate::packet::aim::{Centidegrees, wrapped};
use crate::packet::echoes::{self, Meanings, RawEcho, judge};
use crate::packet::frames::{RAD_PER_NS, phase_rad};
use crate::packet::sheet::Sheet;
use crate::packet::{Decoded, Decoder, Place, ReturnMode};
use crate::simd::{Kernel, vectorized};
use crate::time::Timestamp;

pub(super) struct LivoxDecoder {
    model: Livox,
    table: Centidegrees,
    pace: Pace,
    points: Points,
    orders: Vec<u64>,
    sheet: Sheet,
}

/// What the points of all packets of one pace and layout have in common, in the order of the packet.
#[derive(Debug, Default)]
struct Pace {
    of: Option<(Step, usize)>,
    since_ns: Vec<i64>,
    since_rad: Vec<f64>,
    line: Vec<u16>,
    shot: Vec<u16>,
}

impl Pace {
    /// Brings it to the pace and layout of a packet.
    fn follow(&mut self, packet: &Packet<'_>, lines: u16) {
        let echoes = packet.form.echoes;
        let (shots, of) = (packet.count(), Some((packet.step, echoes)));
        if self.of == of && self.since_ns.len() >= shots * echoes {
            return;
        }
        let each = |since_ns| std::iter::repeat_n(since_ns, echoes);
        let times = packet.step.times().take(shots);
        self.of = of;
        self.since_ns = times.flat_map(each).collect();
        self.since_rad = self
            .since_ns
            .iter()
            .map(|ns| *ns as f64 * RAD_PER_NS)
            .collect();
        let shot = |shot: usize| std::iter::repeat_n(shot as u16, echoes);
        self.shot = (0..shots).flat_map(shot).collect();
        self.line = self.shot.iter().map(|shot| shot % lines).collect();
    }

    /// Fills in what does not depend on what the shots hit.
    fn fill(&self, place: Place, phase_rad: f64, sheet: &mut Sheet) {
        let len = sheet.len();
        vectorized(Timed {
            pace: self,
            time: place.time,
            phase_rad,
            sheet,
        });
        sheet.ring[..len].copy_from_slice(&self.line[..len]);
        sheet.block[..len].copy_from_slice(&self.shot[..len]);
    }
}

/// Times of all points.
struct Timed<'a> {
    pace: &'a Pace,
    time: Timestamp,
    phase_rad: f64,
    sheet: &'a mut Sheet,
}

impl Kernel for Timed<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self { pace, sheet, .. } = self;
        for (since_rad, encoder_rad) in pace.since_rad.iter().zip(&mut sheet.encoder_rad) {
            *encoder_rad = wrapped(self.phase_rad + since_rad);
        }
        for (since_ns, time_ns) in pace.since_ns.iter().zip(&mut sheet.time_ns) {
            *time_ns = self.time.0.saturating_add(*since_ns);
        }
    }
}

impl LivoxDecoder {
    pub fn new(model: Livox) -> Self {
        Self {
            model,
            table: Centidegrees::table(),
            pace: Pace::default(),
            points: Points::default(),
            orders: Vec::new(),
            sheet: Sheet::default(),
        }
    }

    /// Finds what the points of shots with `N` returns are; gives how many repeat another.
    fn judge<const N: usize>(&mut self, mode: ReturnMode) -> u64 {
        let (shots, mut twice) = (self.sheet.len() / N, 0);
        let orders = self.orders.as_chunks::<N>().0;
        for (shot, orders) in orders.iter().enumerate().take(shots) {
            let (kinds, merged) = meanings(mode, orders);
            twice += u64::from(merged);
            for (echo, kind) in kinds.into_iter().enumerate().take(N) {
                if let Some(kind) = kind {
                    self.sheet.hit(N * shot + echo, echo, kind);
                }
            }
        }
        twice
    }
}

impl Decoder for LivoxDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = self.model.read(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let (form, mode) = (packet.form, packet.return_mode());
        self.sheet.open(packet.count() * form.echoes, 1);
        self.pace.follow(&packet, self.model.lines);
        let phase_rad = phase_rad(packet.device_ns);
        self.pace.fill(place, phase_rad, &mut self.sheet);
        self.points.read(form, packet.body, &mut self.sheet);
        self.points.place(form, self.table, &mut self.sheet);
        if form.echoes == 1 {
            let kind = ReturnKind::Strongest;
            return self.sheet.flush_singles(kind, place.packet, out);
        }
        self.points.orders(form, &mut self.orders);
        out.merged += match form.echoes {
            2 => self.judge::<2>(mode),
            _ => self.judge::<{ echoes::MOST }>(mode),
        };
        self.sheet.flush([place.packet; echoes::MOST], out);
    }
}

/// Meaning of the points of a shot, by numbers that grow with their ranges, and how many repeat another.
#[inline(always)]
pub(super) fn meanings(mode: ReturnMode, orders: &[u64]) -> (Meanings, u32) {
    // Places by range stand for the ranges, which have more bits; no range is no return.
    let mut ranks = [RawEcho::default(); echoes::MOST];
    for (rank, order) in ranks.iter_mut().zip(orders) {
        let nearer = orders.iter().filter(|other| *other < order).count() as u16;
        rank.range = if *order == 0 { 0 } else { 1 + nearer };
    }
    let (mut kinds, merged) = judge(mode, &ranks[..orders.len()]);
    if kinds.iter().flatten().count() == echoes::MOST {
        for kind in kinds.iter_mut().flatten() {
            // Between the first and the last of three is the second.
            if *kind == ReturnKind::Strongest {
                *kind = ReturnKind::Second;
            }
        }
    }
    (kinds, merged)
}
