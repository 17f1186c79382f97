//! A clamped rod under dead loads: curvatures that its moments ask for at the shape they make.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::axis::Axis;
use super::mesh::Mesh;
use super::tangent::Tangent;

const GRAVITY_M_S2: f64 = 9.81;
/// A step that does not bring the moments nearer to the curvatures is halved, at most so often.
const HALVED: usize = 12;
const MAX_STEPS: usize = 100;
/// Largest difference of any curvature from what the moments ask for, rad/m.
const CONVERGED_RAD_M: f64 = 1e-11;

/// Everything that bends the blade.
#[derive(Debug, Clone)]
pub struct Physics {
    /// Node and world force of every place where load enters, newtons.
    pub forces: Vec<(usize, Vector3<f64>)>,
    /// What full load adds at the same places, newtons.
    pub full: Vec<Vector3<f64>>,
    /// Moment about the tangent at the same places, newton metres.
    pub couples_nm: Vec<f64>,
    /// Weight over the guess, by element.
    pub weight: Vec<f64>,
    /// Compliance over that of the drawing: edgewise, flapwise, torsion, by element; and coupling of
    /// both bendings, which drawings do not tell, as a share of the mean of their stiffnesses.
    pub soft: [Vec<f64>; 4],
    /// Added stress-free curvature, by element, rad/m.
    pub free: Vec<Vector3<f64>>,
    /// Stress-free curvature over that of the drawing.
    pub prebend: f64,
    /// Rotation of the root from the clamp of the drawing, world, rad.
    pub root_rad: Vector3<f64>,
}

impl Physics {
    /// The drawing under its weight.
    pub fn unloaded(mesh: &Mesh, saddles: &[usize]) -> Self {
        let elements = mesh.len() - 1;
        Self {
            forces: saddles
                .iter()
                .map(|node| (*node, Vector3::zeros()))
                .collect(),
            full: vec![Vector3::zeros(); saddles.len()],
            couples_nm: vec![0.0; saddles.len()],
            weight: vec![1.0; elements],
            soft: [1.0, 1.0, 1.0, 0.0].map(|share| vec![share; elements]),
            free: vec![Vector3::zeros(); elements],
            prebend: 1.0,
            root_rad: Vector3::zeros(),
        }
    }

    /// World directions of the root.
    pub fn root(&self, mesh: &Mesh) -> Matrix3<f64> {
        Rotation3::from_scaled_axis(self.root_rad).matrix() * mesh.root
    }

    /// Solves for the curvatures from a first guess; `None` where it does not settle.
    pub fn solve(&self, mesh: &Mesh, start: &[Vector3<f64>]) -> Option<Axis> {
        let root = self.root(mesh);
        let mut axis = Axis::integrate(&root, &mesh.s_m, start.to_vec());
        let (mut lacking, mut far) = self.lacking(mesh, &axis);
        for _ in 0..MAX_STEPS {
            if far < CONVERGED_RAD_M {
                return Some(axis);
            }
            let step = Tangent::of(mesh, self, &axis)?.answer(&lacking, &Vector3::zeros());
            let nearer = (0..HALVED).find_map(|halved| {
                let share = 0.5f64.powi(halved as i32);
                let parts = axis.curvature.iter().zip(&step);
                let next = parts.map(|(now, step)| now + step * share).collect();
                let next = Axis::integrate(&root, &mesh.s_m, next);
                let (lacking, left) = self.lacking(mesh, &next);
                (left < far).then_some((next, lacking, left))
            });
            (axis, lacking, far) = nearer?;
        }
        None
    }

    /// What the moments ask for beyond the curvatures, and the largest of it, rad/m.
    fn lacking(&self, mesh: &Mesh, axis: &Axis) -> (Vec<Vector3<f64>>, f64) {
        let wanted = self.curvatures(mesh, axis);
        let pairs = wanted.iter().zip(&axis.curvature);
        let lacking: Vec<Vector3<f64>> = pairs.map(|(wanted, now)| wanted - now).collect();
        let far = lacking.iter().map(Vector3::amax).fold(0.0, f64::max);
        let is_finite = lacking.iter().all(|l| l.amax().is_finite());
        (lacking, if is_finite { far } else { f64::INFINITY })
    }

    /// Curvatures of the elements by the moments at a shape.
    pub fn curvatures(&self, mesh: &Mesh, axis: &Axis) -> Vec<Vector3<f64>> {
        let inner = self.inner(mesh, axis);
        let bend = |element: usize| {
            let turn = 0.5 * (axis.turn[element] + axis.turn[element + 1]);
            self.bend(mesh, element, &turn.tr_mul(&inner.moment[element]))
        };
        (0..mesh.len() - 1).map(bend).collect()
    }

