//! Mean and scatter of a cloud of any size, in one pass and with the same bits for any threads.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

use crate::error::FitError;
use crate::neighbors::{Coordinate, wide};

/// Points summed about their own mean before they are put together with others.
const CHUNK: usize = 4096;

/// Count, mean and scatter (sum of outer products about the mean) of points.
#[derive(Debug, Clone, Copy)]
pub struct Moments {
    pub count: usize,
    pub mean: Vector3<f64>,
    pub scatter: Matrix3<f64>,
}

impl Moments {
    /// Moments of finite points: fixed chunks, put together in their order.
    pub fn of<T: Coordinate>(shape: &'static str, points: &[[T; 3]]) -> Result<Self, FitError> {
        let chunks: Vec<Self> = points.par_chunks(CHUNK).map(Self::of_chunk).collect();
        let all = chunks.into_iter().reduce(Self::merged).unwrap_or(Self {
            count: 0,
            mean: Vector3::zeros(),
            scatter: Matrix3::zeros(),
        });
        if all.scatter.iter().all(|s| s.is_finite()) {
            return Ok(all);
        }
        let is_bad = |p: &[T; 3]| !wide(*p).iter().all(|c| c.is_finite());
        match points.iter().position(is_bad) {
            Some(index) => Err(FitError::NotFinite { shape, index }),
            None => Err(FitError::Degenerate {
                shape,
                reason: "coordinates too large to be squared".into(),
            }),
        }
    }

    fn of_chunk<T: Coordinate>(points: &[[T; 3]]) -> Self {
        let count = points.len();
        let place = |p: &[T; 3]| Vector3::from(wide(*p));
        let mean = points.iter().map(place).sum::<Vector3<f64>>() / count as f64;
        let mut scatter = Matrix3::zeros();
        for point in points {
            let arm = place(point) - mean;
            scatter += arm * arm.transpose();
        }
        Self {
            count,
            mean,
            scatter,
        }
    }

    /// Chan, Golub, `LeVeque` 1979: no cancellation however far the cloud lies from the origin.
    fn merged(self, other: Self) -> Self {
        let count = self.count + other.count;
        let arm = other.mean - self.mean;
        let share = other.count as f64 / count as f64;
        Self {
            count,
            mean: self.mean + arm * share,
            scatter: self.scatter
                + other.scatter
                + arm * arm.transpose() * (self.count as f64 * share),
        }
    }

    /// Principal scatters, largest first, with their directions: the squared singular values and the
    /// right singular vectors of the matrix of centred points.
    pub fn principal(&self) -> ([f64; 3], [Vector3<f64>; 3]) {
        let eigen = SymmetricEigen::new(self.scatter);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        (
            order.map(|k| eigen.eigenvalues[k].max(0.0)),
            order.map(|k| eigen.eigenvectors.column(k).into_owned()),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merging_chunks_equals_one_pass_far_from_the_origin() {
        let place = |i: usize| [1e6 + (i % 97) as f64, (i % 13) as f64 - 5e5, (i % 7) as f64];
        let points: Vec<[f64; 3]> = (0..3 * CHUNK + 11).map(place).collect();
        let (merged, whole) = (
            Moments::of("t", &points).unwrap(),
            Moments::of_chunk(&points),
        );
        assert!((merged.mean - whole.mean).norm() < 1e-8);
        let relative = (merged.scatter - whole.scatter).norm() / whole.scatter.norm();
        assert!(relative < 1e-9, "{relative}");
    }

    #[test]
    fn a_bad_point_is_named() {
        let mut points = vec![[0.0f32; 3]; 5000];
        points[4567][2] = f32::NAN;
        let error = Moments::of("plane", &points).unwrap_err();
        assert!(matches!(error, FitError::NotFinite { index: 4567, .. }));
    }
}
