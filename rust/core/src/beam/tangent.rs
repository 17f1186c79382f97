//! How a bent rod answers to small changes, by one sweep from tip to root and one back.
//!
//! Dead loads make the force in every section known beforehand; what a change does to the moment beyond a
//! node is linear in the rotation of that node. The sweep inwards finds that relation node by node, the
//! sweep outwards the rotations: the work grows with the number of nodes alone.

use nalgebra::{Matrix3, Vector3};

use super::axis::Axis;
use super::equilibrium::{Inner, Physics};
use super::mesh::Mesh;

/// A rod about one shape.
#[derive(Debug, Clone)]
pub struct Tangent {
    elements: Vec<Element>,
}

/// One element: `turned = gain * rotation of the inner node + ...` is what it adds to the rotation.
#[derive(Debug, Clone)]
struct Element {
    /// Its directions over its length, and times it.
    turn: Matrix3<f64>,
    length_m: f64,
    /// Rotation per moment.
    yields: Matrix3<f64>,
    /// Answer of the added rotation to itself.
    eased: Matrix3<f64>,
    gain: Matrix3<f64>,
    /// Moment beyond its outer node per rotation of that node.
    outer: Matrix3<f64>,
    /// Moment that its own turning adds at its inner node.
    lever: Matrix3<f64>,
}

impl Tangent {
    /// About a shape under loads; `None` where the shape yields without limit: it buckles.
    pub fn of(mesh: &Mesh, physics: &Physics, axis: &Axis) -> Option<Self> {
        let inner = physics.inner(mesh, axis);
        let count = mesh.len() - 1;
        let mut elements = Vec::with_capacity(count);
        let mut outer = follows(axis, &inner, count);
        for e in (0..count).rev() {
            let element = Element::of(mesh, physics, axis, (e, &inner), outer)?;
            outer = element.inwards() + follows(axis, &inner, e);
            elements.push(element);
        }
        elements.reverse();
        Some(Self { elements })
    }

    /// Change of all curvatures, rad/m in the elements' directions, where at a fixed shape `wanted` were
    /// added to them and the root turned by `root_rad` (world).
    pub fn answer(&self, wanted: &[Vector3<f64>], root_rad: &Vector3<f64>) -> Vec<Vector3<f64>> {
        let mut added = vec![Vector3::zeros(); wanted.len()];
        let mut beyond = Vector3::zeros();
        for (e, element) in self.elements.iter().enumerate().rev() {
            let turned = element.turn * wanted[e] * element.length_m;
            added[e] = element.eased * (element.yields * beyond + turned);
            beyond += (element.outer + 0.5 * element.lever) * added[e];
        }
        let mut rotation = *root_rad;
        for (element, added) in self.elements.iter().zip(&mut added) {
            let turned = element.gain * rotation + *added;
            rotation += turned;
            *added = element.turn.tr_mul(&turned) / element.length_m;
        }
        added
    }
}

impl Element {
    fn of(
        mesh: &Mesh,
        physics: &Physics,
        axis: &Axis,
        (e, inner): (usize, &Inner),
        outer: Matrix3<f64>,
    ) -> Option<Self> {
        let length_m = mesh.step_m(e);
        let turn = 0.5 * (axis.turn[e] + axis.turn[e + 1]);
        let step = axis.place[e + 1] - axis.place[e];
        let yields = turn * physics.compliance(mesh, e) * turn.transpose() * length_m;
        let (force, half) = (&inner.force[e], &inner.half_weight[e]);
        let held = 0.5 * lever(&step, &(force + 0.5 * half)) + inner.moment[e].cross_matrix();
        let eased = (Matrix3::identity() - yields * (outer + 0.5 * held)).try_inverse()?;
        Some(Self {
            gain: eased * yields * (outer + held),
            lever: lever(&step, &(force + half)),
            turn,
            length_m,
            yields,
            eased,
            outer,
        })
    }

    /// Moment beyond its inner node per rotation of that node.
    fn inwards(&self) -> Matrix3<f64> {
        let identity = Matrix3::identity();
        self.outer * (identity + self.gain) + self.lever * (identity + 0.5 * self.gain)
    }
}

/// Change of `step x force` per rotation of the step.
fn lever(step: &Vector3<f64>, force: &Vector3<f64>) -> Matrix3<f64> {
    step * force.transpose() - Matrix3::identity() * force.dot(step)
}

/// What a couple about a node's tangent changes by as the node turns.
fn follows(axis: &Axis, inner: &Inner, node: usize) -> Matrix3<f64> {
    let tangent: Vector3<f64> = axis.turn[node].column(2).into_owned();
    -tangent.cross_matrix() * inner.couple_nm[node]
}
