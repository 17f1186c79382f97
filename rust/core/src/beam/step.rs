//! How an adjustment goes from one estimate to the next.

use nalgebra::DVector;
use rayon::prelude::*;

use super::adjust::{Adjustment, Gates, Stage};
use super::axis::Axis;
use super::normal::Normal;
use super::weights::Tally;
use crate::error::BeamError;

/// Largest step of an unknown, standard deviations: farther away the neighbours are not linear.
const LARGEST_STEP: f64 = 3.0;
/// The same of the surface, whose unknowns are many and each of little effect.
const LARGEST_WAVE: f64 = 6.0;
/// A step that takes back so much of the last one is halved: the truth lies between both.
const TURNED_BACK: f64 = 0.5;
/// A step may lead so far from where the slopes say it leads, as a share of the gate: loads and stiffness
/// multiply, and what they do together no slope tells ...
const ASTRAY: f64 = 0.1;
/// ... so it is shortened, at most so often.
const SHORTENED: usize = 6;

/// What one iteration did.
#[derive(Debug, Clone)]
pub struct Step {
    /// Largest change of an unknown of the blade, standard deviations.
    pub largest: f64,
    /// Largest move of the axis in any hold, metres.
    pub moved_m: f64,
    /// What became of the data, by hold.
    pub tallies: Vec<Tally>,
}

impl Adjustment {
    /// One step of Gauss and Newton with data inside of the gates, no longer than it does good, and the
    /// equilibria where it leads.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn step(&mut self, gates: &Gates) -> Result<Step, BeamError> {
        if self.is_learned(gates) {
            return self.descend(gates);
        }
        if gates.is_search() {
            return self.seek(gates);
        }
        let step = self.take(gates, ASTRAY * gates.echo_m)?;
        // Without equilibria the slopes stay, and the next step comes back.
        let _ = self.linearise();
        Ok(step)
    }

    /// Whether the surface is learned with the blade.
    pub(super) fn is_learned(&self, gates: &Gates) -> bool {
        self.is_vague() && gates.stage >= Stage::Surface
    }

    /// Whether steps are judged by what data cost.
    pub(super) fn judges(&self, gates: &Gates) -> bool {
        !self.follows_load && (gates.is_search() || self.is_learned(gates))
    }

    /// The same where the slopes are the model: a stretch never solves its equilibrium anew.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub(super) fn slope_step(&mut self, gates: &Gates) -> Result<Step, BeamError> {
        self.take(gates, f64::INFINITY)
    }

    fn take(&mut self, gates: &Gates, astray_m: f64) -> Result<Step, BeamError> {
        let (mut step, largest, tallies) = self.wanted(gates)?;
        let moved_m = self.go(&mut step, astray_m);
        self.settle_in(&step);
        if gates.is_fine() {
            self.weights.learn(&tallies);
        }
        Ok(Step {
            largest,
            moved_m,
            tallies,
        })
    }

    /// What the data ask for, no longer than slopes can be good for; its largest change of an unknown of the
    /// blade before it was cut, and what became of the data.
    pub(super) fn wanted(
        &mut self,
        gates: &Gates,
    ) -> Result<(DVector<f64>, f64, Vec<Tally>), BeamError> {
        let (normal, tallies) = self.normal(gates);
        let (mut step, largest) = self.solved(normal)?;
        if gates.is_fine() {
            self.settle(&mut step);
        }
        Ok((step, largest, tallies))
    }

    /// The step that normal equations ask for, cut to where slopes are good for, and its largest change of an
    /// unknown of the blade before it was cut.
    pub(super) fn solved(&self, normal: Normal) -> Result<(DVector<f64>, f64), BeamError> {
        let (part, _) = normal.solve().ok_or(BeamError::Singular)?;
        let mut step = DVector::zeros(self.layout.len());
        step.rows_mut(self.free.start, self.free.len())
            .copy_from(&part);
        let largest = step.rows(0, self.layout.sway_at(0)).amax();
        let swollen = step.rows(self.layout.shape_at(), self.layout.shape).amax();
        let excess = (largest / LARGEST_STEP).max(swollen / LARGEST_WAVE);
        if excess > 1.0 {
            step /= excess;
        }
        Ok((step, largest))
    }

    /// Gives the lidars their part of a step that was gone, and the surface its shape.
    pub(super) fn settle_in(&mut self, step: &DVector<f64>) {
        let (rig, count) = (self.layout.lidar_at(0), self.layout.rig_len());
        self.rig.values += step.rows(rig, count);
        self.values.rows_mut(rig, count).fill(0.0);
        if self.free.contains(&self.layout.shape_at()) {
            self.build();
        }
    }

    /// The axes of all holds without sway.
    pub(super) fn axes(&self) -> Vec<Axis> {
        let holds = 0..self.problem.holds.len();
        holds.map(|hold| self.still(hold)).collect()
    }

    /// Largest move of the axis in any hold since it was at `from`, metres.
    pub(super) fn moved_m(&self, from: &[Axis]) -> f64 {
        let moved = |(hold, from): (usize, &Axis)| from.farthest_m(&self.still(hold));
        from.iter().enumerate().map(moved).fold(0.0, f64::max)
    }

    /// Goes a step, or as much of it as leads where the slopes say it leads; how far the axis moves.
    fn go(&mut self, step: &mut DVector<f64>, astray_m: f64) -> f64 {
        let from = self.axes();
        let start = self.values.clone();
        let tries = if astray_m.is_finite() { SHORTENED } else { 0 };
        for _ in 0..tries {
            self.values = &start + &*step;
            let far_m = self.astray_m();
            if far_m <= astray_m {
                break;
            }
            // What two unknowns do together grows with the square of the step.
            *step *= (astray_m / far_m).sqrt().clamp(0.2, 0.9);
        }
        self.values = start + &*step;
        self.moved_m(&from)
    }

    /// How far the equilibria lie from where the slopes have them, metres; infinite without one.
    fn astray_m(&self) -> f64 {
        let far_m = |hold: usize| {
            let thought = self.still(hold);
            let found = self
                .physics(hold)
                .solve(&self.problem.mesh, &thought.curvature);
            found.map_or(f64::INFINITY, |found| thought.farthest_m(&found))
        };
        let holds = (0..self.problem.holds.len()).into_par_iter();
        holds.map(far_m).reduce(|| 0.0, f64::max)
    }

    /// Halves a step that takes the last one back.
    fn settle(&mut self, step: &mut DVector<f64>) {
        if step.dot(&self.last_step) < -TURNED_BACK * self.last_step.norm_squared() {
            *step *= 0.5;
        }
        self.last_step.copy_from(step);
    }
}
