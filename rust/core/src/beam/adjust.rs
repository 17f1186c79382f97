//! One adjustment of all holds: states, surface, lidars and edges from rays, edges and what is known.

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::axis::Axis;
use super::echoes::Seen;
use super::equilibrium::Physics;
use super::family::{self, Kind, Loading, Response, Trust, Unknown};
use super::layout::Layout;
use super::mesh::Mesh;
use super::normal::Normal;
use super::posed::{Posed, knots};
use super::rig::{Lidar, Rig};
use super::rows::{Rows, Tally, Weights};
use super::shape::Shape;
use crate::error::BeamError;

/// Standard deviations of the sway in its first and second mode, metres at the tip.
const SWAY_M: [f64; 2] = [0.05, 0.015];
/// Standard deviation of how far edges lie outside of the silhouette, rad.
pub const EDGE_RAD: f64 = 1e-3;
/// The same of one hold, lidar and side against all, rad.
pub const EDGE_OFFSET_RAD: f64 = 1e-4;

/// Inverse variance of what is held, against 1 of what is free.
const HELD: f64 = 1e6;

/// A hold as it enters the adjustment.
#[derive(Debug, Clone)]
pub struct Hold {
    /// What was seen in it.
    pub seen: Seen,
    /// First and last instant, nanoseconds.
    pub span_ns: (i64, i64),
    /// Loads as they are thought to be.
    pub loading: Loading,
}

/// Everything that does not change during an adjustment.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The blade.
    pub mesh: Mesh,
    /// Nodes where load enters.
    pub saddles: Vec<usize>,
    /// How well the blade is known.
    pub trust: Trust,
    /// Its surface.
    pub shape: Shape,
    /// The holds in time order.
    pub holds: Vec<Hold>,
}

/// How far from the model data may lie while it is still being found, metres.
#[derive(Debug, Clone, Copy)]
pub struct Gates {
    /// Of echoes along their ray.
    pub echo_m: f64,
    /// Of edges across it.
    pub edge_m: f64,
    /// Whether lidars and surface may change: not before the blade is found, or saddles bend them.
    pub is_free: bool,
}

/// A state of which the neighbours are known.
#[derive(Debug, Clone)]
struct Linear {
    curvature: Vec<Vector3<f64>>,
    values: DVector<f64>,
    responses: Vec<Response>,
    sway: Vec<Response>,
}

/// The unknowns as estimated so far.
#[derive(Debug, Clone)]
pub struct Adjustment {
    /// What it works on.
    pub problem: Problem,
    /// Where each unknown stands.
    pub layout: Layout,
    /// The lidars.
    pub rig: Rig,
    /// All unknowns but the lidars', in standard deviations.
    pub values: DVector<f64>,
    /// How data are weighted.
    pub weights: Weights,
    shared: Vec<Unknown>,
    own: Vec<Vec<Unknown>>,
    linear: Vec<Linear>,
}

/// What one iteration did.
#[derive(Debug, Clone)]
pub struct Step {
    /// Largest change of an unknown of the blade, standard deviations.
    pub largest: f64,
    /// What became of the data, by hold.
    pub tallies: Vec<Tally>,
}

impl Adjustment {
    /// Starts from the loads as they are thought to be.
    ///
    /// # Errors
    /// [`BeamError::Unsettled`] where a load has no equilibrium.
    pub fn new(problem: Problem, rig: Rig, weights: Weights) -> Result<Self, BeamError> {
        let shared = family::shared_unknowns(&problem.trust);
        let own = |hold: &Hold| family::hold_unknowns(&hold.loading, &problem.trust);
        let own: Vec<Vec<Unknown>> = problem.holds.iter().map(own).collect();
        let span = |hold: &Hold| knots(hold.span_ns.1 - hold.span_ns.0);
        let layout = Layout {
            shared: shared.len(),
            own: own.iter().map(Vec::len).collect(),
            knots: problem.holds.iter().map(span).collect(),
            modes: 2 * SWAY_M.len(),
            channels: rig.channels.clone(),
            shape: problem.shape.len(),
        };
        let mut adjustment = Self {
            values: DVector::zeros(layout.len()),
            layout,
            rig,
            weights,
            shared,
            own,
            linear: Vec::new(),
            problem,
        };
        adjustment.linearise()?;
        Ok(adjustment)
    }

    /// Solves the equilibria of all holds anew and how their neighbours differ.
    ///
    /// # Errors
    /// [`BeamError::Unsettled`] where a load has no equilibrium.
    pub fn linearise(&mut self) -> Result<(), BeamError> {
        let holds = 0..self.problem.holds.len();
        let all: Option<Vec<Linear>> =
            holds.into_par_iter().map(|hold| self.linear_of(hold)).collect();
        self.linear = all.ok_or(BeamError::Unsettled)?;
        Ok(())
    }

    fn linear_of(&self, hold: usize) -> Option<Linear> {
        let mesh = &self.problem.mesh;
        let physics = self.physics(hold);
        let start = match self.linear.get(hold) {
            Some(linear) => linear.curvature.clone(),
            None => mesh.free.clone(),
        };
        let at = physics.solve(mesh, &start)?;
        let mut responses = family::responses(mesh, &physics, &at, &self.shared)?;
        responses.extend(self.own_responses(hold, &physics, &at, &responses)?);
        Some(Linear {
            sway: family::sway_responses(mesh, &at),
            curvature: at.curvature,
            values: self.state(hold),
            responses,
        })
    }

