//! The axis that keeps its length: curvatures in, directions and positions out, with derivatives.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// Below this angle the fifth terms of the series of sine and cosine are less than rounding, rad.
const SMALL_RAD: f64 = 0.1;

/// Directions and place of all nodes at one instant.
#[derive(Debug, Clone)]
pub struct Axis {
    /// World directions of each node's section; the third is the tangent.
    pub turn: Vec<Matrix3<f64>>,
    /// World position of each node, metres.
    pub place: Vec<Vector3<f64>>,
    /// Curvature of each element, rad/m, in its own directions.
    pub curvature: Vec<Vector3<f64>>,
}

/// How all nodes move under one unknown: rotation and displacement, world directions.
#[derive(Debug, Clone)]
pub struct Field {
    /// Rotation of each node, rad per unit.
    pub turn: Vec<Vector3<f64>>,
    /// Displacement of each node, metres per unit.
    pub place: Vec<Vector3<f64>>,
}

impl Axis {
    /// Integrates curvatures from a clamped root over nodes at `s_m`.
    pub fn integrate(root: &Matrix3<f64>, s_m: &[f64], curvature: Vec<Vector3<f64>>) -> Self {
        let mut turn = Vec::with_capacity(s_m.len());
        let mut place = Vec::with_capacity(s_m.len());
        turn.push(*root);
        place.push(Vector3::zeros());
        for (i, bend) in curvature.iter().enumerate() {
            let length = s_m[i + 1] - s_m[i];
            let half = rotation(&(bend * (0.5 * length)));
            let middle = turn[i] * half;
            // The chord of an arc is shorter than the arc.
            let across = bend.xy().norm() * length;
            let chord = length * (1.0 - across * across / 24.0);
            place.push(place[i] + middle.column(2) * chord);
            turn.push(middle * half);
        }
        Self {
            turn,
            place,
            curvature,
        }
    }

    /// Largest distance between nodes of two shapes of one blade, metres.
    pub fn farthest_m(&self, other: &Self) -> f64 {
        let apart = self.place.iter().zip(&other.place);
        apart.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    /// What a change of curvature (each element, its own directions) and of the root's rotation
    /// (world) moves.
    pub fn field(&self, s_m: &[f64], change: &[Vector3<f64>], root_turn: &Vector3<f64>) -> Field {
        let mut turn = Vec::with_capacity(s_m.len());
        let mut place = Vec::with_capacity(s_m.len());
        turn.push(*root_turn);
        place.push(Vector3::zeros());
        for (i, bend) in change.iter().enumerate() {
            let length = s_m[i + 1] - s_m[i];
            let middle = 0.5 * (self.turn[i] + self.turn[i + 1]);
            let half = middle * bend * (0.5 * length);
            let step = self.place[i + 1] - self.place[i];
            let at_middle = turn[i] + half;
            // Turning while it goes adds a third of what the bend itself does to the chord.
            place.push(place[i] + at_middle.cross(&step));
            turn.push(at_middle + half);
        }
        Field { turn, place }
    }
}

/// Rotation by a rotation vector: most are so small that a few terms of the series are exact.
fn rotation(turn: &Vector3<f64>) -> Matrix3<f64> {
    let square = turn.norm_squared();
    if square > SMALL_RAD * SMALL_RAD {
        return Rotation3::from_scaled_axis(*turn).into_inner();
    }
    // sin(a) / a and (1 - cos(a)) / a^2.
    let along =
        1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)));
    let twice =
        0.5 - square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0 * (1.0 - square / 90.0)));
    let cross = turn.cross_matrix();
    Matrix3::identity() + cross * along + cross * cross * twice
}

impl Field {
    /// Nothing moves.
    pub fn zero(nodes: usize) -> Self {
        Self {
            turn: vec![Vector3::zeros(); nodes],
            place: vec![Vector3::zeros(); nodes],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bent(scale: f64) -> (Vec<f64>, Vec<Vector3<f64>>) {
        let s_m: Vec<f64> = (0..=60).map(f64::from).collect();
        let bend = |i: i32| Vector3::new(0.004, 0.01 * f64::from(i) / 60.0, 0.002) * scale;
        (s_m, (0..60).map(bend).collect())
    }

    #[test]
    fn a_constant_curvature_is_a_circle_of_the_right_length() {
        let s_m: Vec<f64> = (0..=100).map(f64::from).collect();
        let bend = vec![Vector3::y() * 0.01; 100];
        let axis = Axis::integrate(&Matrix3::identity(), &s_m, bend);
        let end = Vector3::new(100.0 * (1.0 - 1f64.cos()), 0.0, 100.0 * 1f64.sin());
        assert!((axis.place[100] - end).norm() < 1e-6);
    }

    #[test]
    fn fields_are_the_derivatives_of_the_axis() {
        let (s_m, bend) = bent(1.0);
        let axis = Axis::integrate(&Matrix3::identity(), &s_m, bend.clone());
        let change: Vec<_> = (0..60)
            .map(|i| Vector3::new(1.0, 0.5, 2.0) * (0.1 * f64::from(i)).cos())
            .collect();
        let field = axis.field(&s_m, &change, &Vector3::zeros());
        let step = 1e-6;
        let moved = |sign: f64| {
            let curvature = bend.iter().zip(&change).map(|(b, c)| b + c * (sign * step));
            Axis::integrate(&Matrix3::identity(), &s_m, curvature.collect())
        };
        let (ahead, behind) = (moved(1.0), moved(-1.0));
        let slope = (ahead.place[60] - behind.place[60]) / (2.0 * step);
        let error = (slope - field.place[60]).norm() / slope.norm();
        assert!(error < 2e-4, "{error}");
        let spin = (ahead.turn[60] - behind.turn[60]) * axis.turn[60].transpose() / (2.0 * step);
        let slope = Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
        assert!((slope - field.turn[60]).norm() < 1e-4 * slope.norm());
    }
}