    /// Forces and moments inside of the blade at a shape.
    pub(super) fn inner(&self, mesh: &Mesh, axis: &Axis) -> Inner {
        let mut beyond = Beyond::default();
        let mut loads = self.loads_by_node(mesh.len());
        let elements = mesh.len() - 1;
        let zeros = || vec![Vector3::zeros(); elements];
        let (mut force, mut half_weight, mut moment) = (zeros(), zeros(), zeros());
        for element in (0..elements).rev() {
            let outer = &mut loads[element + 1];
            beyond.add(&axis.place[element + 1], &outer.0);
            beyond.torque += axis.turn[element + 1].column(2) * outer.1;
            force[element] = beyond.force;
            let middle = 0.5 * (axis.place[element] + axis.place[element + 1]);
            let weight_n = mesh.mass_kg_m[element]
                * mesh.step_m(element)
                * GRAVITY_M_S2
                * self.weight[element];
            let half = Vector3::y() * (-0.5 * weight_n);
            // The outer half of the element's own weight acts beyond its middle.
            beyond.add(&(0.5 * (middle + axis.place[element + 1])), &half);
            moment[element] = beyond.moment(&middle);
            beyond.add(&(0.5 * (middle + axis.place[element])), &half);
            half_weight[element] = half;
        }
        Inner {
            force,
            half_weight,
            moment,
            couple_nm: loads.iter().map(|load| load.1).collect(),
        }
    }

    /// Curvature of an element per moment, 1/(N m^2).
    pub(super) fn compliance(&self, mesh: &Mesh, element: usize) -> Matrix3<f64> {
        let by = |k: usize| mesh.compliance[element][k] * self.soft[k][element];
        by(0) + by(1) + by(2) + by(3)
    }

    fn bend(&self, mesh: &Mesh, element: usize, moment: &Vector3<f64>) -> Vector3<f64> {
        let free = mesh.free[element] * self.prebend + self.free[element];
        free + self.compliance(mesh, element) * moment
    }

    fn loads_by_node(&self, nodes: usize) -> Vec<(Vector3<f64>, f64)> {
        let mut loads = vec![(Vector3::zeros(), 0.0); nodes];
        for ((node, force), couple) in self.forces.iter().zip(&self.couples_nm) {
            loads[*node].0 += force;
            loads[*node].1 += couple;
        }
        loads
    }
}

/// Forces and moments inside of the blade at a shape, world.
#[derive(Debug, Clone)]
pub(super) struct Inner {
    /// Force beyond the outer node of each element, with what acts there, newtons.
    pub force: Vec<Vector3<f64>>,
    /// Half of the weight of each element, newtons.
    pub half_weight: Vec<Vector3<f64>>,
    /// Moment at the middle of each element, newton metres.
    pub moment: Vec<Vector3<f64>>,
    /// Moment about the tangent that acts at each node, newton metres.
    pub couple_nm: Vec<f64>,
}

/// Forces beyond a place and their moment about the origin.
#[derive(Debug, Default)]
struct Beyond {
    force: Vector3<f64>,
    about_origin: Vector3<f64>,
    torque: Vector3<f64>,
}

impl Beyond {
    fn add(&mut self, place: &Vector3<f64>, force: &Vector3<f64>) {
        self.force += force;
        self.about_origin += place.cross(force);
    }

    fn moment(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.about_origin - place.cross(&self.force) + self.torque
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn a_cantilever_under_a_small_load_bends_as_in_the_books() {
        let mesh = Mesh::new(&sample::design(), &[]);
        let tip = mesh.len() - 1;
        let mut physics = Physics::unloaded(&mesh, &[tip]);
        physics.weight.fill(0.0);
        let rest = physics.solve(&mesh, &mesh.free).unwrap();
        physics.forces[0].1 = Vector3::x();
        let bent = physics.solve(&mesh, &mesh.free).unwrap();
        let arm = |e: usize| mesh.length_m() - 0.5 * (mesh.s_m[e] + mesh.s_m[e + 1]);
        // Bending about world y: half edgewise and half flapwise where the sections are turned.
        let part =
            |e: usize| (physics.compliance(&mesh, e))[(1, 1)] * arm(e).powi(2) * mesh.step_m(e);
        let book: f64 = (0..tip).map(part).sum();
        let found = (bent.place[tip] - rest.place[tip]).x;
        assert!(
            (found / book - 1.0).abs() < 0.01,
            "{found} instead of {book}"
        );
    }

    #[test]
    fn loads_that_bend_a_blade_by_half_its_length_settle() {
        let mesh = Mesh::new(&sample::design(), &[30.0]);
        let mut physics = Physics::unloaded(&mesh, &[mesh.node_at(30.0)]);
        physics.forces[0].1 = Vector3::new(4e6, -1e6, -1e6);
        let axis = physics.solve(&mesh, &mesh.free).unwrap();
        let wanted = physics.curvatures(&mesh, &axis);
        for (wanted, found) in wanted.iter().zip(&axis.curvature) {
            assert!((wanted - found).amax() < CONVERGED_RAD_M);
        }
    }
}
