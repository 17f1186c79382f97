//! Straight lines in space.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::moments::Moments;
use super::{Fit, enough, variance};
use crate::error::FitError;
use crate::neighbors::Coordinate;

const SHAPE: &str = "line";
/// Largest ratio of the middle to the largest scatter at which there still is one direction.
const SAME_SCATTER: f64 = 1.0 - 1e-6;

/// Points `point_m + t direction`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Mean of the points, metres.
    pub point_m: Vector3<f64>,
    /// Unit direction.
    pub direction: Vector3<f64>,
}

impl Line {
    /// Distance of a point, metres.
    pub fn distance_m(&self, point_m: &Vector3<f64>) -> f64 {
        (point_m - self.point_m).cross(&self.direction).norm()
    }
}

/// Fits a line to points (metres) by orthogonal distances, its direction on the side of `along`.
///
/// Covariance, 6 x 6 (rank 4), of (`point_m` across the line, direction).
///
/// # Errors
/// [`FitError`] with fewer than two points, all points in one place, no direction in which they
/// spread farthest, or coordinates that are not finite.
pub fn fit_line<T: Coordinate>(
    points: &[[T; 3]],
    along: &Vector3<f64>,
) -> Result<Fit<Line>, FitError> {
    enough(SHAPE, 2, points.len())?;
    let moments = Moments::of(SHAPE, points)?;
    let ([large, middle, small], [direction, ..]) = moments.principal();
    if large <= 0.0 || middle >= large * SAME_SCATTER {
        return Err(FitError::Degenerate {
            shape: SHAPE,
            reason: "the points spread farthest in no single direction".into(),
        });
    }
    let is_against = direction.dot(along) < 0.0;
    let direction = if is_against { -direction } else { direction };
    let noise = variance(middle + small, 2 * moments.count, 4);
    Ok(Fit {
        estimate: Line {
            point_m: moments.mean,
            direction,
        },
        covariance: covariance(&direction, large, noise, moments.count),
        rms: ((middle + small) / moments.count as f64).sqrt(),
        count: moments.count,
    })
}

fn covariance(
    direction: &Vector3<f64>,
    along_scatter: f64,
    noise: f64,
    count: usize,
) -> DMatrix<f64> {
    let across = Matrix3::identity() - direction * direction.transpose();
    let mut all = DMatrix::zeros(6, 6);
    all.view_mut((0, 0), (3, 3))
        .copy_from(&(across * (noise / count as f64)));
    all.view_mut((3, 3), (3, 3))
        .copy_from(&(across * (noise / along_scatter)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_line_comes_back() {
        let direction = Vector3::new(1.0, -2.0, 2.0) / 3.0;
        let place = |t: f64| Vector3::new(5.0, 6.0, 7.0) + direction * t;
        let points: Vec<[f64; 3]> = (0..9).map(|t| place(f64::from(t)).into()).collect();
        let fit = fit_line(&points, &-direction).unwrap();
        assert!((fit.estimate.direction + direction).norm() < 1e-12);
        assert!((fit.estimate.point_m - place(4.0)).norm() < 1e-12 && fit.rms < 1e-7);
        let side = Vector3::new(2.0, 1.0, 0.0); // across the line
        assert!((fit.estimate.distance_m(&(place(20.0) + side)) - 5f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn symmetric_scatter_gives_the_variance_of_its_sums() {
        // Residuals of +-0.1 in y, symmetric: slope 0; noise = 0.04 / (2 4 - 4).
        let points = [
            [-3.0, 0.1, 0.0],
            [-1.0, -0.1, 0.0],
            [1.0, -0.1, 0.0],
            [3.0, 0.1, 0.0],
        ];
        let fit = fit_line(&points, &Vector3::x()).unwrap();
        assert!((fit.estimate.direction - Vector3::x()).norm() < 1e-12);
        assert!((fit.covariance[(1, 1)] - 0.01 / 4.0).abs() < 1e-12);
        assert!((fit.covariance[(4, 4)] - 0.01 / 20.0).abs() < 1e-12);
        assert!((fit.rms - 0.1).abs() < 1e-12);
    }

    #[test]
    fn points_without_a_direction_are_refused() {
        let square = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
        ];
        let code = |points: &[[f64; 3]]| fit_line(points, &Vector3::x()).unwrap_err();
        assert!(matches!(code(&square), FitError::Degenerate { .. }));
        assert!(matches!(code(&[[2.0; 3]; 5]), FitError::Degenerate { .. }));
        assert!(matches!(code(&[[2.0; 3]]), FitError::TooFew { .. }));
    }
}
