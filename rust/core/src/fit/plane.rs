//! Planes: ground and walls.

use nalgebra::{DMatrix, Matrix3, Matrix4, Vector3, Vector4};

use super::moments::Moments;
use super::{Fit, enough, variance};
use crate::error::FitError;
use crate::neighbors::Coordinate;

const SHAPE: &str = "plane";
/// Ratio of the scatters of two directions at which they can no longer be told apart.
const SAME_SCATTER: f64 = 1.0 - 1e-6;
/// Least ratio of the middle to the largest scatter: below, the points lie on a line.
const ON_A_LINE: f64 = 1e-12;

/// `normal . p + offset_m = 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Offset, metres: minus the component of any point of the plane along the normal.
    pub offset_m: f64,
    /// Mean of the points, metres.
    pub centroid_m: Vector3<f64>,
}

impl Plane {
    /// Signed distance of a point, positive on the side of the normal, metres.
    pub fn distance_m(&self, point_m: &Vector3<f64>) -> f64 {
        self.normal.dot(point_m) + self.offset_m
    }
}

/// Fits a plane to points (metres), its normal on the side of the point `toward_m`.
///
/// Centroid and singular vector of the smallest singular value, equations (2)-(6) of Hu et al. 2024,
/// from accumulated moments: millions of points need no memory. Covariance, 4 x 4 (rank 3), of
/// (normal, `offset_m`).
///
/// # Errors
/// [`FitError`] with fewer than three points, points on a line, points that spread alike in all
/// directions, or coordinates that are not finite.
pub fn fit_plane<T: Coordinate>(
    points: &[[T; 3]],
    toward_m: &Vector3<f64>,
) -> Result<Fit<Plane>, FitError> {
    enough(SHAPE, 3, points.len())?;
    let moments = Moments::of(SHAPE, points)?;
    let (scatters, directions) = moments.principal();
    check_shape(scatters)?;
    let plane = oriented(directions[2], moments.mean, toward_m);
    let noise = variance(scatters[2], moments.count, 3);
    Ok(Fit {
        covariance: covariance(&plane, scatters, &directions, noise, moments.count),
        estimate: plane,
        rms: (scatters[2] / moments.count as f64).sqrt(),
        count: moments.count,
    })
}

fn check_shape([large, middle, small]: [f64; 3]) -> Result<(), FitError> {
    let degenerate = |reason: &str| {
        Err(FitError::Degenerate {
            shape: SHAPE,
            reason: reason.into(),
        })
    };
    if middle <= large * ON_A_LINE {
        return degenerate("the points lie on a line or in one place");
    }
    if small >= middle * SAME_SCATTER {
        return degenerate("the points spread as far across as along");
    }
    Ok(())
}

fn oriented(normal: Vector3<f64>, centroid_m: Vector3<f64>, toward_m: &Vector3<f64>) -> Plane {
    let is_away = normal.dot(&(toward_m - centroid_m)) < 0.0;
    let normal = if is_away { -normal } else { normal };
    Plane {
        normal,
        offset_m: -normal.dot(&centroid_m),
        centroid_m,
    }
}

/// The normal tilts towards the two directions in the plane, each known as well as the points spread
/// along it; the height at the centroid is independent of both.
fn covariance(
    plane: &Plane,
    scatters: [f64; 3],
    directions: &[Vector3<f64>; 3],
    noise: f64,
    count: usize,
) -> DMatrix<f64> {
    let tilt = |k: usize| directions[k] * directions[k].transpose() * (noise / scatters[k]);
    let normal: Matrix3<f64> = tilt(0) + tilt(1);
    let with_offset = -normal * plane.centroid_m;
    let mut all = Matrix4::zeros();
    all.fixed_view_mut::<3, 3>(0, 0).copy_from(&normal);
    all.fixed_view_mut::<3, 1>(0, 3).copy_from(&with_offset);
    all.fixed_view_mut::<1, 3>(3, 0)
        .copy_from(&with_offset.transpose());
    all[(3, 3)] = plane.centroid_m.dot(&(normal * plane.centroid_m)) + noise / count as f64;
    DMatrix::from_column_slice(4, 4, all.as_slice())
}

