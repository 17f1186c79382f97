//! How a blade without a drawing is measured: in steps that have to do good, held back as far as the last
//! ones had to be (Levenberg and Marquardt).
//!
//! Its surface is learned with its place, and what slopes promise of both together holds nearby only.

use nalgebra::DVector;

use super::adjust::{Adjustment, Gates};
use super::normal::Normal;
use super::step::Step;
use crate::error::BeamError;

/// What the surface differs by from one that was learned, patch by patch, metres: near both edges, where no
/// wave stands, and between knots residuals do not tell it.
const UNKNOWN_M: f64 = 0.004;
/// A step that does no good is held back more by this factor, at most so often ...
const GROWS: (f64, usize) = (10.0, 8);
/// ... and the next one less by this factor where it does.
const SHRINKS: f64 = 0.3;

/// How far steps are held back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Caution {
    /// Inverse variance by which unknowns of the blade and its surface are held where they are, in units of
    /// what was known before.
    held: f64,
    /// Gate at which it was learned, metres.
    gate_m: f64,
}

impl Caution {
    const LEAST: f64 = 1e-3;

    /// At a gate at which no step was taken yet.
    pub(super) fn new(gate_m: f64) -> Self {
        Self { held: 1.0, gate_m }
    }
}

impl Adjustment {
    /// One step to where the data cost less; none where no step leads there.
    pub(super) fn descend(&mut self, gates: &Gates) -> Result<Step, BeamError> {
        if self.caution.gate_m != gates.echo_m {
            self.caution = Caution::new(gates.echo_m);
        }
        let (normal, tallies) = self.normal(gates);
        let (from, before) = (self.axes(), self.cost(gates, &tallies));
        let largest = self.go_cautiously(&normal, gates, before)?;
        let moved_m = self.moved_m(&from);
        if gates.is_fine() {
            self.weights.learn(&tallies);
            self.weights.surface_m = self.weights.surface_m.max(UNKNOWN_M);
        }
        Ok(Step {
            largest,
            moved_m,
            tallies,
        })
    }

    /// Goes a step that costs less than `before`; its largest change of an unknown of the blade.
    fn go_cautiously(
        &mut self,
        normal: &Normal,
        gates: &Gates,
        before: f64,
    ) -> Result<f64, BeamError> {
        for _ in 0..GROWS.1 {
            let (step, largest) = self.cautious(normal)?;
            if self.is_better(&step, gates, before) {
                self.caution.held = (self.caution.held * SHRINKS).max(Caution::LEAST);
                return Ok(largest);
            }
            self.caution.held *= GROWS.0;
        }
        Ok(0.0)
    }

    /// What the data ask for while unknowns are held back.
    fn cautious(&self, normal: &Normal) -> Result<(DVector<f64>, f64), BeamError> {
        let mut normal = normal.clone();
        let rig = self.layout.lidar_at(0)..self.layout.shape_at();
        for (place, unknown) in self.free.clone().enumerate() {
            if !rig.contains(&unknown) {
                normal.matrix[(place, place)] += self.caution.held;
            }
        }
        self.solved(normal)
    }
}

#[cfg(test)]
mod tests {
    use super::super::adjust::Stage;
    use super::super::sample;
    use super::*;

    fn gates(echo_m: f64, stage: Stage) -> Gates {
        Gates {
            echo_m,
            edge_m: echo_m,
            stage,
        }
    }

    /// The sample with another chord, contour and load.
    fn elsewhere() -> Adjustment {
        let mut adjustment = sample::undrawn();
        let (shape, own) = (adjustment.layout.shape_at(), adjustment.layout.own_at(0));
        for (unknown, change) in [(shape, 0.5), (shape + 4, -0.4), (own, 0.8)] {
            adjustment.shift(unknown, change);
        }
        adjustment.linearise().unwrap();
        adjustment
    }

    #[test]
    fn a_surface_is_learned_with_its_place_and_no_step_costs_more() {
        let (truth, mut adjustment) = (sample::undrawn(), elsewhere());
        let first_m = adjustment.moved_m(&truth.axes());
        for gates in [gates(0.3, Stage::Surface), gates(0.1, Stage::Surface)] {
            let mut last = f64::INFINITY;
            for _ in 0..8 {
                let tallies = adjustment.descend(&gates).unwrap().tallies;
                let cost = adjustment.cost(&gates, &tallies);
                // What was known before is told of the end of a step, the data of its start.
                assert!(cost < last * (1.0 + 1e-6), "{cost} after {last}");
                last = cost;
            }
        }
        let chord = |of: &Adjustment| of.problem.mesh.chord_m[of.problem.mesh.node_at(48.0)];
        assert!((chord(&adjustment) / chord(&truth) - 1.0).abs() < 0.02);
        let left_m = adjustment.moved_m(&truth.axes());
        assert!(left_m < 0.5 * first_m, "{left_m} of {first_m}");
    }
}
