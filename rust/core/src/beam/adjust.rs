//! One adjustment of all holds: states, surface, lidars and edges from rays, edges and what is known.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::axis::Axis;
use super::clocks::Clocks;
use super::descend::Caution;
use super::echoes::Seen;
use super::equilibrium::Physics;
use super::family::{self, Equilibrium, Kind, Loading, Response, Trust, Unknown};
use super::layout::Layout;
use super::mesh::Mesh;
use super::normal::Normal;
use super::pairs::Knotted;
use super::posed::{Posed, knots};
use super::rig::{Lidar, Rig};
use super::rows::Rows;
use super::shape::Shape;
use super::sums::Part;
use super::track::zeros;
use super::weights::{Tally, Weights};
use crate::error::BeamError;

/// Standard deviations of the sway in its first mode in x and y and in its second, metres at the tip.
const SWAY_M: [f64; 4] = [0.05, 0.05, 0.015, 0.015];
/// Time between two knots of the sway in a hold, nanoseconds.
const KNOT_NS: i64 = 200_000_000;
/// Standard deviation of how far edges lie outside of the silhouette, rad.
pub const EDGE_RAD: f64 = 3e-4;
/// How far they do, as beams of 1 to 3 mrad have it, rad.
const EDGE_EXPECTED_RAD: f64 = 4e-4;
/// The same of one hold, lidar and side against all, rad.
pub const EDGE_OFFSET_RAD: f64 = 1e-4;
/// Standard deviations of the range errors of a lidar on the blade: what blade and yard differ by, for
/// they are not equally bright, and what grows with 1 / cos(incidence) - 1; metres.
pub const RANGE_M: [f64; 2] = [0.002, 0.002];

/// Data are taken for no better than this share of the gate while the gate is wide: they are many, and
/// what they have in common would bend the loads.
const COARSE: f64 = 0.3;

/// Gate of echoes from which on data count for what they are, metres.
const FINE_M: f64 = 0.05;

/// A hold as it enters the adjustment.
#[derive(Debug, Clone)]
pub struct Hold {
    /// What was seen in it.
    pub seen: Arc<Seen>,
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
    /// Force of full load at each saddle, newtons, world.
    pub full_n: Vec<Vector3<f64>>,
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
    /// What may change.
    pub stage: Stage,
}

/// What may change while the blade is being found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Forces and weight alone: nothing else can bring a blade that is metres away nearer.
    Loads,
    /// The blade and where the lidars stand, not yet their ranges and the surface, or saddles would bend them.
    Blade,
    /// Its surface as well.
    Surface,
    /// Everything.
    All,
}

/// A state of which the neighbours are known.
#[derive(Debug, Clone)]
struct Linear {
    curvature: Vec<Vector3<f64>>,
    values: DVector<f64>,
    responses: Vec<Response>,
    sway: Vec<Response>,
}

