//! Step 9: contour curves, equation (14): x and y as polynomials in z.

use crate::error::{FitError, InvalidValue};
use crate::fit::Fit;
use crate::fit::polynomial::{Polynomial, fit_polynomial};

/// Degrees of the contour curves, equation (14): the paper takes 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Degrees {
    yoz: usize,
    xoz: usize,
}

impl Degrees {
    /// Degrees of y(z) and x(z).
    ///
    /// # Errors
    /// [`InvalidValue`] above 5, where polynomials of so short a stretch lose all sense.
    pub fn new(yoz: usize, xoz: usize) -> Result<Self, InvalidValue> {
        if yoz.max(xoz) > 5 {
            return Err(InvalidValue {
                name: "degrees",
                expected: "degrees from 0 to 5".into(),
                found: format!("yoz = {yoz}, xoz = {xoz}"),
            });
        }
        Ok(Self { yoz, xoz })
    }
}

/// One contour of the blade as a space curve over z, metres, world frame.
#[derive(Debug, Clone)]
pub struct ContourCurve {
    /// x(z) with its covariance.
    pub x: Fit<Polynomial>,
    /// y(z) with its covariance.
    pub y: Fit<Polynomial>,
    /// Smallest and largest z of the samples.
    pub seen_z_m: [f64; 2],
}

impl ContourCurve {
    /// Its point at `z_m`, metres, world frame.
    pub fn point_m(&self, z_m: f64) -> [f64; 3] {
        [self.x.estimate.value(z_m), self.y.estimate.value(z_m), z_m]
    }
}

/// Fits both polynomials to the samples of one contour.
///
/// # Errors
/// [`FitError`] where the samples are too few for the degrees or all at one z.
pub fn fit_contour(samples_m: &[[f64; 3]], degrees: Degrees) -> Result<ContourCurve, FitError> {
    let column = |axis: usize| samples_m.iter().map(|p| p[axis]).collect::<Vec<_>>();
    let z = column(2);
    let ends = |pick: fn(f64, f64) -> f64| z.iter().copied().reduce(pick).unwrap_or(f64::NAN);
    Ok(ContourCurve {
        x: fit_polynomial(&z, &column(0), degrees.xoz)?,
        y: fit_polynomial(&z, &column(1), degrees.yoz)?,
        seen_z_m: [ends(f64::min), ends(f64::max)],
    })
}
