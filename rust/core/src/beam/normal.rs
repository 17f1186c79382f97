//! Normal equations of sparse rows, and their solution.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

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

    /// Adds one row: entries `(unknown, slope)`, residual and weight.
    pub fn add(&mut self, row: &mut [(usize, f64)], residual: f64, weight: f64) {
        row.sort_unstable_by_key(|entry| entry.0);
        let first = row.partition_point(|entry| entry.0 < self.free.start);
        let last = row.partition_point(|entry| entry.0 < self.free.end);
        let (row, start) = (&row[first..last], self.free.start);
        let count = self.matrix.nrows();
        let values = self.matrix.as_mut_slice();
        for (place, (column, slope)) in row.iter().enumerate() {
            let (column, scaled) = (column - start, weight * slope);
            let column_values = &mut values[column * count..(column + 1) * count];
            for (unknown, other) in &row[place..] {
                column_values[*unknown - start] += scaled * other;
            }
            self.right[column] += scaled * residual;
        }
        self.cost += weight * residual * residual;
        self.rows += 1;
    }

    /// Adds the rows of another sum.
    pub fn join(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.right += &other.right;
        self.cost += other.cost;
        self.rows += other.rows;
    }

    /// Step and covariance; `None` where the matrix is singular.
    pub fn solve(mut self) -> Option<(DVector<f64>, nalgebra::Cholesky<f64, nalgebra::Dyn>)> {
        self.matrix.fill_upper_triangle_with_lower_triangle();
        let factor = self.matrix.cholesky()?;
        let step = factor.solve(&self.right);
        step.iter()
            .all(|value| value.is_finite())
            .then_some((step, factor))
    }
}
