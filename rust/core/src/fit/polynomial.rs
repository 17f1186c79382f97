//! Polynomials by least squares, in an abscissa centred and scaled to [-1, 1].

use nalgebra::{DMatrix, DVector};

use super::{Fit, all_finite, enough, variance};
use crate::error::{FitError, InvalidValue};

const SHAPE: &str = "polynomial";
/// Highest degree: beyond, equations in powers lose their digits and contours their meaning.
pub const MOST_DEGREE: usize = 12;

/// sum of `coefficients[k]` u^k with u = (t - center) / scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    coefficients: Vec<f64>,
    center: f64,
    scale: f64,
}

impl Polynomial {
    /// A polynomial in powers of u = (t - center) / scale, lowest first.
    ///
    /// # Errors
    /// [`InvalidValue`] without coefficients, where a value is not finite, or where the scale is not
    /// positive.
    pub fn new(coefficients: Vec<f64>, center: f64, scale: f64) -> Result<Self, InvalidValue> {
        let refuse = |name, expected: &str, found| {
            Err(InvalidValue {
                name,
                expected: expected.into(),
                found,
            })
        };
        if coefficients.is_empty() || !coefficients.iter().all(|c| c.is_finite()) {
            let found = format!("{coefficients:?}");
            return refuse("coefficients", "at least one, all finite", found);
        }
        if !center.is_finite() {
            return refuse("center", "a finite abscissa", center.to_string());
        }
        if !(scale > 0.0 && scale.is_finite()) {
            return refuse("scale", "a positive length", scale.to_string());
        }
        Ok(Self {
            coefficients,
            center,
            scale,
        })
    }

    /// A polynomial in powers of t itself, lowest first.
    ///
    /// # Errors
    /// As [`Polynomial::new`].
    pub fn from_powers(coefficients: Vec<f64>) -> Result<Self, InvalidValue> {
        Self::new(coefficients, 0.0, 1.0)
    }

    /// Coefficients of the powers of u = (t - center) / scale, lowest first.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Abscissa at which u = 0.
    pub fn center(&self) -> f64 {
        self.center
    }

    /// Length on the abscissa of one u.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Degree, counting a leading coefficient that happens to be zero.
    pub fn degree(&self) -> usize {
        self.coefficients.len() - 1
    }

    /// Value at `t`.
    pub fn value(&self, t: f64) -> f64 {
        let u = (t - self.center) / self.scale;
        self.coefficients
            .iter()
            .rev()
            .fold(0.0, |sum, c| sum * u + c)
    }

    /// Values at several places.
    pub fn values(&self, ts: &[f64]) -> Vec<f64> {
        ts.iter().map(|&t| self.value(t)).collect()
    }

    /// First derivatives at several places.
    pub fn slopes(&self, ts: &[f64]) -> Vec<f64> {
        ts.iter().map(|&t| self.slope(t)).collect()
    }

    /// First derivative at `t`.
    pub fn slope(&self, t: f64) -> f64 {
        let u = (t - self.center) / self.scale;
        let terms = self.coefficients.iter().enumerate().skip(1).rev();
        terms.fold(0.0, |sum, (k, c)| sum * u + k as f64 * c) / self.scale
    }

    /// The derivative as a polynomial in the same abscissa.
    pub fn derivative(&self) -> Self {
        let term = |(k, c): (usize, &f64)| k as f64 * c / self.scale;
        let mut coefficients: Vec<f64> = self
            .coefficients
            .iter()
            .enumerate()
            .skip(1)
            .map(term)
            .collect();
        if coefficients.is_empty() {
            coefficients.push(0.0);
        }
        Self {
            coefficients,
            ..*self
        }
    }

    /// Coefficients of the powers of t itself, lowest first; digits are lost where the abscissas lie
    /// far from 0 against their spread, so evaluate with [`Polynomial::value`].
    pub fn powers(&self) -> Vec<f64> {
        let shift = -self.center / self.scale;
        let mut powers = vec![0.0; self.coefficients.len()];
        for (n, c) in self.coefficients.iter().enumerate() {
            let mut term = *c; // c binomial(n, k) shift^(n - k) / scale^k, from k = n downwards
            for k in (0..=n).rev() {
                powers[k] += term / self.scale.powi(k as i32);
                term *= shift * k as f64 / (n - k + 1) as f64;
            }
        }
        powers
    }

