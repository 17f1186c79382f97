//! The normal equations at an estimate, solved once for all that is asked of it.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::adjust::{Adjustment, Gates};
use super::factor::Factor;
use crate::error::BeamError;

/// A strain is known beforehand no better than this.
const STRAIN: f64 = 0.1;

/// What the data at an estimate tell of all unknowns.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Within what they lay.
    pub gates: Gates,
    /// Covariance of all unknowns.
    pub(super) covariance: Arc<DMatrix<f64>>,
    /// Axial strain of each hold, fitted beside all else as if the blade did not keep its length: a
    /// check, for a blade stretches by less than a ten thousandth.
    pub strain: DVector<f64>,
    /// Their joint covariance.
    pub strain_covariance: DMatrix<f64>,
}

impl Adjustment {
    /// Solves the normal equations at the present estimate.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn solution(&self, gates: &Gates) -> Result<Solution, BeamError> {
        let (count, holds) = (self.layout.len(), self.problem.holds.len());
        let normal = self.with_strains().normal(gates).0;
        let factor = Factor::new(normal.matrix).ok_or(BeamError::Singular)?;
        let step = factor.solve(&normal.right);
        let mut spread = DMatrix::zeros(holds, holds);
        for hold in 0..holds {
            let mut pick = DVector::zeros(count + holds);
            pick[count + hold] = 1.0;
            let column = factor.solve(&pick);
            spread.set_column(hold, &column.rows(count, holds));
        }
        Ok(Solution {
            gates: *gates,
            covariance: Arc::new(factor.inverse_of_first(count)),
            strain: step.rows(count, holds).into_owned(),
            strain_covariance: spread,
        })
    }

    /// The same with an axial strain of each hold behind all unknowns.
    fn with_strains(&self) -> Self {
        let (count, holds) = (self.layout.len(), self.problem.holds.len());
        let mut wide = self.clone();
        wide.solve_for(0..count + holds);
        let longer =
            |values: &DVector<f64>, value| values.clone().resize_vertically(count + holds, value);
        wide.values = longer(&self.values, 0.0);
        wide.expected = longer(&self.expected, 0.0);
        wide.tightness = longer(&self.tightness, 1.0 / (STRAIN * STRAIN));
        wide
    }
}
