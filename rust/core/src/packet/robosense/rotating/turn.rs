//! How the rotor turns within one packet: firings, their azimuths and times, and a gap of the view.

use std::f64::consts::TAU;

use super::Family;
use crate::packet::LeftOut;
use crate::packet::aim::RAD_PER_CENTIDEG;
use crate::packet::robosense::layout::View;

/// No packet has more blocks.
const MOST: usize = 16;
/// A step this many times the usual one, and by more than a degree, is a gap of the field of view.
const GAP_STEPS: u32 = 4;
const GAP_CENTIDEG: u32 = 100;

/// Firings of a packet.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    /// First block of each firing, and one behind the last.
    first: [usize; MOST + 1],
    firings: usize,
    /// The first block is the second one of a firing that began in the packet before.
    lead: usize,
    /// Blocks of the last firing that the next packet has.
    tail: usize,
    azimuth_centideg: [u32; MOST],
    /// Step from each firing to the next.
    forth_rad: [f64; MOST],
    /// Usual step from firing to firing.
    step_rad: f64,
    /// Width of the gap behind the firing with this number.
    gap: Option<(usize, f64)>,
    /// Rotation rate over many packets, or within this one.
    rate_rad_per_ns: f64,
    firing_ns: f64,
    /// Step behind the last firing and before a gap.
    last_step_rad: f64,
    is_on_grid: bool,
    /// Whole packets may end within a firing.
    is_splitting: bool,
}

impl Turn {
    /// Finds the firings; `mean_rate_rad_per_ns` is the rate over the packets before, or 0.
    pub fn of<F: Family>(family: &F, view: &View<'_>, mean_rate_rad_per_ns: f64) -> Self {
        Self::with_returns(family, view, family.returns(view), mean_rate_rad_per_ns)
    }

    /// The same where the returns of a shot are known.
    pub fn with_returns<F: Family>(
        family: &F,
        view: &View<'_>,
        returns: usize,
        mean_rate_rad_per_ns: f64,
    ) -> Self {
        let full = family.blocks_of_firing(returns).max(1);
        let mut turn = Self {
            first: [0; MOST + 1],
            firings: 0,
            lead: 0,
            tail: 0,
            azimuth_centideg: [0; MOST],
            forth_rad: [0.0; MOST],
            step_rad: 0.0,
            gap: None,
            rate_rad_per_ns: 0.0,
            firing_ns: family.firing_ns(returns),
            last_step_rad: 0.0,
            is_on_grid: family.is_on_grid(),
            is_splitting: !view.layout().blocks.is_multiple_of(full),
        };
        turn.find_firings(view, full);
        turn.find_steps();
        turn.last_step_rad = turn.step_rad;
        let own = turn.step_rad / turn.firing_ns;
        turn.rate_rad_per_ns = if mean_rate_rad_per_ns > 0.0 {
            mean_rate_rad_per_ns
        } else {
            own
        };
        turn
    }

    /// Where no firing follows, the rotor turns at the speed that it is set to, as the maker has it.
    pub fn with_speed(mut self, rpm: Option<u16>) -> Self {
        if let Some(rpm) = rpm.filter(|rpm| *rpm > 0) {
            let step_rad = f64::from(rpm) * TAU / 60e9 * self.firing_ns;
            self.last_step_rad = (step_rad / RAD_PER_CENTIDEG).round() * RAD_PER_CENTIDEG;
        }
        self
    }

    /// Blocks of one firing share an azimuth. A first firing that is not whole began before the packet.
    fn find_firings(&mut self, view: &View<'_>, full: usize) {
        let blocks = view.blocks().min(MOST);
        for block in 0..blocks {
            let is_next = self.firings == 0
                || view.azimuth(block) != view.azimuth(block - 1)
                || block - self.first[self.firings - 1] >= full;
            if is_next {
                self.first[self.firings] = block;
                self.azimuth_centideg[self.firings] = view.azimuth(block).into();
                self.firings += 1;
            }
        }
        self.first[self.firings] = blocks;
        if self.firings > 1 {
            self.lead = full.saturating_sub(self.first[1]);
            let last = blocks - self.first[self.firings - 1];
            self.tail = full.saturating_sub(last);
        }
    }

