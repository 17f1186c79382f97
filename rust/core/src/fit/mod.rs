//! Shapes through points by least squares: each result tells its covariance and what it rests on.

pub mod arc;
pub mod line;
mod moments;
pub mod plane;
pub mod polynomial;

use nalgebra::DMatrix;

use crate::error::FitError;

pub use arc::{SpaceCurve, SpanAxis};
pub use line::{Line, fit_line};
pub use plane::{Plane, fit_plane};
pub use polynomial::{Polynomial, fit_polynomial};

/// A shape, how well it is known, and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<T> {
    /// The shape.
    pub estimate: T,
    /// Covariance of its parameters, in the order the shape documents; NaN where there is no
    /// redundancy from which the noise could be judged.
    pub covariance: DMatrix<f64>,
    /// Root of the mean squared residual.
    pub rms: f64,
    /// Number of points.
    pub count: usize,
}

/// Variance of one residual from the sum of squares; NaN without redundancy.
fn variance(sum_of_squares: f64, count: usize, unknowns: usize) -> f64 {
    match count.saturating_sub(unknowns) {
        0 => f64::NAN,
        redundancy => sum_of_squares / redundancy as f64,
    }
}

fn enough(shape: &'static str, needed: usize, found: usize) -> Result<(), FitError> {
    if found >= needed {
        return Ok(());
    }
    Err(FitError::TooFew {
        shape,
        needed,
        found,
    })
}

pub(crate) fn all_finite<'a>(
    shape: &'static str,
    mut points: impl Iterator<Item = &'a [f64]>,
) -> Result<(), FitError> {
    match points.position(|p| !p.iter().all(|c| c.is_finite())) {
        None => Ok(()),
        Some(index) => Err(FitError::NotFinite { shape, index }),
    }
}
