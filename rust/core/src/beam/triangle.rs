//! Equations with a lower triangle for many right sides at once: eight side by side, each as it would be alone.

use nalgebra::{DMatrix, DMatrixViewMut};

use crate::simd::{Kernel, vectorized};

/// Right sides that are solved together.
const SIDES: usize = 8;

/// Puts the answer in the place of every right side, a column; `triangle` has no zero on its diagonal.
pub fn solve_lower(triangle: &DMatrix<f64>, sides: &mut DMatrixViewMut<'_, f64>) {
    let mut together = vec![[0.0; SIDES]; triangle.nrows()];
    for first in (0..sides.ncols()).step_by(SIDES) {
        let count = SIDES.min(sides.ncols() - first);
        for k in 0..count {
            let column = sides.column(first + k);
            let values = together.iter_mut().zip(column.iter());
            values.for_each(|(row, value)| row[k] = *value);
        }
        vectorized(Solve {
            triangle: triangle.as_slice(),
            sides: &mut together,
        });
        for k in 0..count {
            let mut column = sides.column_mut(first + k);
            let values = together.iter().zip(column.iter_mut());
            values.for_each(|(row, value)| *value = row[k]);
        }
    }
}

struct Solve<'a> {
    /// Column by column.
    triangle: &'a [f64],
    sides: &'a mut [[f64; SIDES]],
}

impl Kernel for Solve<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let columns = self.triangle.chunks_exact(self.sides.len());
        for (i, column) in columns.enumerate() {
            let (known, open) = self.sides.split_at_mut(i + 1);
            let answer = known[i].map(|value| value / column[i]);
            known[i] = answer;
            for (row, slope) in open.iter_mut().zip(&column[i + 1..]) {
                for (value, of) in row.iter_mut().zip(answer) {
                    *value += -of * slope;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_right_sides_have_the_answers_of_each_alone() {
        let number = |i: usize, j: usize| ((13 * i + 7 * j + 1) as f64 * 0.37).sin();
        let steep = |i, j| number(i, j) + if i == j { 3.0 } else { 0.0 };
        let triangle = DMatrix::from_fn(21, 21, steep);
        let mut sides = DMatrix::from_fn(30, 19, number);
        let mut expected = sides.rows(4, 21).into_owned();
        assert!(triangle.solve_lower_triangular_mut(&mut expected));
        solve_lower(&triangle, &mut sides.rows_mut(4, 21).as_view_mut());
        assert_eq!(sides.rows(4, 21).into_owned(), expected);
        assert_eq!(sides[(3, 5)], number(3, 5));
    }
}
