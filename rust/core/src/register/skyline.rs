//! Symmetric positive definite matrices whose rows reach back only a little: envelope Cholesky.
//!
//! Neighbouring nodes of a grid are neighbours in the matrix, so all fill stays between the first
//! entry of a row and its diagonal.

/// Lower half of a symmetric matrix, each row from its first entry to the diagonal.
#[derive(Debug, Clone, PartialEq)]
pub struct Skyline {
    first: Vec<usize>,
    start: Vec<usize>,
    values: Vec<f64>,
}

impl Skyline {
    /// A zero matrix in which row i begins at column `first[i]` <= i.
    pub fn new(first: Vec<usize>) -> Self {
        let mut start = Vec::with_capacity(first.len());
        let mut length = 0;
        for (row, column) in first.iter().enumerate() {
            debug_assert!(*column <= row);
            start.push(length);
            length += row + 1 - column;
        }
        Self {
            first,
            start,
            values: vec![0.0; length],
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// Adds to the entry (i, j) and its mirror; the entry must lie within the envelope.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (row, column) = if i < j { (j, i) } else { (i, j) };
        self.values[self.start[row] + column - self.first[row]] += value;
    }

    fn row(&self, row: usize) -> &[f64] {
        let length = row + 1 - self.first[row];
        &self.values[self.start[row]..self.start[row] + length]
    }

    /// Its lower triangular factor; None where the matrix is not positive definite.
    pub fn factor(mut self) -> Option<Factor> {
        for row in 0..self.len() {
            self.eliminate(row)?;
        }
        Some(Factor(self))
    }

    fn eliminate(&mut self, row: usize) -> Option<()> {
        let (first, start) = (self.first[row], self.start[row]);
        let (above, current) = self.values.split_at_mut(start);
        for column in first..row {
            let other = self.first[column];
            let from = first.max(other);
            let done = &current[from - first..column - first];
            let pivot = self.start[column] + column - other;
            let earlier = &above[self.start[column] + from - other..pivot];
            current[column - first] = (current[column - first] - dot(done, earlier)) / above[pivot];
        }
        let behind = &current[..row - first];
        let pivot = current[row - first] - dot(behind, behind);
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        current[row - first] = pivot.sqrt();
        Some(())
    }
}

/// Sum of products in four lanes, in an order that does not depend on the machine.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    for (x, y) in a4.iter().zip(b4) {
        for k in 0..4 {
            lanes[k] += x[k] * y[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

/// L of A = L L^T.
#[derive(Debug, Clone)]
pub struct Factor(Skyline);

impl Factor {
    /// Replaces `right` (rows x `width`, row after row) by L^-1 `right`.
    pub fn forward(&self, right: &mut [f64], width: usize) {
        for row in 0..self.0.len() {
            let (done, rest) = right.split_at_mut(row * width);
            let current = &mut rest[..width];
            let (pivot, behind) = self.0.row(row).split_last().unwrap_or((&1.0, &[]));
            let solved = done[self.0.first[row] * width..].chunks_exact(width.max(1));
            for (weight, above) in behind.iter().zip(solved) {
                current
                    .iter_mut()
                    .zip(above)
                    .for_each(|(c, a)| *c -= weight * a);
            }
            current.iter_mut().for_each(|c| *c /= pivot);
        }
    }

    /// Replaces `right` by L^-T `right`.
    pub fn backward(&self, right: &mut [f64]) {
        for row in (0..self.0.len()).rev() {
            let (pivot, behind) = self.0.row(row).split_last().unwrap_or((&1.0, &[]));
            right[row] /= pivot;
            let value = right[row];
            let above = &mut right[self.0.first[row]..row];
            above
                .iter_mut()
                .zip(behind)
                .for_each(|(x, l)| *x -= l * value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A grid of 6 x 5 nodes whose neighbours pull at each other, rows of five.
    fn grid() -> (Skyline, DMatrix<f64>) {
        let n = 30;
        let first = (0..n).map(|i: usize| i.saturating_sub(5)).collect();
        let (mut sparse, mut dense) = (Skyline::new(first), DMatrix::zeros(n, n));
        let mut add = |i: usize, j: usize, v: f64| {
            sparse.add(i, j, v);
            dense[(i, j)] += v;
            if i != j {
                dense[(j, i)] += v;
            }
        };
        for i in 0..n {
            add(i, i, 4.1 + 0.01 * i as f64);
            if i % 5 > 0 {
                add(i - 1, i, -1.0);
            }
            if i >= 5 {
                add(i, i - 5, -1.0);
            }
        }
        (sparse, dense)
    }

    #[test]
    fn it_solves_as_a_dense_matrix_does() {
        let (sparse, dense) = grid();
        let right = DVector::from_fn(30, |i, _| (i as f64 * 0.7).sin());
        let expected = dense.cholesky().unwrap().solve(&right);
        let factor = sparse.factor().unwrap();
        let mut found = right.as_slice().to_vec();
        factor.forward(&mut found, 1);
        factor.backward(&mut found);
        assert!((DVector::from_vec(found) - expected).norm() < 1e-12);
    }

    #[test]
    fn several_right_sides_are_solved_at_once() {
        let (sparse, dense) = grid();
        let right = DMatrix::from_fn(30, 3, |i, j| ((i * 3 + j) as f64).cos());
        let lower = dense.cholesky().unwrap().l();
        let expected = lower.solve_lower_triangular(&right).unwrap();
        let mut found = right.transpose().as_slice().to_vec(); // row after row
        sparse.factor().unwrap().forward(&mut found, 3);
        assert!((DMatrix::from_row_slice(30, 3, &found) - expected).norm() < 1e-12);
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        let mut matrix = Skyline::new(vec![0, 0]);
        matrix.add(0, 0, 1.0);
        matrix.add(1, 0, 2.0);
        matrix.add(1, 1, 1.0);
        assert!(matrix.factor().is_none());
    }
}
