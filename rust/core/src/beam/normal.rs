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
    runs: Runs,
}

/// One row as stretches of neighbouring unknowns, so that sums over it are sums of vectors.
#[derive(Debug, Clone, Default)]
struct Runs {
    slopes: Vec<f64>,
    runs: Vec<Run>,
}

/// Neighbouring unknowns, none twice.
#[derive(Debug, Clone)]
struct Run {
    first: usize,
    places: Range<usize>, // among the slopes
}

impl Runs {
    fn read(&mut self, row: &[(usize, f64)], start: usize) {
        self.slopes.clear();
        self.slopes.extend(row.iter().map(|entry| entry.1));
        self.runs.clear();
        for (place, (unknown, _)) in row.iter().enumerate() {
            let unknown = unknown - start;
            match self.runs.last_mut() {
                Some(run) if run.first + run.places.len() == unknown => run.places.end += 1,
                _ => self.runs.push(Run {
                    first: unknown,
                    places: place..place + 1,
                }),
            }
        }
    }

    /// Adds `scaled` times the row, from `place` in run `number` on, to a column.
    fn add(&self, number: usize, place: usize, scaled: f64, column: &mut [f64]) {
        let mut skipped = place - self.runs[number].places.start;
        for run in &self.runs[number..] {
            let slopes = &self.slopes[run.places.start + skipped..run.places.end];
            let sums = &mut column[run.first + skipped..][..slopes.len()];
            for (sum, slope) in sums.iter_mut().zip(slopes) {
                *sum += scaled * slope;
            }
            skipped = 0;
        }
    }
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
            runs: Runs::default(),
        }
    }

    /// Adds one row: entries `(unknown, slope)`, residual and weight.
    pub fn add(&mut self, row: &mut [(usize, f64)], residual: f64, weight: f64) {
        row.sort_unstable_by_key(|entry| entry.0);
        let first = row.partition_point(|entry| entry.0 < self.free.start);
        let last = row.partition_point(|entry| entry.0 < self.free.end);
        self.runs.read(&row[first..last], self.free.start);
        let count = self.matrix.nrows();
        let values = self.matrix.as_mut_slice();
        for (number, run) in self.runs.runs.iter().enumerate() {
            for (place, column) in run.places.clone().zip(run.first..) {
                let scaled = weight * self.runs.slopes[place];
                let below = &mut values[column * count..(column + 1) * count];
                self.runs.add(number, place, scaled, below);
                self.right[column] += scaled * residual;
            }
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
