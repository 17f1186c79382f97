//! Keeps the blade where slopes said a step would lead it.
//!
//! Loads and stiffness multiply: a step that changes both leads astray by their product, however well
//! the data know the shape. So the loads make up for it.

use nalgebra::{DMatrix, DVector, Vector3};

use super::adjust::Adjustment;
use super::axis::{Axis, Field};
use super::family::{self, Kind};
use crate::error::BeamError;

/// Deviation from the wanted shape that weighs as much as one standard deviation of a load: of a place,
/// metres, and of a rotation, rad.
const APART: (f64, f64) = (0.003, 0.002);
/// So often loads are moved.
const TIMES: usize = 2;

impl Adjustment {
    /// Solves the equilibria, with the loads that bring them to where the slopes have them.
    pub(super) fn linearise_kept(&mut self) -> Result<(), BeamError> {
        let wanted = self.axes();
        self.linearise()?;
        for _ in 0..TIMES {
            for (hold, wanted) in wanted.iter().enumerate() {
                self.make_up(hold, wanted).ok_or(BeamError::Singular)?;
            }
            self.linearise()?;
        }
        Ok(())
    }

    /// Moves the loads of a hold until its axis is as near to the wanted one as they can bring it.
    fn make_up(&mut self, hold: usize, wanted: &Axis) -> Option<()> {
        let loads = self.loads_of(hold);
        let first = self.layout.shared;
        let responses = self.responses(hold);
        let of_loads: Vec<_> = loads.iter().map(|k| responses[first + k].clone()).collect();
        let now = self.still(hold);
        let fields = family::fields(&self.problem.mesh, &now, &of_loads);
        let change = nearest(&fields, &apart(wanted, &now))?;
        let own = self.layout.own_at(hold);
        for (load, change) in loads.iter().zip(change.iter()) {
            self.values[own + load] += change;
        }
        Some(())
    }

    /// Which of the own unknowns of a hold are loads.
    fn loads_of(&self, hold: usize) -> Vec<usize> {
        let is_load = |kind| matches!(kind, Kind::Force { .. } | Kind::Couple { .. });
        let own = self.own[hold].iter().enumerate();
        own.filter(|(_, unknown)| is_load(unknown.kind))
            .map(|(k, _)| k)
            .collect()
    }
}

/// How far the first shape lies from the second, in the units of [`APART`]: rotation and place by node.
fn apart(wanted: &Axis, now: &Axis) -> Vec<f64> {
    let turns = wanted.turn.iter().zip(&now.turn).map(|(wanted, now)| {
        let spin = wanted * now.transpose();
        0.5 * Vector3::new(
            spin[(2, 1)] - spin[(1, 2)],
            spin[(0, 2)] - spin[(2, 0)],
            spin[(1, 0)] - spin[(0, 1)],
        )
    });
    let places = wanted.place.iter().zip(&now.place).map(|(a, b)| a - b);
    weighted(turns, places)
}

fn weighted(
    turns: impl Iterator<Item = Vector3<f64>>,
    places: impl Iterator<Item = Vector3<f64>>,
) -> Vec<f64> {
    let parts = turns
        .map(|t| t / APART.1)
        .chain(places.map(|p| p / APART.0));
    parts.flat_map(<[f64; 3]>::from).collect()
}

/// Amounts of the fields, in standard deviations, that come nearest to a deviation.
fn nearest(fields: &[Field], wanted: &[f64]) -> Option<DVector<f64>> {
    let column = |field: &Field| {
        let (turns, places) = (field.turn.iter().copied(), field.place.iter().copied());
        DVector::from_vec(weighted(turns, places))
    };
    let columns: Vec<_> = fields.iter().map(column).collect();
    let slopes = DMatrix::from_columns(&columns);
    let matrix = slopes.tr_mul(&slopes) + DMatrix::identity(fields.len(), fields.len());
    let right = slopes.tr_mul(&DVector::from_column_slice(wanted));
    Some(matrix.cholesky()?.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    /// The sample with a blade half as stiff and half the load, as the slopes have it.
    fn softer() -> Adjustment {
        let mut adjustment = sample::undrawn();
        let own = adjustment.layout.own_at(0);
        let flap = Kind::Soft { which: 1, mode: 0 };
        let soft = adjustment.shared.iter().position(|u| u.kind == flap);
        adjustment.values[soft.unwrap()] += 2.0;
        for load in [own, own + 4] {
            adjustment.values[load] -= 0.6;
        }
        adjustment
    }

    #[test]
    fn loads_keep_the_blade_where_slopes_lead() {
        let wanted = softer().axes();
        let astray_m = |solve: &dyn Fn(&mut Adjustment)| {
            let mut adjustment = softer();
            solve(&mut adjustment);
            wanted[0].farthest_m(&adjustment.still(0))
        };
        let alone_m = astray_m(&|adjustment| adjustment.linearise().unwrap());
        let kept_m = astray_m(&|adjustment| adjustment.linearise_kept().unwrap());
        assert!(alone_m > 0.02, "{alone_m}");
        assert!(kept_m < 0.1 * alone_m, "{kept_m} of {alone_m}");
    }
}
