//! Normal equations of sparse rows, and their solution.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::simd::{Kernel, vectorized};

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
    batch: Batch,
}

/// Rows that are added at once.
const ROWS: usize = 8;

/// Rows with slopes by the same unknowns: neighbours on a scan line differ in their numbers only. Added
/// together they pass over the matrix once; every sum takes them in their order, as if one by one.
#[derive(Debug, Clone, Default)]
struct Batch {
    runs: Vec<Run>,
    /// Row after row.
    slopes: Vec<f64>,
    weights: Vec<f64>,
    residuals: Vec<f64>,
}

/// Neighbouring unknowns, none twice.
#[derive(Debug, Clone, PartialEq)]
struct Run {
    first: usize,
    places: Range<usize>, // among the slopes of a row
}

/// Neighbouring entries of a row whose unknowns follow each other, counted from `start`.
fn runs(row: &[(usize, f64)], start: usize) -> impl Iterator<Item = Run> + '_ {
    let mut from = 0;
    let chunks = row.chunk_by(|a, b| a.0 + 1 == b.0);
    chunks.map(move |chunk| {
        let places = from..from + chunk.len();
        from = places.end;
        Run {
            first: chunk[0].0 - start,
            places,
        }
    })
}

impl Batch {
    /// Whether a row of these runs can be added.
    fn takes(&self, row: &[(usize, f64)], start: usize) -> bool {
        self.weights.len() < ROWS && self.runs.iter().cloned().eq(runs(row, start))
    }

    fn begin(&mut self, row: &[(usize, f64)], start: usize) {
        self.runs.clear();
        self.runs.extend(runs(row, start));
        self.slopes.clear();
        self.weights.clear();
        self.residuals.clear();
    }

    fn push(&mut self, row: &[(usize, f64)], residual: f64, weight: f64) {
        self.slopes.extend(row.iter().map(|entry| entry.1));
        self.weights.push(weight);
        self.residuals.push(residual);
    }

    fn add_to(&self, matrix: &mut DMatrix<f64>, right: &mut DVector<f64>) {
        let mut from = 0;
        for rows in [8, 4, 2, 1] {
            while self.weights.len() - from >= rows {
                let (matrix, right) = (&mut *matrix, &mut *right);
                match rows {
                    8 => self.add_some::<8>(from, matrix, right),
                    4 => self.add_some::<4>(from, matrix, right),
                    2 => self.add_some::<2>(from, matrix, right),
                    _ => self.add_some::<1>(from, matrix, right),
                }
                from += rows;
            }
        }
    }

    fn add_some<const N: usize>(
        &self,
        from: usize,
        matrix: &mut DMatrix<f64>,
        right: &mut DVector<f64>,
    ) {
        let width = self.slopes.len() / self.weights.len();
        vectorized(Sum::<N> {
            runs: &self.runs,
            slopes: std::array::from_fn(|k| &self.slopes[(from + k) * width..][..width]),
            weights: std::array::from_fn(|k| self.weights[from + k]),
            residuals: std::array::from_fn(|k| self.residuals[from + k]),
            count: matrix.nrows(),
            matrix: matrix.as_mut_slice(),
            right: right.as_mut_slice(),
        });
    }
}

/// `N` rows on their way into the sums.
struct Sum<'a, const N: usize> {
    runs: &'a [Run],
    slopes: [&'a [f64]; N],
    weights: [f64; N],
    residuals: [f64; N],
    matrix: &'a mut [f64],
    right: &'a mut [f64],
    count: usize,
}

impl<const N: usize> Kernel for Sum<'_, N> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let count = self.count;
        for (number, run) in self.runs.iter().enumerate() {
            for (place, column) in run.places.clone().zip(run.first..) {
                let scaled: [f64; N] =
                    std::array::from_fn(|k| self.weights[k] * self.slopes[k][place]);
                let below = &mut self.matrix[column * count..(column + 1) * count];
                let mut skipped = place - run.places.start;
                for run in &self.runs[number..] {
                    let places = run.places.start + skipped..run.places.end;
                    let slopes = self.slopes.map(|slopes| &slopes[places.clone()]);
                    let sums = &mut below[run.first + skipped..][..places.len()];
                    add(sums, &slopes, &scaled);
                    skipped = 0;
                }
                for k in 0..N {
                    self.right[column] += scaled[k] * self.residuals[k];
                }
            }
        }
    }
}

