//! Matrices of zeros that cost nothing where nobody touches them.

use nalgebra::DMatrix;

/// Zeros as the system gives them: pages come when they are touched, and of large matrices many are not.
pub fn blank(rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_vec(rows, columns, vec![0.0; rows * columns])
}
