//! Normal equations of all holds, and their solution.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

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
            matrix: DMatrix::zeros(asked.len(), free.len()),
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
        self.cost += part.own[(0, 0)];
        self.rows += part.rows;
    }

    /// Others rise, and those that follow each other lie together here and there.
    fn join_others(&mut self, part: &Part) {
        let start = self.asked.start;
        for (place, unknown) in part.others.iter().enumerate() {
            self.right[unknown - start] += part.own[(place + 1, 0)];
        }
        let follow = |a: &usize, b: &usize| a + 1 == *b;
        let runs: Vec<&[usize]> = part.others.chunk_by(follow).collect();
        let columns = part.own.ncols() - 1;
        for (j, unknown) in part.others.iter().take(columns).enumerate() {
            let of_column = part.own.column(j + 1);
            let mut sums = &of_column.as_slice()[1..];
            let mut column = self.matrix.column_mut(unknown - self.free.start);
            let column = column.as_mut_slice();
            for run in &runs {
                let (of_run, behind) = sums.split_at(run.len());
                sums = behind;
                // What lies above the diagonal is not summed.
                let skipped = unknown.saturating_sub(run[0]).min(run.len());
                let sum = column[run[0] - start..].iter_mut().zip(of_run);
                sum.skip(skipped).for_each(|(sum, more)| *sum += more);
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
