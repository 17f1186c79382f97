//! Normal equations of all holds, and their solution.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::factor::Factor;
use super::sums::Part;

/// Sums of weighted rows: only the lower triangle of the matrix is kept.
#[derive(Debug, Clone)]
pub struct Normal {
    /// Sum of row^T weight row, lower triangle.
    pub matrix: DMatrix<f64>,
    /// Sum of row^T weight residual.
    pub right: DVector<f64>,
    /// Weighted sum of squared residuals.
    pub cost: f64,
    /// Rows.
    pub rows: usize,
    /// Which unknowns are solved for; the others stay as they are.
    pub free: Range<usize>,
}

impl Normal {
    /// Of some of the unknowns, without any row.
    pub fn new(free: Range<usize>) -> Self {
        Self {
            matrix: DMatrix::zeros(free.len(), free.len()),
            right: DVector::zeros(free.len()),
            cost: 0.0,
            rows: 0,
            free,
        }
    }

    /// Adds the rows of one hold.
    pub fn join(&mut self, part: &Part) {
        let at = |place: usize| part.unknowns[place] - self.free.start;
        for (j, column) in part.matrix.column_iter().enumerate() {
            let one = at(j);
            self.right[one] += part.right[j];
            for (i, sum) in column.iter().enumerate().skip(j) {
                let two = at(i);
                self.matrix[(one.max(two), one.min(two))] += sum;
            }
        }
        self.cost += part.cost;
        self.rows += part.rows;
    }

    /// Step and factor; `None` where the matrix is singular.
    pub fn solve(self) -> Option<(DVector<f64>, Factor)> {
        let factor = Factor::new(self.matrix)?;
        let step = factor.solve(&self.right);
        step.iter()
            .all(|value| value.is_finite())
            .then_some((step, factor))
    }
}
