//! A positive matrix as the square of a triangle, block by block: products of blocks go at the speed of the
//! machine, single columns at that of its memory.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, DVector, Dyn, U1};
use rayon::prelude::*;

use super::blank::blank;
use super::triangle::solve_lower;

/// Rows and columns of a block.
const BLOCK: usize = 64;

/// The lower triangle whose square is the matrix.
#[derive(Debug, Clone)]
pub struct Factor {
    /// What stands above the diagonal means nothing.
    lower: DMatrix<f64>,
}

impl Factor {
    /// Of a matrix, of which only the lower triangle is read; `None` where it is not positive.
    pub fn new(mut matrix: DMatrix<f64>) -> Option<Self> {
        let size = matrix.nrows();
        for first in (0..size).step_by(BLOCK) {
            let width = BLOCK.min(size - first);
            let mut corner = matrix.view_mut((first, first), (width, width));
            let triangle = corner.clone_owned().cholesky()?.unpack();
            corner.copy_from(&triangle);
            let across = solved_across(&matrix, &triangle, (first, first + width));
            take_off(&mut matrix, &across, first);
        }
        Some(Self { lower: matrix })
    }

    /// The matrix' inverse times a vector.
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let mut answer = right.clone();
        self.lower.solve_lower_triangular_mut(&mut answer);
        self.lower.tr_solve_lower_triangular_mut(&mut answer);
        answer
    }

    /// The matrix' inverse.
    pub fn inverse(&self) -> DMatrix<f64> {
        self.inverse_of_first(self.lower.nrows())
    }

    /// The inverse of the first `size` rows and columns of the matrix.
    pub fn inverse_of_first(&self, size: usize) -> DMatrix<f64> {
        let root = self.inverse_root(size);
        let across = transposed(&root);
        let mut inverse = blank(size, size);
        let blocks = inverse.as_mut_slice().par_chunks_mut(BLOCK * size);
        blocks.enumerate().for_each(|(number, block)| {
            let (first, width) = (number * BLOCK, block.len() / size);
            let below = size - first;
            let mut block = DMatrixViewMut::from_slice(block, size, width);
            block.rows_mut(first, below).gemm(
                1.0,
                &across.view((first, first), (below, below)),
                &root.view((first, first), (below, width)),
                0.0,
            );
        });
        inverse.fill_upper_triangle_with_lower_triangle();
        inverse
    }

    /// Inverse of the triangle: blocks of its columns have nothing to do with each other.
    fn inverse_root(&self, size: usize) -> DMatrix<f64> {
        let mut root = blank(size, size);
        let blocks = root.as_mut_slice().par_chunks_mut(BLOCK * size);
        blocks.enumerate().for_each(|(number, block)| {
            let width = block.len() / size;
            let mut block = DMatrixViewMut::from_slice(block, size, width);
            self.fill_root(&mut block, number * BLOCK);
        });
        root
    }

    /// The columns of the inverse from `first` on.
    fn fill_root(&self, block: &mut DMatrixViewMut<'_, f64>, first: usize) {
        let (size, wide) = block.shape();
        block.view_mut((first, 0), (wide, wide)).fill_diagonal(1.0);
        for from in (first..size).step_by(BLOCK) {
            let width = BLOCK.min(size - from);
            let corner = self.lower.view((from, from), (width, width)).into_owned();
            let (above, mut below) = block.rows_range_pair_mut(first..from, from..from + width);
            let before = self.lower.view((from, first), (width, from - first));
            below.gemm(-1.0, &before, &above, 1.0);
            solve_lower(&corner, &mut below);
        }
    }
}

/// Rows of a matrix below a triangle on its diagonal, divided by it, as columns: from row `rest` on, right of column
/// `first`.
fn solved_across(
    matrix: &DMatrix<f64>,
    triangle: &DMatrix<f64>,
    (first, rest): (usize, usize),
) -> DMatrix<f64> {
    let (below, width) = (matrix.nrows() - rest, rest - first);
    let panel = matrix.view((rest, first), (below, width));
    let mut across = blank(width, below);
    let blocks = across.as_mut_slice().par_chunks_mut(BLOCK * width);
    blocks.enumerate().for_each(|(number, block)| {
        let wide = block.len() / width;
        let mut block = DMatrixViewMut::from_slice(block, width, wide);
        block.tr_copy_from(&panel.rows(number * BLOCK, wide));
        solve_lower(triangle, &mut block);
    });
    across
}

/// A square matrix with rows for columns, on all threads.
fn transposed(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let size = matrix.nrows();
    let mut across = blank(size, size);
    let blocks = across.as_mut_slice().par_chunks_mut(BLOCK * size.max(1));
    blocks.enumerate().for_each(|(number, block)| {
        let wide = block.len() / size;
        let mut block = DMatrixViewMut::from_slice(block, size, wide);
        block.tr_copy_from(&matrix.rows(number * BLOCK, wide));
    });
    across
}

/// Puts what is solved in the place of the rows below a triangle, and takes its square off all behind.
fn take_off(matrix: &mut DMatrix<f64>, across: &DMatrix<f64>, first: usize) {
    let (size, (width, below)) = (matrix.nrows(), across.shape());
    let rest = first + width;
    // Columns lie together in memory: those of a block are one thread's.
    let (panel, behind) = matrix.as_mut_slice().split_at_mut(rest * size);
    let panel = &mut panel[first * size..];
    panel
        .par_chunks_mut(size)
        .enumerate()
        .for_each(|(k, column)| {
            let solved = across.row(k);
            let entries = column[rest..].iter_mut().zip(solved.iter());
            entries.for_each(|(entry, solved)| *entry = *solved);
        });
    let (step, shape) = (Dyn(size), (Dyn(below), Dyn(width)));
    let down: DMatrixView<'_, f64> =
        DMatrixView::from_slice_with_strides_generic(&panel[rest..], shape.0, shape.1, U1, step);
    let behind = behind.par_chunks_mut(BLOCK * size);
    behind.enumerate().for_each(|(number, block)| {
        let (from, wide) = (number * BLOCK, block.len() / size);
        let mut block = DMatrixViewMut::from_slice(block, size, wide);
        let (left, right) = (down.rows(from, below - from), across.columns(from, wide));
        block
            .rows_mut(rest + from, below - from)
            .gemm(-1.0, &left, &right, 1.0);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positive, and no two entries alike.
    fn positive(size: usize) -> DMatrix<f64> {
        let root = DMatrix::from_fn(size, size, |i, j| ((i * size + j) as f64 * 0.7).sin());
        &root * root.transpose() + DMatrix::identity(size, size) * 5.0
    }

    #[test]
    fn what_is_solved_and_inverted_gives_the_matrix_back() {
        // Blocks that are whole, nearly, and with a few columns left.
        for size in [1, 5, 64, 65, 132, 150] {
            let matrix = positive(size);
            let mut half = matrix.clone();
            half.fill_upper_triangle(f64::NAN, 1);
            let factor = Factor::new(half).unwrap();
            let right = DVector::from_fn(size, |i, _| i as f64 - 70.0);
            assert!((&matrix * factor.solve(&right) - &right).amax() < 1e-8);
            for part in [size, size - size / 3] {
                let one = matrix.view((0, 0), (part, part)) * factor.inverse_of_first(part);
                let error = (one - DMatrix::identity(part, part)).amax();
                assert!(error < 1e-9, "{part} of {size}: {error}");
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_has_none() {
        let mut matrix = positive(150);
        matrix[(140, 140)] = -1.0;
        assert!(Factor::new(matrix).is_none());
    }
}
