//! Normal equations of all holds, and their solution.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::blank::blank;
use super::factor::Factor;
use super::sums::Part;

/// Sums of weighted rows: only the lower triangle of the matrix is kept.
#[derive(Debug, Clone)]
pub struct Normal {
    /// Sum of row^T weight row: a row for each unknown that is asked for, a column for each that is solved for; of
    /// the latter with each other the lower triangle.
    pub matrix: DMatrix<f64>,
    /// Sum of row^T weight residual.
    pub right: DVector<f64>,
    /// Weighted sum of squared residuals.
    pub cost: f64,
    /// Rows.
    pub rows: usize,
    /// Which unknowns are asked for.
    pub asked: Range<usize>,
    /// Which of them are solved for; the others stay as they are.
    pub free: Range<usize>,
}

impl Normal {
    /// Of some of the unknowns, without any row.
    pub fn new(asked: &Range<usize>, free: &Range<usize>) -> Self {
        Self {
            matrix: blank(asked.len(), free.len()),
            right: DVector::zeros(asked.len()),
            cost: 0.0,
            rows: 0,
            asked: asked.clone(),
            free: free.clone(),
        }
    }

    /// Adds the rows of one hold.
    pub fn join(&mut self, part: &Part) {
        for (j, unknown) in part.state.iter().enumerate() {
            self.right[unknown - self.asked.start] += part.crossed[(0, j)];
            for (i, other) in part.state.iter().enumerate().skip(j) {
                self.add(*unknown, *other, part.states[(i, j)]);
            }
            let crossed = part.crossed.column(j);
            for (other, sum) in part.others.iter().zip(crossed.iter().skip(1)) {
                self.add(*unknown, *other, *sum);
            }
        }
        self.join_others(part);
        self.rows += part.rows;
    }

    fn join_others(&mut self, part: &Part) {
        let start = self.asked.start;
        for (place, sum) in part.own.column(0) {
            match place.checked_sub(1) {
                Some(other) => self.right[part.others[other] - start] += sum,
                None => self.cost += sum,
            }
        }
        for (j, unknown) in part.others.iter().take(part.own.len() - 1).enumerate() {
            let mut column = self.matrix.column_mut(unknown - self.free.start);
            let column = column.as_mut_slice();
            for (place, sum) in part.own.column(j + 1) {
                column[part.others[place - 1] - start] += sum;
            }
        }
    }

    /// Adds a product of two unknowns where it is asked for.
    fn add(&mut self, one: usize, two: usize, sum: f64) {
        let (low, high) = (one.min(two), one.max(two));
        let (row, column) = match self.free.contains(&low) {
            true => (high, low),
            false => (low, high),
        };
        if self.free.contains(&column) {
            self.matrix[(row - self.asked.start, column - self.free.start)] += sum;
        }
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