/// Where an adjustment stood.
#[derive(Debug, Clone)]
pub(super) struct Spot {
    values: DVector<f64>,
    rig: DVector<f64>,
    linear: Vec<Linear>,
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
    /// Which unknowns are solved for.
    pub free: Range<usize>,
    /// Of which unknowns normal equations have rows: those solved for among them.
    pub(super) asked: Range<usize>,
    /// Standard deviation of each mode in time, in its own unit.
    pub modes_m: Vec<f64>,
    /// Expected values before the data, in standard deviations, and their weights.
    pub(super) expected: DVector<f64>,
    pub(super) tightness: DVector<f64>,
    /// Time between two knots, nanoseconds.
    pub(super) knot_ns: i64,
    /// Whether the first mode in time is the load.
    pub(super) follows_load: bool,
    /// What is known of the clocks in stretches between holds, where that is more than in them.
    pub clocks: Option<Clocks>,
    /// Whether the mean of the clocks is held.
    pub(super) ties_clocks: bool,
    /// Lidars and sides whose edges do not count.
    pub(super) muted: Vec<(usize, usize)>,
    pub(super) shared: Vec<Unknown>,
    pub(super) own: Vec<Vec<Unknown>>,
    linear: Vec<Linear>,
    /// The blade before the surface's unknowns; `problem.mesh` is what they make of it.
    drawn: Mesh,
    pub(super) last_step: DVector<f64>,
    /// How far the next step is held back, see [`super::descend`].
    pub(super) caution: Caution,
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
        let span = |hold: &Hold| knots(hold.span_ns, KNOT_NS);
        let layout = Layout {
            shared: shared.len(),
            own: own.iter().map(Vec::len).collect(),
            knots: problem.holds.iter().map(span).collect(),
            modes: SWAY_M.len(),
            channels: rig.channels.clone(),
            shape: problem.shape.len(),
        };
        let mut adjustment = Self {
            values: DVector::zeros(layout.len()),
            last_step: DVector::zeros(layout.len()),
            expected: DVector::zeros(layout.len()),
            tightness: DVector::repeat(layout.len(), 1.0),
            free: 0..layout.len(),
            asked: 0..layout.len(),
            modes_m: SWAY_M.to_vec(),
            knot_ns: KNOT_NS,
            follows_load: false,
            muted: Vec::new(),
            clocks: None,
            ties_clocks: false,
            layout,
            rig,
            weights,
            shared,
            own,
            caution: Caution::new(0.0),
            linear: Vec::new(),
            drawn: problem.mesh.clone(),
            problem,
        };
        let edge = adjustment.layout.edge_at();
        adjustment.expected[edge] = EDGE_EXPECTED_RAD / EDGE_RAD;
        adjustment.linearise()?;
        Ok(adjustment)
    }

    /// Solves the equilibria of all holds anew and how their neighbours differ.
    ///
    /// # Errors
    /// [`BeamError::Unsettled`] where a load has no equilibrium.
    pub fn linearise(&mut self) -> Result<(), BeamError> {
        let holds = 0..self.problem.holds.len();
        let all: Option<Vec<Linear>> = holds
            .into_par_iter()
            .map(|hold| self.linear_of(hold))
            .collect();
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
        let equilibrium = Equilibrium::new(mesh, &physics, &at)?;
        let shared = self.shared.iter();
        let mut responses: Vec<_> = shared.map(|u| equilibrium.response(u)).collect();
        responses.extend(self.own_responses(hold, &equilibrium, &responses));
        let mut sway = family::sway_responses(mesh, &at);
        if self.follows_load {
            let load = Unknown {
                kind: Kind::Load,
                sigma: 1.0,
            };
            sway.insert(0, equilibrium.response(&load));
        }
        Some(Linear {
            sway,
            curvature: at.curvature,
            values: self.state(hold),
            responses,
        })
    }

    /// Responses of a hold's own unknowns; those of the stiffness are the shared ones scaled.
    fn own_responses(
        &self,
        hold: usize,
        equilibrium: &Equilibrium<'_>,
        shared: &[Response],
    ) -> Vec<Response> {
        let same = |unknown: &Unknown| {
            let is_stiffness = matches!(unknown.kind, Kind::Soft { .. });
            let place = self.shared.iter().position(|s| s.kind == unknown.kind);
            place.filter(|_| is_stiffness)
        };
        let respond = |unknown: &Unknown| match same(unknown) {
            Some(place) => shared[place].scaled(unknown.sigma / self.shared[place].sigma),
            None => equilibrium.response(unknown),
        };
        self.own[hold].iter().map(respond).collect()
    }

    /// Everything that bends the blade in a hold, as estimated so far.
    pub(super) fn physics(&self, hold: usize) -> Physics {
        let problem = &self.problem;
        let mut physics = Physics::unloaded(&problem.mesh, &problem.saddles);
        for (place, force) in physics
            .forces
            .iter_mut()
            .zip(&problem.holds[hold].loading.force_n)
        {
            place.1 += force;
        }
        physics.full.clone_from(&problem.full_n);
        let state = self.state(hold);
        let unknowns = self.shared.iter().chain(&self.own[hold]);
        for (unknown, value) in unknowns.zip(state.iter()) {
            family::add(
                &mut physics,
                &problem.mesh,
                unknown.kind,
                unknown.sigma * value,
            );
        }
        physics
    }

    /// Another problem with these lidars and weights, without values.
    pub(super) fn like(&self, problem: Problem, layout: Layout) -> Self {
        Self {
            values: zeros(layout.len()),
            last_step: zeros(layout.len()),
            expected: zeros(layout.len()),
            tightness: DVector::repeat(layout.len(), 1.0),
            linear: Vec::new(),
            weights: Weights {
                noise_m: self.weights.noise_m.clone(),
                common: Vec::new(),
                learned: 0,
                ..self.weights
            },
            problem,
            layout,
            rig: self.rig.clone(),
            free: self.free.clone(),
            asked: self.asked.clone(),
            modes_m: self.modes_m.clone(),
            muted: self.muted.clone(),
            clocks: None,
            shared: self.shared.clone(),
            own: self.own.clone(),
            drawn: self.drawn.clone(),
            ..*self
        }
    }

    /// Changes one unknown: those of the lidars in their own unit, others in standard deviations.
    pub fn shift(&mut self, unknown: usize, change: f64) {
        let (rig, count) = (self.layout.lidar_at(0), self.layout.rig_len());
        if (rig..rig + count).contains(&unknown) {
            self.rig.values[unknown - rig] += change;
        } else {
            self.values[unknown] += change;
            self.build();
        }
    }

    /// Solves for these unknowns from now on, and asks for no others.
    pub(super) fn solve_for(&mut self, unknowns: Range<usize>) {
        self.asked = unknowns.clone();
        self.free = unknowns;
    }

    /// Where the adjustment stands, to come back to.
    pub(super) fn spot(&self) -> Spot {
        Spot {
            values: self.values.clone(),
            rig: self.rig.values.clone(),
            linear: self.linear.clone(),
        }
    }

    /// Comes back to where the adjustment stood.
    pub(super) fn return_to(&mut self, spot: Spot) {
        self.values = spot.values;
        self.rig.values = spot.rig;
        self.linear = spot.linear;
        self.build();
    }

    /// Brings the surface to its unknowns.
    pub(super) fn build(&mut self) {
        let values = self.values.rows(self.layout.shape_at(), self.layout.shape);
        self.problem.mesh = self.problem.shape.built(&self.drawn, values.as_slice());
    }

    /// What the clock of a lidar is behind the one that all share, seconds.
    pub fn clock_s(&self, lidar: usize) -> f64 {
        self.values[self.layout.clock_at(lidar)] * self.rig.clock_s[lidar]
    }

    /// How a hold answers to its unknowns, shared ones first.
    pub(super) fn responses(&self, hold: usize) -> &[Response] {
        &self.linear[hold].responses
    }

    /// Shared and own unknowns of a hold.
    fn state(&self, hold: usize) -> DVector<f64> {
        let own = self
            .values
            .rows(self.layout.own_at(hold), self.layout.own[hold]);
        let shared = self.values.rows(0, self.layout.shared);
        let both = shared.iter().chain(own.iter()).copied();
        DVector::from_iterator(self.layout.shared + self.layout.own[hold], both)
    }

    /// Numbers of the unknowns of a hold's state, in the order of its responses.
    pub fn state_at(&self, hold: usize) -> Vec<usize> {
        let own = self.layout.own_at(hold);
        (0..self.layout.shared)
            .chain(own..own + self.layout.own[hold])
            .collect()
    }

    /// Unknowns that data of a hold tell of beside those of its state.
    pub(super) fn touched_at(&self, hold: usize) -> impl Iterator<Item = usize> {
        let layout = &self.layout;
        let sway = layout.sway_at(hold)..layout.sway_at(hold + 1);
        let edges = layout.edge_offset_at(hold, 0, 0)..layout.edge_offset_at(hold + 1, 0, 0);
        let strain = layout.len() + hold;
        sway.chain(layout.clock_at(0)..layout.edge_at() + 1)
            .chain(edges)
            .chain(layout.range_at(0)..layout.len())
            .chain([strain])
    }

    /// The waves of the surface.
    pub(super) fn waves(&self) -> Knotted {
        self.problem.shape.wave_knots(self.layout.shape_at())
    }

    /// The axis of a hold without sway, by the slopes of the last equilibrium.
    pub(super) fn still(&self, hold: usize) -> Axis {
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
        Axis::integrate(&turn, &problem.mesh.s_m, curvature)
    }

    /// The blade of a hold as estimated so far.
    pub fn posed(&self, hold: usize) -> Posed {
        let (linear, problem) = (&self.linear[hold], &self.problem);
        let still = self.still(hold);
        let at = self.layout.sway_at(hold);
        let coefficients: Vec<f64> = (0..self.layout.modes * self.layout.knots[hold])
            .map(|k| self.values[at + k] * self.modes_m[k / self.layout.knots[hold]])
            .collect();
        let span = problem.holds[hold].span_ns;
        Posed::new(
            &problem.mesh,
            still,
            &linear.responses,
            &linear.sway,
            &coefficients,
            span,
            self.knot_ns,
        )
    }

    /// The lidars as estimated so far.
    pub(super) fn lidars(&self) -> Vec<Lidar> {
        let all = 0..self.rig.poses.len();
        all.map(|lidar| self.rig.lidar(lidar)).collect()
    }

    /// Normal equations at the present unknowns, with what became of the data.
    pub fn normal(&self, gates: &Gates) -> (Normal, Vec<Tally>) {
        let lidars = self.lidars();
        let of = |hold| Rows::new(self, hold, &lidars, gates).collect();
        let holds = (0..self.problem.holds.len()).into_par_iter();
        let (parts, mut sum) = rayon::join(
            || holds.map(of).collect::<Vec<_>>(),
            || self.prior(gates.stage),
        );
        let (parts, tallies): (Vec<Part>, Vec<Tally>) = parts.into_iter().unzip();
        parts.iter().for_each(|part| sum.join(part));
        (sum, tallies)
    }
}

impl Gates {
    /// Whether residuals within them tell of the data, not of a blade that is elsewhere.
    pub fn is_fine(&self) -> bool {
        self.echo_m <= FINE_M
    }

    /// Whether the blade is still being found.
    pub fn is_search(&self) -> bool {
        self.stage < Stage::All
    }

    /// Standard deviation below which no echo and no edge is taken to be, metres.
    pub fn coarse_m(&self) -> [f64; 2] {
        match self.is_fine() {
            true => [0.0; 2],
            false => [COARSE * self.echo_m, COARSE * self.edge_m],
        }
    }
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
