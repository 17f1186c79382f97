//! A clamped rod under dead loads: curvatures that its moments ask for at the shape they make.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::axis::Axis;
use super::mesh::Mesh;

const GRAVITY_M_S2: f64 = 9.81;
/// Share of the step towards what the moments ask for; a whole step overshoots under large bends.
const RELAXATION: f64 = 0.6;
/// Smallest share of the step; a share that does not bring it nearer is made smaller.
const SLOWEST: f64 = 0.05;
const MAX_STEPS: usize = 600;
/// Largest change of any curvature in the last step, rad/m.
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
        let (mut relaxation, mut last) = (RELAXATION, f64::INFINITY);
        for _ in 0..MAX_STEPS {
            let wanted = self.curvatures(mesh, &axis);
            let mut largest: f64 = 0.0;
            let mix = |(now, wanted): (&Vector3<f64>, Vector3<f64>)| {
                let change = wanted - now;
                largest = largest.max(change.amax());
                now + change * relaxation
            };
            let next = axis.curvature.iter().zip(wanted).map(mix).collect();
            axis = Axis::integrate(&root, &mesh.s_m, next);
            if !largest.is_finite() {
                return None;
            }
            if largest < CONVERGED_RAD_M {
                return Some(axis);
            }
            if largest > 0.9 * last {
                relaxation = (0.7 * relaxation).max(SLOWEST);
            }
            last = largest;
        }
        None
    }

    /// Curvatures of the elements by the moments at a shape.
    fn curvatures(&self, mesh: &Mesh, axis: &Axis) -> Vec<Vector3<f64>> {
        let mut beyond = Beyond::default();
        let mut curvatures = vec![Vector3::zeros(); mesh.len() - 1];
        let mut loads = self.loads_by_node(mesh.len());
        for element in (0..mesh.len() - 1).rev() {
            let outer = &mut loads[element + 1];
            beyond.add(&axis.place[element + 1], &outer.0);
            beyond.torque += axis.turn[element + 1].column(2) * outer.1;
            let middle = 0.5 * (axis.place[element] + axis.place[element + 1]);
            let weight_n = mesh.mass_kg_m[element]
                * mesh.step_m(element)
                * GRAVITY_M_S2
                * self.weight[element];
            let half = Vector3::y() * (-0.5 * weight_n);
            // The outer half of the element's own weight acts beyond its middle.
            beyond.add(&(0.5 * (middle + axis.place[element + 1])), &half);
            let turn = 0.5 * (axis.turn[element] + axis.turn[element + 1]);
            let moment = turn.tr_mul(&beyond.moment(&middle));
            curvatures[element] = self.bend(mesh, element, &moment);
            beyond.add(&(0.5 * (middle + axis.place[element])), &half);
        }
        curvatures
    }

    fn bend(&self, mesh: &Mesh, element: usize, moment: &Vector3<f64>) -> Vector3<f64> {
        let by = |k: usize| mesh.compliance[element][k] * moment * self.soft[k][element];
        mesh.free[element] * self.prebend + self.free[element] + by(0) + by(1) + by(2) + by(3)
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
