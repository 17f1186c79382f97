//! A positive matrix as the square of a triangle, block by block: products of blocks go at the speed of the
//! machine, single columns at that of its memory.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, DVector, Dyn};
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
            let (rest, below) = (first + width, size - first - width);
            let mut across = matrix.view((rest, first), (below, width)).transpose();
            let blocks = across.as_mut_slice().par_chunks_mut(BLOCK * width);
            blocks.for_each(|block| {
                let wide = block.len() / width;
                let mut block = DMatrixViewMut::from_slice(block, width, wide);
                solve_lower(&triangle, &mut block);
            });
            let down = across.transpose();
            matrix
                .view_mut((rest, first), (below, width))
                .copy_from(&down);
            // Columns of a block lie together in memory: each block is one thread's.
            let behind = matrix.as_mut_slice()[rest * size..].par_chunks_mut(BLOCK * size);
            behind.enumerate().for_each(|(number, block)| {
                let (from, wide) = (number * BLOCK, block.len() / size);
                let mut block = DMatrixViewMut::from_slice(block, size, wide);
                let (left, right) = (down.rows(from, below - from), across.columns(from, wide));
                block
                    .rows_mut(rest + from, below - from)
                    .gemm(-1.0, &left, &right, 1.0);
            });
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
        let across: DMatrixView<'_, f64, Dyn, Dyn> = DMatrixView::from_slice_with_strides_generic(
            root.as_slice(),
            Dyn(size),
            Dyn(size),
            Dyn(size),
            Dyn(1),
        );
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

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 150;

    /// Positive, and no two entries alike.
    fn positive() -> DMatrix<f64> {
        let root = DMatrix::from_fn(SIZE, SIZE, |i, j| ((i * SIZE + j) as f64 * 0.7).sin());
        &root * root.transpose() + DMatrix::identity(SIZE, SIZE) * 5.0
    }

    #[test]
    fn what_is_solved_and_inverted_gives_the_matrix_back() {
        let matrix = positive();
        let mut half = matrix.clone();
        half.fill_upper_triangle(f64::NAN, 1);
        let factor = Factor::new(half).unwrap();
        let right = DVector::from_fn(SIZE, |i, _| i as f64 - 70.0);
        assert!((&matrix * factor.solve(&right) - &right).amax() < 1e-8);
        let one = &matrix * factor.inverse();
        assert!((one - DMatrix::identity(SIZE, SIZE)).amax() < 1e-9);
        let part = matrix.view((0, 0), (70, 70)) * factor.inverse_of_first(70);
        assert!((part - DMatrix::identity(70, 70)).amax() < 1e-9);
    }

    #[test]
    fn a_matrix_that_is_not_positive_has_none() {
        let mut matrix = positive();
        matrix[(140, 140)] = -1.0;
        assert!(Factor::new(matrix).is_none());
    }
}