/// Adds rows, each `scaled`, to sums: to every sum in the order of the rows.
#[inline(always)]
fn add<const N: usize>(sums: &mut [f64], slopes: &[&[f64]; N], scaled: &[f64; N]) {
    let count = sums.len();
    let slopes = slopes.map(|slopes| &slopes[..count]);
    for i in 0..count {
        let mut sum = sums[i];
        for k in 0..N {
            sum += scaled[k] * slopes[k][i];
        }
        sums[i] = sum;
    }
}

/// Sorts a row by unknown; most of it is in order already.
fn sort(row: &mut [(usize, f64)]) {
    let in_order = row.windows(2).take_while(|w| w[0].0 < w[1].0).count() + 1;
    let Some((head, tail)) = row.split_at_mut_checked(in_order) else {
        return;
    };
    tail.sort_unstable_by_key(|entry| entry.0);
    if tail
        .first()
        .zip(head.last())
        .is_some_and(|(next, last)| next.0 < last.0)
    {
        row.sort_unstable_by_key(|entry| entry.0);
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
            batch: Batch::default(),
        }
    }

    /// Adds one row: entries `(unknown, slope)`, residual and weight. It is in the sums after
    /// [`Normal::flush`] at the latest.
    pub fn add(&mut self, row: &mut [(usize, f64)], residual: f64, weight: f64) {
        sort(row);
        let first = row.partition_point(|entry| entry.0 < self.free.start);
        let last = row.partition_point(|entry| entry.0 < self.free.end);
        let row = &row[first..last];
        if !self.batch.takes(row, self.free.start) {
            self.flush();
            self.batch.begin(row, self.free.start);
        }
        self.batch.push(row, residual, weight);
        self.cost += weight * residual * residual;
        self.rows += 1;
    }

    /// Brings the last rows into the sums.
    pub fn flush(&mut self) {
        self.batch.add_to(&mut self.matrix, &mut self.right);
        self.batch = Batch::default();
    }

    /// Adds the rows of another sum.
    pub fn join(&mut self, other: &Self) {
        self.flush();
        self.matrix += &other.matrix;
        self.right += &other.right;
        other.batch.add_to(&mut self.matrix, &mut self.right);
        self.cost += other.cost;
        self.rows += other.rows;
    }

    /// Step and covariance; `None` where the matrix is singular.
    pub fn solve(mut self) -> Option<(DVector<f64>, nalgebra::Cholesky<f64, nalgebra::Dyn>)> {
        self.flush();
        self.matrix.fill_upper_triangle_with_lower_triangle();
        let factor = self.matrix.cholesky()?;
        let step = factor.solve(&self.right);
        step.iter()
            .all(|value| value.is_finite())
            .then_some((step, factor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of few patterns, in no order within the row, some beyond what is free.
    fn rows() -> Vec<(Vec<(usize, f64)>, f64, f64)> {
        let wave = |k: usize| (k as f64 * 0.7).sin();
        let row = |k: usize| {
            let first = [3, 4, 17][k / 11 % 3];
            let mut row: Vec<_> = (0..9).map(|j| (j, wave(k + 3 * j))).collect();
            row.extend((0..5).map(|j| (first + 10 + j, wave(7 * k + j))));
            row.push((first + 8, wave(k)));
            (row, wave(5 * k), 1.0 + wave(k).abs())
        };
        (0..200).map(row).collect()
    }

    #[test]
    fn rows_added_together_give_the_bits_of_rows_added_one_by_one() {
        let free = 2..31;
        let (mut together, mut alone) = (Normal::new(free.clone()), Normal::new(free.clone()));
        let (mut matrix, mut right) = (DMatrix::zeros(29, 29), DVector::zeros(29));
        for (row, residual, weight) in rows() {
            together.add(&mut row.clone(), residual, weight);
            alone.add(&mut row.clone(), residual, weight);
            alone.flush();
            let inside = |entry: &&(usize, f64)| free.contains(&entry.0);
            for (j, slope) in row.iter().filter(inside) {
                right[j - 2] += weight * slope * residual;
                for (i, other) in row.iter().filter(inside).filter(|entry| entry.0 >= *j) {
                    matrix[(i - 2, j - 2)] += weight * slope * other;
                }
            }
        }
        together.flush();
        assert_eq!(
            (&together.matrix, &together.right),
            (&alone.matrix, &alone.right)
        );
        assert_eq!((together.matrix, together.right), (matrix, right));
    }
}