    fn find_steps(&mut self) {
        let mut steps = [0_u32; MOST];
        let count = self.firings.saturating_sub(1);
        for (firing, step) in steps.iter_mut().enumerate().take(count) {
            let (from, to) = (
                self.azimuth_centideg[firing],
                self.azimuth_centideg[firing + 1],
            );
            *step = (to + 36_000 - from) % 36_000;
        }
        for (forth_rad, step) in self.forth_rad.iter_mut().zip(steps) {
            *forth_rad = f64::from(step) * RAD_PER_CENTIDEG;
        }
        let steps = &steps[..count];
        let mut sorted = [0; MOST];
        sorted[..count].copy_from_slice(steps);
        sorted[..count].sort_unstable();
        let usual = sorted[count / 2];
        let is_gap = |step: &u32| *step > usual * GAP_STEPS && *step > usual + GAP_CENTIDEG;
        let (sum, number) = steps
            .iter()
            .filter(|step| !is_gap(step))
            .fold((0, 0), |(sum, number), step| (sum + step, number + 1));
        self.step_rad = f64::from(sum) / f64::from(number.max(1)) * RAD_PER_CENTIDEG;
        let gap = steps.iter().enumerate().find(|(_, step)| is_gap(step));
        self.gap =
            gap.map(|(firing, step)| (firing, f64::from(*step) * RAD_PER_CENTIDEG - self.step_rad));
    }

    /// Number of firings.
    pub fn firings(&self) -> usize {
        self.firings
    }

    /// Blocks of a firing, with their place in it.
    pub fn blocks_of(&self, firing: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let first = self.first[firing];
        let lead = if firing == 0 { self.lead } else { 0 };
        (first..self.first[firing + 1]).map(move |block| (block, block - first + lead))
    }

    /// Whether the first firing began in the packet before.
    pub fn has_lead(&self) -> bool {
        self.lead > 0
    }

    /// Whether the last firing goes on in the next packet.
    pub fn has_tail(&self) -> bool {
        self.is_splitting && self.tail > 0
    }

    /// Encoder azimuth of a firing, [0, 2 pi).
    pub fn azimuth_rad(&self, firing: usize) -> f64 {
        f64::from(self.azimuth_centideg[firing]) * RAD_PER_CENTIDEG
    }

    /// What the rotor turns from a firing to the next.
    pub fn step_rad(&self, firing: usize) -> f64 {
        let next = firing + 1;
        let is_last = next >= self.firings || self.gap.is_some_and(|(before, _)| before == firing);
        if is_last {
            self.last_step_rad
        } else {
            self.forth_rad[firing]
        }
    }

    /// What the rotor turns until a shot within a firing of this step.
    pub fn turned_until(&self, step_rad: f64, delay_ns: i64) -> f64 {
        let turned_rad = step_rad * delay_ns as f64 / self.firing_ns;
        if self.is_on_grid {
            // Steps are whole hundredths; a quotient just below one is one.
            (turned_rad / RAD_PER_CENTIDEG + 1e-6).floor() * RAD_PER_CENTIDEG
        } else {
            turned_rad
        }
    }

    /// Time of a firing after the packet's, over a gap from the rotation rate.
    pub fn start_ns(&self, firing: usize) -> i64 {
        let gap_ns = match self.gap {
            Some((before, width_rad)) if firing > before && self.rate_rad_per_ns > 0.0 => {
                width_rad / self.rate_rad_per_ns
            }
            _ => 0.0,
        };
        (firing as f64 * self.firing_ns + gap_ns).round() as i64
    }

    /// Rotation rate within the packet.
    pub fn rate_rad_per_ns(&self) -> f64 {
        self.step_rad / self.firing_ns
    }

    /// Firings until the next packet starts, which is at the last firing where that one goes on in it.
    fn whole_firings(&self) -> f64 {
        let shared = usize::from(self.has_tail());
        self.firings.saturating_sub(shared) as f64
    }

    /// Angle from the first shot to where the next packet starts.
    pub fn turned_rad(&self) -> f64 {
        let gap_rad = self.gap.map_or(0.0, |(_, width_rad)| width_rad);
        self.step_rad * self.whole_firings() + gap_rad
    }

    /// Time from the first shot to the start of the next packet.
    pub fn duration_ns(&self) -> i64 {
        let gap_ns = match self.gap {
            Some((_, width_rad)) if self.rate_rad_per_ns > 0.0 => width_rad / self.rate_rad_per_ns,
            _ => 0.0,
        };
        (self.whole_firings() * self.firing_ns + gap_ns).round() as i64
    }

    /// The gap of a limited field of view.
    pub fn left_out(&self) -> Option<LeftOut> {
        self.gap.map(|(firing, width_rad)| LeftOut {
            after_rad: (firing + 1) as f64 * self.step_rad,
            width_rad,
            is_instant: false,
        })
    }
}