    /// Gradient of [`Polynomial::value`] at `t` by the coefficients.
    pub fn gradient(&self, t: f64) -> DVector<f64> {
        let u = (t - self.center) / self.scale;
        DVector::from_iterator(
            self.coefficients.len(),
            powers_of(u).take(self.coefficients.len()),
        )
    }
}

impl Polynomial {
    /// Variances of the values at several places, from the covariance of the coefficients.
    pub fn variances(&self, covariance: &DMatrix<f64>, ts: &[f64]) -> Vec<f64> {
        let variance = |&t: &f64| {
            let gradient = self.gradient(t);
            gradient.dot(&(covariance * &gradient))
        };
        ts.iter().map(variance).collect()
    }
}

impl Fit<Polynomial> {
    /// Variance of the value at `t`.
    pub fn variance_at(&self, t: f64) -> f64 {
        self.estimate.variances(&self.covariance, &[t])[0]
    }
}

fn powers_of(u: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(1.0), move |power| Some(power * u))
}

/// Fits `ordinates` over `abscissas` by a polynomial of `degree`.
///
/// Covariance of [`Polynomial::coefficients`], from the scatter of the residuals.
///
/// # Errors
/// [`FitError`] with fewer than degree + 1 points or as few different abscissas, lengths that differ,
/// a degree beyond [`MOST_DEGREE`], or values that are not finite.
pub fn fit_polynomial(
    abscissas: &[f64],
    ordinates: &[f64],
    degree: usize,
) -> Result<Fit<Polynomial>, FitError> {
    let unknowns = check(abscissas, ordinates, degree)?;
    let (center, scale) = window(abscissas);
    let design = DMatrix::from_fn(abscissas.len(), unknowns, |i, k| {
        ((abscissas[i] - center) / scale).powi(k as i32)
    });
    let (solution, inverse) = solve(&design, &DVector::from_column_slice(ordinates))?;
    let residuals = &design * &solution - DVector::from_column_slice(ordinates);
    let sum_of_squares = residuals.norm_squared();
    Ok(Fit {
        covariance: inverse * variance(sum_of_squares, abscissas.len(), unknowns),
        estimate: Polynomial {
            coefficients: solution.as_slice().to_vec(),
            center,
            scale,
        },
        rms: (sum_of_squares / abscissas.len() as f64).sqrt(),
        count: abscissas.len(),
    })
}

fn check(abscissas: &[f64], ordinates: &[f64], degree: usize) -> Result<usize, FitError> {
    let degenerate = |reason: String| {
        Err(FitError::Degenerate {
            shape: SHAPE,
            reason,
        })
    };
    if degree > MOST_DEGREE {
        return degenerate(format!("degree {degree} is beyond {MOST_DEGREE}"));
    }
    let (count, unknowns) = (abscissas.len(), degree + 1);
    if ordinates.len() != count {
        let found = ordinates.len();
        return degenerate(format!("{count} abscissas but {found} ordinates"));
    }
    enough(SHAPE, unknowns, count)?;
    let pairs: Vec<[f64; 2]> = abscissas
        .iter()
        .zip(ordinates)
        .map(|(&t, &x)| [t, x])
        .collect();
    all_finite(SHAPE, pairs.iter().map(<[f64; 2]>::as_slice))?;
    let different = count_different(abscissas);
    if different < unknowns {
        return degenerate(format!(
            "degree {degree} needs {unknowns} different abscissas, found {different}"
        ));
    }
    Ok(unknowns)
}

/// Number of different values.
pub fn count_different(values: &[f64]) -> usize {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    sorted.len()
}

/// Middle and half length of the range; half length 1 where there is one abscissa only.
fn window(abscissas: &[f64]) -> (f64, f64) {
    let low = abscissas.iter().copied().fold(f64::INFINITY, f64::min);
    let high = abscissas.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let half = 0.5 * (high - low);
    (0.5 * (low + high), if half > 0.0 { half } else { 1.0 })
}

