//! How an adjustment goes from one estimate to the next.

use nalgebra::DVector;

use super::adjust::{Adjustment, Gates, Stage};
use super::normal::Normal;
use super::weights::Tally;
use crate::error::BeamError;

/// Largest step of an unknown, standard deviations: farther away the neighbours are not linear.
const LARGEST_STEP: f64 = 3.0;
/// The same where deviations are those of blades in general.
const LARGEST_VAGUE_STEP: f64 = 0.3;
/// Gate from which on residuals tell of the data, not of a blade that is elsewhere, metres.
const LEARNED_M: f64 = 0.1;
/// Gate at which steps are held back as a prior would, metres.
const FREE_GATE_M: f64 = 0.025;
/// A step that takes back so much of the last one is halved: the truth lies between both.
const TURNED_BACK: f64 = 0.5;
/// The same of the surface, whose unknowns are many and each of little effect.
const LARGEST_WAVE: f64 = 6.0;

/// What one iteration did.
#[derive(Debug, Clone)]
pub struct Step {
    /// Largest change of an unknown of the blade, standard deviations.
    pub largest: f64,
    /// What became of the data, by hold.
    pub tallies: Vec<Tally>,
}

impl Adjustment {
    /// One step of Gauss and Newton with data inside of the gates.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn step(&mut self, gates: &Gates) -> Result<Step, BeamError> {
        let (mut normal, tallies) = self.normal(gates);
        self.damp(&mut normal, gates);
        let (part, _) = normal.solve().ok_or(BeamError::Singular)?;
        let mut step = DVector::zeros(self.layout.len());
        step.rows_mut(self.free.start, self.free.len())
            .copy_from(&part);
        let (rig, count) = (self.layout.lidar_at(0), self.layout.rig_len());
        let largest = step.rows(0, self.layout.sway_at(0)).amax();
        let swollen = step.rows(self.layout.shape_at(), self.layout.shape).amax();
        let excess = (largest / self.largest_step(gates.stage)).max(swollen / LARGEST_WAVE);
        if excess > 1.0 {
            step /= excess;
        }
        if self.is_vague() {
            self.settle(&mut step);
        }
        self.values += &step;
        self.rig.values += step.rows(rig, count);
        self.values.rows_mut(rig, count).fill(0.0);
        if self.free.contains(&self.layout.shape_at()) {
            self.build();
        }
        if gates.stage == Stage::All {
            self.weights.learn(&tallies, gates.echo_m <= LEARNED_M);
        }
        Ok(Step { largest, tallies })
    }

    /// Halves a step that takes the last one back.
    fn settle(&mut self, step: &mut DVector<f64>) {
        if step.dot(&self.last_step) < -TURNED_BACK * self.last_step.norm_squared() {
            *step *= 0.5;
        }
        self.last_step.copy_from(step);
    }

    /// Holds back, while gates are wide, what a blade without a drawing could do far from where it is.
    fn damp(&self, normal: &mut Normal, gates: &Gates) {
        if !self.is_vague() || gates.stage != Stage::All {
            return;
        }
        let rig = self.layout.lidar_at(0)..self.layout.shape_at();
        let damping = (gates.echo_m / FREE_GATE_M).powi(2);
        for (place, unknown) in self.free.clone().enumerate() {
            if !rig.contains(&unknown) {
                normal.matrix[(place, place)] += damping;
            }
        }
    }

    /// How far an unknown of the blade may go in one step, standard deviations.
    fn largest_step(&self, stage: Stage) -> f64 {
        if self.is_vague() && stage == Stage::All {
            LARGEST_VAGUE_STEP
        } else {
            LARGEST_STEP
        }
    }
}
