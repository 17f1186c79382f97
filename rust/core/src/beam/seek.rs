//! How the blade is found, from metres away: by distances of points, in steps that have to do good.

use nalgebra::DVector;
use rayon::prelude::*;

use super::adjust::{Adjustment, Gates, Stage};
use super::echoes::Echo;
use super::near::Near;
use super::rows::{MIXED_ECHOES, Rows, some};
use super::step::Step;
use super::weights::{Tally, robust};
use crate::error::BeamError;

/// So many echoes and edges of a hold bring a blade that has a drawing near.
const DRAWN: (usize, usize) = (600, 400);
/// The same where no drawing tells how it is bent ...
const UNDRAWN: (usize, usize) = (2000, 2000);
/// ... and where its surface is learned; so many echoes then tell as much as one, for neighbours are off alike.
const OF_SURFACE: (usize, usize) = (8000, 8000);
const ALIKE: f64 = 3.0;
/// A step that does no good is shortened to this share, at most so often.
const SHORTENED: (f64, usize) = (0.4, 6);

impl Adjustment {
    /// A step of Gauss and Newton, shortened until the data cost less than before: far from the blade slopes
    /// promise what equilibria do not keep.
    pub(super) fn seek(&mut self, gates: &Gates) -> Result<Step, BeamError> {
        let all = self.free.clone();
        // What the stage holds would only make its equations larger.
        self.solve_for(all.start..self.open_until(gates.stage).min(all.end));
        let step = self.sought(gates);
        self.solve_for(all);
        step
    }

    fn sought(&mut self, gates: &Gates) -> Result<Step, BeamError> {
        let (mut step, largest, tallies) = self.wanted(gates)?;
        let (from, before) = (self.axes(), self.cost(gates, &tallies));
        let has_gone = (0..SHORTENED.1).any(|_| {
            let is_better = self.is_better(&step, gates, before);
            step *= SHORTENED.0;
            is_better
        });
        let moved_m = if has_gone { self.moved_m(&from) } else { 0.0 };
        Ok(Step {
            largest,
            moved_m,
            tallies,
        })
    }

    /// Goes a step, and comes back where the data do not cost less there.
    pub(super) fn is_better(&mut self, step: &DVector<f64>, gates: &Gates, before: f64) -> bool {
        let spot = self.spot();
        self.values += step;
        self.settle_in(step);
        let solved = match self.is_learned(gates) {
            true => self.linearise_kept(),
            false => self.linearise(),
        };
        let is_better = solved.is_ok() && self.cost_here(gates) < before;
        if !is_better {
            self.return_to(spot);
        }
        is_better
    }

    /// What the unknowns cost, by what became of the data and by what was known before.
    pub(super) fn cost(&self, gates: &Gates, tallies: &[Tally]) -> f64 {
        self.surprise(gates.stage) + tallies.iter().map(|tally| tally.cost).sum::<f64>()
    }

    /// The same without rows.
    fn cost_here(&self, gates: &Gates) -> f64 {
        let lidars = self.lidars();
        let of = |hold| Rows::new(self, hold, &lidars, gates).cost();
        let holds = (0..self.problem.holds.len()).into_par_iter();
        let of_data: Vec<f64> = holds.map(of).collect();
        self.surprise(gates.stage) + of_data.iter().sum::<f64>()
    }
}

impl Rows<'_> {
    /// Looks at the data by distances of points.
    pub(super) fn look_near(&mut self) {
        let seen = &self.adjustment.problem.holds[self.hold].seen;
        let ((echoes, edges), alike) = match self.gates.stage {
            Stage::Surface => (OF_SURFACE, ALIKE),
            _ if self.adjustment.is_vague() => (UNDRAWN, 1.0),
            _ => (DRAWN, 1.0),
        };
        let take = |rows: &mut Self| {
            some(&seen.echoes, echoes).for_each(|echo| rows.add_point(echo, alike));
        };
        self.take(take, edges);
    }

    fn add_point(&mut self, echo: &Echo, alike: f64) {
        if echo.from_end < MIXED_ECHOES {
            self.tally.unfit += 1;
            return;
        }
        let lidar = &self.lidars[echo.lidar];
        let direction = lidar.direction(&echo.direction);
        let point = lidar.origin + direction * lidar.true_m(echo.range_m, echo.ring);
        let blade = self.posed.at(self.time_ns(echo.lidar, echo.time_ns));
        let mesh = &self.adjustment.problem.mesh;
        let Some(near) = blade.near(mesh, &point, &direction) else {
            self.tally.missed += 1;
            return;
        };
        let (gate_m, sigma_m) = (self.gates.echo_m, self.gates.coarse_m()[0]);
        let variance = sigma_m * sigma_m * alike;
        self.echo_bill
            .add(near.off_m, sigma_m, gate_m, variance, 1.0);
        if self.only_costs {
            return;
        }
        let cosine = -near.contact.normal.dot(&direction);
        let met = self.met(echo, &near.contact, near.off_m, point, cosine);
        if near.off_m.abs() > gate_m {
            self.tally.rejected.push(met);
        } else {
            self.tally.used.push(met);
            self.add_near(echo, &near, sigma_m, variance);
        }
    }

    fn add_near(&mut self, echo: &Echo, near: &Near, sigma_m: f64, variance: f64) {
        let weight = robust(near.off_m, sigma_m, self.gates.echo_m) / variance;
        let time_ns = self.time_ns(echo.lidar, echo.time_ns);
        let moves = self.fill_row(&near.contact, &near.towards, echo.lidar, time_ns);
        self.fill_surface(&near.contact, &near.towards);
        self.add_row(&near.contact, (&near.towards, moves), near.off_m, weight);
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    const WIDE: Gates = Gates {
        echo_m: 3.0,
        edge_m: 2.0,
        stage: Stage::Loads,
    };

    /// The sample with loads that are off by some standard deviations.
    fn elsewhere() -> Adjustment {
        let mut adjustment = sample::adjustment(0.0);
        let first = adjustment.layout.own_at(0);
        for (unknown, change) in [(first, 0.9), (first + 1, -4.0), (first + 5, 3.0)] {
            adjustment.shift(unknown, change);
        }
        adjustment.linearise().unwrap();
        adjustment
    }

    #[test]
    fn a_blade_whose_rays_mostly_miss_is_found() {
        let (truth, mut adjustment) = (sample::adjustment(0.0), elsewhere());
        let far_m = adjustment.moved_m(&truth.axes());
        assert!(far_m > 0.5, "{far_m}");
        for _ in 0..6 {
            adjustment.step(&WIDE).unwrap();
        }
        let left_m = adjustment.moved_m(&truth.axes());
        assert!(left_m < 0.05, "{left_m} of {far_m}");
    }

    #[test]
    fn no_step_costs_more() {
        let mut adjustment = elsewhere();
        let mut last = f64::INFINITY;
        for _ in 0..6 {
            let tallies = adjustment.step(&WIDE).unwrap().tallies;
            let cost: f64 = tallies.iter().map(|tally| tally.cost).sum();
            assert!(cost < last + 1e-3, "{cost} after {last}");
            last = cost;
        }
    }
}