/// Least squares by orthogonal triangles, with the inverse of the normal matrix.
fn solve(
    design: &DMatrix<f64>,
    right: &DVector<f64>,
) -> Result<(DVector<f64>, DMatrix<f64>), FitError> {
    let qr = design.clone().qr();
    let triangle = qr.r();
    let largest = triangle.diagonal().amax();
    let smallest = triangle.diagonal().amin();
    let inverse = triangle.clone().try_inverse();
    match inverse {
        Some(inverse) if smallest > largest * f64::EPSILON * design.nrows() as f64 => {
            let solution = &inverse * (qr.q().transpose() * right);
            Ok((solution, &inverse * inverse.transpose()))
        }
        _ => Err(FitError::Degenerate {
            shape: SHAPE,
            reason: "abscissas too close to each other for the degree".into(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(count: usize) -> Vec<f64> {
        (0..count)
            .map(|i| 80.0 + 30.0 * i as f64 / (count - 1) as f64)
            .collect()
    }

    #[test]
    fn a_quadratic_comes_back_in_powers_and_slopes() {
        let t = grid(20);
        let x: Vec<f64> = t.iter().map(|t| 0.002 * t * t - 0.3 * t + 7.0).collect();
        let fit = fit_polynomial(&t, &x, 2).unwrap();
        let powers = fit.estimate.powers();
        for (found, expected) in powers.iter().zip([7.0, -0.3, 0.002]) {
            assert!((found - expected).abs() < 1e-9, "{powers:?}");
        }
        assert!((fit.estimate.slope(100.0) - 0.1).abs() < 1e-11);
        assert!((fit.estimate.derivative().value(100.0) - 0.1).abs() < 1e-11);
        let again = Polynomial::from_powers(powers).unwrap();
        assert!((again.value(95.0) - fit.estimate.value(95.0)).abs() < 1e-9);
    }

    #[test]
    fn the_covariance_of_a_straight_line_is_the_textbook_one() {
        // Residuals -1, 2, -1 over t = 0, 1, 2: the line is 0, noise 6 / (3 - 2).
        let fit = fit_polynomial(&[0.0, 1.0, 2.0], &[-1.0, 2.0, -1.0], 1).unwrap();
        assert!((fit.covariance[(0, 0)] - 6.0 / 3.0).abs() < 1e-12);
        assert!((fit.covariance[(1, 1)] - 6.0 / 2.0).abs() < 1e-12);
        assert!((fit.variance_at(2.0) - 5.0).abs() < 1e-12);
        assert!((fit.rms - 2f64.sqrt()).abs() < 1e-12 && fit.count == 3);
    }

    #[test]
    fn without_redundancy_the_noise_is_unknown() {
        let fit = fit_polynomial(&[1.0, 2.0], &[3.0, 5.0], 1).unwrap();
        assert!((fit.estimate.value(3.0) - 7.0).abs() < 1e-12);
        assert!(fit.covariance[(0, 0)].is_nan());
        let constant = fit_polynomial(&[4.0], &[3.0], 0).unwrap();
        assert_eq!(constant.estimate.value(9.0), 3.0);
        assert_eq!(constant.estimate.derivative().value(1.0), 0.0);
    }

    #[test]
    fn what_fixes_no_polynomial_is_refused_with_the_reason() {
        let refuse = |t: &[f64], x: &[f64], degree| fit_polynomial(t, x, degree).unwrap_err();
        let few = refuse(&[0.0, 1.0], &[0.0, 1.0], 2);
        assert!(matches!(
            few,
            FitError::TooFew {
                needed: 3,
                found: 2,
                ..
            }
        ));
        let same = refuse(&[1.0, 1.0, 2.0], &[0.0; 3], 2);
        assert!(same.to_string().contains("found 2"), "{same}");
        assert!(matches!(
            refuse(&[0.0], &[0.0, 1.0], 0),
            FitError::Degenerate { .. }
        ));
        assert!(matches!(
            refuse(&grid(50), &[0.0; 50], 13),
            FitError::Degenerate { .. }
        ));
        let bad = refuse(&[0.0, f64::NAN], &[0.0, 1.0], 0);
        assert!(matches!(bad, FitError::NotFinite { index: 1, .. }));
        assert!(matches!(refuse(&[], &[], 0), FitError::TooFew { .. }));
        assert!(Polynomial::from_powers(vec![]).is_err());
        assert!(Polynomial::new(vec![1.0], f64::NAN, 1.0).is_err());
        assert!(Polynomial::new(vec![1.0], 0.0, 0.0).is_err());
    }

    proptest! {
        #[test]
        fn residuals_stand_upright_on_all_powers(
            x in prop::collection::vec(-5.0f64..5.0, 6..40), degree in 0usize..5,
        ) {
            let t = grid(x.len());
            let fit = fit_polynomial(&t, &x, degree).unwrap();
            for k in 0..=degree {
                let u = |t: f64| ((t - 95.0) / 15.0).powi(k as i32);
                let sum: f64 = t.iter().zip(&x).map(|(&t, x)| u(t) * (x - fit.estimate.value(t))).sum();
                prop_assert!(sum.abs() < 1e-10, "{sum}");
            }
        }
    }
}