/// Variance of the height of the plane over `place_m`, along its normal, square metres.
pub fn height_variance(fit: &Fit<Plane>, place_m: &Vector3<f64>) -> f64 {
    let gradient = Vector4::new(place_m.x, place_m.y, place_m.z, 1.0);
    let covariance = Matrix4::from_column_slice(fit.covariance.as_slice());
    gradient.dot(&(covariance * gradient))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Ground of slope (0.05, -0.02) at height -2 around (30, 10), with noise.
    fn ground(count: usize, noise_m: f64, seed: u64) -> Vec<[f64; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut point = || {
            let (x, y): (f64, f64) = (rng.random_range(20.0..40.0), rng.random_range(0.0..20.0));
            // Sum of twelve uniform deviates: variance 1.
            let deviate: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
            [x, y, -2.0 + 0.05 * x - 0.02 * y + noise_m * deviate]
        };
        (0..count).map(|_| point()).collect()
    }

    #[test]
    fn an_exact_plane_comes_back_with_its_normal_towards_the_sensor() {
        let truth = Vector3::new(-0.05, 0.02, 1.0).normalize();
        let points = ground(500, 0.0, 1);
        let up = fit_plane(&points, &Vector3::zeros()).unwrap().estimate;
        assert!((up.normal - truth).norm() < 1e-12);
        assert!((up.distance_m(&Vector3::new(0.0, 0.0, -2.0))).abs() < 1e-11);
        let down = fit_plane(&points, &Vector3::new(0.0, 0.0, -9.0)).unwrap();
        assert!((down.estimate.normal + truth).norm() < 1e-12);
    }

    #[test]
    fn the_stated_variance_is_that_of_repeated_fits() {
        let place = Vector3::new(0.0, 0.0, -2.0); // on the true plane, far outside the points
        let fits: Vec<_> = (0..400)
            .map(|seed| fit_plane(&ground(60, 0.02, seed), &Vector3::zeros()).unwrap())
            .collect();
        let heights = fits.iter().map(|f| f.estimate.distance_m(&place));
        let sampled = heights.map(|h| h * h).sum::<f64>() / 400.0;
        let stated = fits.iter().map(|f| height_variance(f, &place)).sum::<f64>() / 400.0;
        // The ratio of variances from 400 samples scatters by sqrt(2 / 400) = 7 %; four sigma.
        assert!((sampled / stated - 1.0).abs() < 0.28, "{sampled} {stated}");
        let rms = (fits.iter().map(|f| f.rms * f.rms).sum::<f64>() / 400.0).sqrt();
        let expected = 0.02 * (57.0f64 / 60.0).sqrt();
        assert!((rms / expected - 1.0).abs() < 0.03); // sqrt(1 / (2 57 400)) = 0.5 %
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let points = ground(50_000, 0.02, 5);
        let fit = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let work = || fit_plane(&points, &Vector3::zeros()).unwrap();
            pool.build().unwrap().install(work)
        };
        assert_eq!(fit(1), fit(2));
    }

    #[test]
    fn shapes_that_fix_no_plane_are_refused() {
        let sensor = Vector3::new(0.0, 0.0, 5.0);
        let code = |points: &[[f64; 3]]| fit_plane(points, &sensor).unwrap_err();
        let line = [0.0, 1.0, 2.0, 3.0].map(|t| [t, 2.0 * t, -t]);
        assert!(matches!(code(&line), FitError::Degenerate { .. }));
        assert!(matches!(code(&[[1.0; 3]; 9]), FitError::Degenerate { .. }));
        assert!(matches!(code(&line[..2]), FitError::TooFew { .. }));
        let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|b| b as f64);
        let cube: Vec<_> = (0..8).map(corner).collect();
        assert!(matches!(code(&cube), FitError::Degenerate { .. }));
    }

    #[test]
    fn three_points_have_a_plane_but_no_covariance() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let fit = fit_plane(&points, &Vector3::new(0.0, 0.0, 5.0)).unwrap();
        assert!((fit.estimate.normal - Vector3::z()).norm() < 1e-12);
        assert!(fit.rms < 1e-12 && fit.covariance[(0, 0)].is_nan());
    }
}
