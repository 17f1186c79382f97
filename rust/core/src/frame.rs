//! Coordinate frames as types, so that a point of one frame cannot meet one of another.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

use nalgebra::{Isometry3, Matrix4, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::error::InvalidValue;

/// The frame in which the vendor's own driver publishes points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sensor;

/// Right-handed, metres; origin at the centre of the root flange, z to the tip along the unloaded
/// blade axis, y up, x = y cross z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct World;

/// A rigid motion that carries coordinates of frame `From` into frame `To`.
pub struct RigidTransform<To, From> {
    isometry: Isometry3<f64>,
    frames: PhantomData<(To, From)>,
}

/// Pose of a sensor: its extrinsic calibration.
pub type WorldFromSensor = RigidTransform<World, Sensor>;

impl<To, From> RigidTransform<To, From> {
    /// The transform with this rotation and this position of the origin of `From` in `To`.
    pub fn new(rotation: Rotation3<f64>, translation_m: Vector3<f64>) -> Self {
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        Self {
            isometry: Isometry3::from_parts(Translation3::from(translation_m), rotation),
            frames: PhantomData,
        }
    }

    /// Reads a homogeneous 4 x 4 matrix.
    ///
    /// # Errors
    /// [`InvalidValue`] where its last row is not (0, 0, 0, 1) or its rotation part is farther than
    /// 1e-6 from a proper rotation.
    pub fn from_matrix(matrix: &Matrix4<f64>) -> Result<Self, InvalidValue> {
        let linear = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let last_row = matrix.row(3);
        let is_affine = last_row
            .iter()
            .zip([0.0, 0.0, 0.0, 1.0])
            .all(|(a, b)| *a == b);
        let orthogonality = (linear.transpose() * linear - nalgebra::Matrix3::identity()).norm();
        let is_rotation = orthogonality < 1e-6 && linear.determinant() > 0.0;
        if !(is_affine && is_rotation) {
            return Err(InvalidValue {
                name: "world_from_sensor",
                expected: "a rotation and a translation with last row 0 0 0 1".into(),
                found: format!("{matrix}"),
            });
        }
        let rotation = Rotation3::from_matrix_unchecked(linear); // made exact as a quaternion
        Ok(Self::new(
            rotation,
            matrix.fixed_view::<3, 1>(0, 3).into_owned(),
        ))
    }

    /// The homogeneous 4 x 4 matrix.
    pub fn to_matrix(&self) -> Matrix4<f64> {
        self.isometry.to_homogeneous()
    }

    /// Rotation part.
    pub fn rotation(&self) -> Rotation3<f64> {
        self.isometry.rotation.to_rotation_matrix()
    }

    /// Rotation part as a quaternion of length 1: its vector and its scalar.
    pub fn quaternion(&self) -> ([f64; 3], f64) {
        let quaternion = &self.isometry.rotation;
        (quaternion.imag().into(), quaternion.scalar())
    }

    /// Position of the origin of `From` in `To`, metres.
    pub fn translation_m(&self) -> Vector3<f64> {
        self.isometry.translation.vector
    }

    /// The motion the other way.
    pub fn inverse(&self) -> RigidTransform<From, To> {
        RigidTransform {
            isometry: self.isometry.inverse(),
            frames: PhantomData,
        }
    }

    /// Carries one point over, metres.
    pub fn transform(&self, point_m: &Point3<f64>) -> Point3<f64> {
        self.isometry * point_m
    }
}

impl<To, Via, From> Mul<RigidTransform<Via, From>> for RigidTransform<To, Via> {
    type Output = RigidTransform<To, From>;
    fn mul(self, next: RigidTransform<Via, From>) -> Self::Output {
        RigidTransform {
            isometry: self.isometry * next.isometry,
            frames: PhantomData,
        }
    }
}

// Derives would ask the same of the marker types.
impl<To, From> Clone for RigidTransform<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for RigidTransform<To, From> {}
impl<To, From> fmt::Debug for RigidTransform<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.isometry.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_comes_back_as_it_went() {
        let rotation = Rotation3::from_euler_angles(0.1, -0.2, 3.0);
        let pose = WorldFromSensor::new(rotation, Vector3::new(3.0, -7.0, 86.0));
        let again = WorldFromSensor::from_matrix(&pose.to_matrix()).unwrap();
        assert!((again.to_matrix() - pose.to_matrix()).norm() < 1e-12);
        let point = Point3::new(1.0, 2.0, 3.0);
        let back = pose.inverse().transform(&pose.transform(&point));
        assert!((back - point).norm() < 1e-12);
    }

    #[test]
    fn a_mirror_or_a_scale_is_refused() {
        for diagonal in [
            [1.0, 1.0, -1.0, 1.0],
            [2.0, 2.0, 2.0, 1.0],
            [f64::NAN, 1.0, 1.0, 1.0],
        ] {
            let matrix = Matrix4::from_diagonal(&diagonal.into());
            assert!(WorldFromSensor::from_matrix(&matrix).is_err());
        }
    }
}
