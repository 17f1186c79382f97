//! A thin rod that keeps its length: curvatures per element in, frames and positions out, exactly.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// Orientation and position of the axis at one arc length. The columns of the orientation are the
/// section's directions without its twist: towards the trailing edge, its perpendicular, tangent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// World directions of the section.
    pub rotation: Rotation3<f64>,
    /// World position of the axis, metres.
    pub position_m: Vector3<f64>,
}

/// Sine and cosine series of a rotation vector's length, safe at zero: sin a / a,
/// (1 - cos a) / a^2 and (a - sin a) / a^3.
fn series(angle_squared: f64) -> [f64; 3] {
    if angle_squared < 1e-6 {
        let a = angle_squared;
        return [
            1.0 - a / 6.0 + a * a / 120.0,
            0.5 - a / 24.0 + a * a / 720.0,
            1.0 / 6.0 - a / 120.0 + a * a / 5040.0,
        ];
    }
    let angle = angle_squared.sqrt();
    let (sin, cos) = angle.sin_cos();
    [
        sin / angle,
        (1.0 - cos) / angle_squared,
        (angle - sin) / (angle_squared * angle),
    ]
}

/// The rotation by a rotation vector.
pub fn turn(vector: &Vector3<f64>) -> Rotation3<f64> {
    let [first, second, _] = series(vector.norm_squared());
    let cross = vector.cross_matrix();
    Rotation3::from_matrix_unchecked(Matrix3::identity() + cross * first + cross * cross * second)
}

/// Where a unit step along the tangent ends while the frame turns evenly by `vector`, per length.
fn arc(vector: &Vector3<f64>) -> Vector3<f64> {
    let [_, second, third] = series(vector.norm_squared());
    let tangent = Vector3::z();
    let once = vector.cross(&tangent);
    tangent + once * second + vector.cross(&once) * third
}

impl Node {
    /// The node `length_m` farther along (or back, if negative) at constant curvature, rad/m in the
    /// section's own directions. A helix: its length is `length_m` exactly.
    pub fn advance(&self, curvature: &Vector3<f64>, length_m: f64) -> Node {
        let vector = curvature * length_m;
        Node {
            rotation: self.rotation * turn(&vector),
            position_m: self.position_m + self.rotation * arc(&vector) * length_m,
        }
    }

    /// World position of a point given in the section's own directions, metres from the axis.
    pub fn point(&self, local_m: &Vector3<f64>) -> Vector3<f64> {
        self.position_m + self.rotation * local_m
    }

    /// World direction of the axis.
    pub fn tangent(&self) -> Vector3<f64> {
        self.rotation.matrix().column(2).into_owned()
    }
}

/// All nodes of a rod from its root, for curvatures of the elements between `arc_m`.
pub fn integrate(root: &Node, arc_m: &[f64], curvatures: &[Vector3<f64>]) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(arc_m.len());
    nodes.push(*root);
    for (ends, curvature) in arc_m.windows(2).zip(curvatures) {
        let next = nodes[nodes.len() - 1].advance(curvature, ends[1] - ends[0]);
        nodes.push(next);
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> Node {
        Node {
            rotation: Rotation3::identity(),
            position_m: Vector3::zeros(),
        }
    }

    #[test]
    fn a_constant_curvature_is_a_circle() {
        let end = root().advance(&Vector3::new(0.0, 0.5, 0.0), std::f64::consts::PI);
        // A quarter of a circle of radius 2 m.
        assert!((end.position_m - Vector3::new(2.0, 0.0, 2.0)).norm() < 1e-14);
        assert!((end.tangent() - Vector3::x()).norm() < 1e-14);
    }

    #[test]
    fn a_step_back_undoes_a_step_forward() {
        let curvature = Vector3::new(0.02, -0.01, 0.03);
        let back = root().advance(&curvature, 3.0).advance(&curvature, -3.0);
        assert!(back.position_m.norm() < 1e-14);
    }

    #[test]
    fn small_and_large_turns_join() {
        for scale in [0.999e-3, 1.001e-3] {
            let vector = Vector3::new(0.6, 0.0, 0.8) * scale;
            let exact = Rotation3::from_scaled_axis(vector);
            assert!((turn(&vector).matrix() - exact.matrix()).norm() < 1e-15);
        }
    }
}
