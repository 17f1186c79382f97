//! The rotation that carries one direction onto another: equations (7) and (8) of Hu et al. 2024.
//!
//! As printed, (8) divides by |v| twice and is a rotation only at 90 degrees: at 5 degrees its
//! determinant is 131. The right factor is (1 - n.a) / |v|^2 = 1 / (1 + n.a) for unit vectors.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

/// Below this 1 + n.a the two directions count as opposite, and the axis is chosen.
const OPPOSITE: f64 = 1e-12;

/// The smallest rotation that carries the unit vector `from` onto the unit vector `to`.
///
/// Where the two are opposite, a half turn about an axis square to both: the smallest rotation is
/// not unique there.
pub fn rotation_onto(from: &Unit<Vector3<f64>>, to: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    let one_plus_cosine = 1.0 + from.dot(to);
    if one_plus_cosine < OPPOSITE {
        return half_turn_square_to(from);
    }
    let cross = from.cross(to).cross_matrix(); // (7)
    let matrix = Matrix3::identity() + cross + cross * cross / one_plus_cosine; // (8), corrected
    Rotation3::from_matrix_unchecked(matrix)
}

fn half_turn_square_to(direction: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    let least = direction.iamin();
    let mut helper = Vector3::zeros();
    helper[least] = 1.0;
    let axis = Unit::new_normalize(direction.cross(&helper));
    Rotation3::from_axis_angle(&axis, std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = Unit<Vector3<f64>>> {
        [-1.0..1.0f64, -1.0..1.0, -1.0..1.0]
            .prop_map(Vector3::from)
            .prop_filter("has a direction", |v| v.norm() > 1e-3)
            .prop_map(Unit::new_normalize)
    }

    fn assert_proper(rotation: &Rotation3<f64>) {
        let matrix = rotation.matrix();
        assert!((matrix.transpose() * matrix - Matrix3::identity()).norm() < 1e-9);
        assert!((matrix.determinant() - 1.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn it_is_a_rotation_and_carries_over(from in unit(), to in unit()) {
            let rotation = rotation_onto(&from, &to);
            assert_proper(&rotation);
            prop_assert!((rotation * *from - *to).norm() < 1e-9);
            // The smallest one turns about the normal of the plane of both.
            let normal = from.cross(&to);
            prop_assert!((rotation * normal - normal).norm() < 1e-9);
        }
    }

    #[test]
    fn opposite_directions_are_a_half_turn() {
        for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
            let rotation = rotation_onto(&axis, &-axis);
            assert_proper(&rotation);
            assert!((rotation * *axis + *axis).norm() < 1e-12);
        }
    }

    #[test]
    fn the_printed_formula_is_no_rotation() {
        // 5 degrees: the printed factor is (1 - cos / sin) / sin^2.
        let angle = 5f64.to_radians();
        let cross = (Vector3::z() * angle.sin()).cross_matrix();
        let factor = (1.0 - angle.cos() / angle.sin()) / angle.sin().powi(2);
        let printed = Matrix3::identity() + cross + cross * cross * factor;
        assert!((printed.determinant() - 131.0).abs() < 0.5);
    }
}