    /// Responses of a hold's own unknowns; those of the stiffness are the shared ones scaled.
    fn own_responses(&self, hold: usize, physics: &Physics, at: &Axis, shared: &[Response]) -> Option<Vec<Response>> {
        let respond = |unknown: &Unknown| {
            let same = self.shared.iter().position(|s| s.kind == unknown.kind);
            if let Some(place) = same.filter(|_| matches!(unknown.kind, Kind::Soft { .. })) {
                let scale = unknown.sigma / self.shared[place].sigma;
                return Some(shared[place].scaled(scale));
            }
            family::responses(&self.problem.mesh, physics, at, &[*unknown])?.pop()
        };
        self.own[hold].iter().map(respond).collect()
    }

    fn physics(&self, hold: usize) -> Physics {
        let problem = &self.problem;
        let mut physics = Physics::unloaded(&problem.mesh, &problem.saddles);
        for (place, force) in physics.forces.iter_mut().zip(&problem.holds[hold].loading.force_n) {
            place.1 += force;
        }
        let state = self.state(hold);
        let unknowns = self.shared.iter().chain(&self.own[hold]);
        for (unknown, value) in unknowns.zip(state.iter()) {
            family::add(&mut physics, &problem.mesh, unknown.kind, unknown.sigma * value);
        }
        physics
    }

    /// Shared and own unknowns of a hold.
    fn state(&self, hold: usize) -> DVector<f64> {
        let own = self.values.rows(self.layout.own_at(hold), self.layout.own[hold]);
        let shared = self.values.rows(0, self.layout.shared);
        let both = shared.iter().chain(own.iter()).copied();
        DVector::from_iterator(self.layout.shared + self.layout.own[hold], both)
    }

    /// Numbers of the unknowns of a hold's state, in the order of its responses.
    pub fn state_at(&self, hold: usize) -> Vec<usize> {
        let own = self.layout.own_at(hold);
        (0..self.layout.shared).chain(own..own + self.layout.own[hold]).collect()
    }

    /// The blade of a hold as estimated so far.
    pub fn posed(&self, hold: usize) -> Posed {
        let (linear, problem) = (&self.linear[hold], &self.problem);
        let change = self.state(hold) - &linear.values;
        let mut curvature = linear.curvature.clone();
        let mut root = Vector3::zeros();
        for (response, amount) in linear.responses.iter().zip(change.iter()) {
            let parts = curvature.iter_mut().zip(&response.curvature);
            parts.for_each(|(bend, part)| *bend += part * *amount);
        }
        for (response, amount) in linear.responses.iter().zip(self.state(hold).iter()) {
            root += response.root_rad * *amount;
        }
        let turn = nalgebra::Rotation3::from_scaled_axis(root).matrix() * problem.mesh.root;
        let still = Axis::integrate(&turn, &problem.mesh.s_m, curvature);
        let at = self.layout.sway_at(hold);
        let coefficients: Vec<f64> = (0..self.layout.modes * self.layout.knots[hold])
            .map(|k| self.values[at + k] * sway_m(k / self.layout.knots[hold]))
            .collect();
        let span = problem.holds[hold].span_ns;
        Posed::new(&problem.mesh, still, &linear.responses, &linear.sway, &coefficients, span)
    }

    /// One step of Gauss and Newton with data inside of the gates.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn step(&mut self, gates: &Gates) -> Result<Step, BeamError> {
        let (normal, tallies) = self.normal(gates);
        let (step, _) = normal.solve().ok_or(BeamError::Singular)?;
        self.values += &step;
        let (rig, count) = (self.layout.lidar_at(0), self.layout.rig_len());
        self.rig.values += step.rows(rig, count);
        self.values.rows_mut(rig, count).fill(0.0);
        let largest = step.rows(0, rig).amax();
        self.weights.learn(&tallies);
        Ok(Step { largest, tallies })
    }

    /// Normal equations at the present unknowns, with what became of the data.
    pub fn normal(&self, gates: &Gates) -> (Normal, Vec<Tally>) {
        let lidars: Vec<Lidar> = (0..self.rig.poses.len()).map(|l| self.rig.lidar(l)).collect();
        let parts: Vec<(Normal, Tally)> = (0..self.problem.holds.len())
            .into_par_iter()
            .map(|hold| Rows::new(self, hold, &lidars, gates).collect())
            .collect();
        let mut sum = self.prior(gates.is_free);
        let mut tallies = Vec::new();
        for (normal, tally) in parts {
            sum.join(&normal);
            tallies.push(tally);
        }
        (sum, tallies)
    }

    /// What is known before the data.
    fn prior(&self, is_free: bool) -> Normal {
        let mut prior = Normal::new(self.layout.len());
        let (rig, count) = (self.layout.lidar_at(0), self.layout.rig_len());
        for i in 0..self.layout.len() {
            let is_held = !is_free && i >= rig;
            prior.matrix[(i, i)] = if is_held { HELD } else { 1.0 };
            prior.right[i] = -self.values[i];
        }
        prior.matrix.view_mut((rig, rig), (count, count)).copy_from(&self.rig.information);
        let pull = &self.rig.information * (&self.rig.prior - &self.rig.values);
        prior.right.rows_mut(rig, count).copy_from(&pull);
        if !is_free {
            (rig..rig + count).for_each(|i| prior.matrix[(i, i)] += HELD * prior.matrix[(i, i)]);
        }
        prior
    }
}

/// Standard deviation of a mode of the sway, metres at the tip.
pub fn sway_m(mode: usize) -> f64 {
    SWAY_M[mode / 2]
}

impl Response {
    /// The response to another standard deviation.
    fn scaled(&self, scale: f64) -> Self {
        Self {
            curvature: self.curvature.iter().map(|bend| bend * scale).collect(),
            root_rad: self.root_rad * scale,
        }
    }
}
