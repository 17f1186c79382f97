//! A hold as the present unknowns have it: the blade at all its instants, and what moves it.

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::axis::{Axis, Field};
use super::family::{self, Response};
use super::mesh::Mesh;
use super::shape::splines;
use super::sight::{Contact, Instant, Section};
use super::sums::{BOTH, MOVES};

/// Time between two shapes of the blade, nanoseconds; linear in between.
const GRID_NS: i64 = 20_000_000;
/// Fewer shapes are not worth another thread.
const SHAPES: usize = 16;

/// Coefficients of cubic splines with knots so far apart over a span of time.
pub fn knots(span_ns: (i64, i64), knot_ns: i64) -> usize {
    ((span_ns.1 - span_ns.0).max(0) / knot_ns) as usize + 4
}

/// The blade of one hold.
#[derive(Debug, Clone)]
pub struct Posed {
    start_ns: i64,
    knot_ns: i64,
    shapes: Vec<Axis>,
    /// Without sway.
    pub still: Axis,
    /// Six numbers per node and unknown: rotation and displacement.
    moves: Vec<[f64; MOVES]>,
    sway_moves: Vec<[f64; MOVES]>,
    unknowns: usize,
    modes: usize,
    knots: usize,
}

/// Times at which sway is wanted: four knots and their weights.
pub type Beat = (usize, [f64; 4]);

impl Posed {
    /// Poses the blade: curvatures without sway, `responses` of the unknowns, `sway` responses with
    /// their coefficients (knots by mode), between two instants.
    pub fn new(
        mesh: &Mesh,
        still: Axis,
        responses: &[Response],
        sway: &[Response],
        coefficients: &[f64],
        span_ns: (i64, i64),
        knot_ns: i64,
    ) -> Self {
        let moves = |all: &[Response]| flat(mesh, &family::fields(mesh, &still, all));
        let knots = knots(span_ns, knot_ns);
        let steps = (span_ns.1 - span_ns.0) / GRID_NS + 2;
        let shape = |step: usize| {
            let (first, weights) = splines((step as i64 * GRID_NS) as f64 / knot_ns as f64, knots);
            let mut curvature = still.curvature.clone();
            for (mode, response) in sway.iter().enumerate() {
                let of = &coefficients[mode * knots..][..knots];
                let amount: f64 = (0..4).map(|k| weights[k] * of[first + k]).sum();
                let parts = curvature.iter_mut().zip(&response.curvature);
                parts.for_each(|(bend, part)| *bend += part * amount);
            }
            Axis::integrate(&still.turn[0], &mesh.s_m, curvature)
        };
        Self {
            start_ns: span_ns.0,
            knot_ns,
            shapes: (0..steps as usize)
                .into_par_iter()
                .with_min_len(SHAPES)
                .map(shape)
                .collect(),
            moves: moves(responses),
            sway_moves: moves(sway),
            unknowns: responses.len(),
            modes: sway.len(),
            knots,
            still,
        }
    }

    /// The blade at an instant.
    pub fn at(&self, time_ns: i64) -> Instant<'_> {
        let last = self.shapes.len() as i64 - 2;
        let step = ((time_ns - self.start_ns) / GRID_NS).clamp(0, last);
        let share = (time_ns - self.start_ns - step * GRID_NS) as f64 / GRID_NS as f64;
        Instant {
            before: &self.shapes[step as usize],
            after: &self.shapes[step as usize + 1],
            share: share.clamp(0.0, 1.0),
        }
    }

    /// How fast a point of the surface moves at an instant, world, metres per second.
    pub fn velocity_m_s(&self, contact: &Contact, time_ns: i64) -> Vector3<f64> {
        self.at(time_ns).way_m(contact) / (GRID_NS as f64 * 1e-9)
    }

    /// The blade without sway.
    pub fn at_rest(&self) -> Instant<'_> {
        Instant {
            before: &self.still,
            after: &self.still,
            share: 0.0,
        }
    }

    /// Knots of the sway at an instant.
    pub fn beat(&self, time_ns: i64) -> Beat {
        splines(
            (time_ns - self.start_ns) as f64 / self.knot_ns as f64,
            self.knots,
        )
    }

    /// How far each unknown of the state moves `along . displacement + about . rotation` of a
    /// section, in the order of the responses.
    pub fn slopes(
        &self,
        section: &Section,
        along: &Vector3<f64>,
        about: &Vector3<f64>,
    ) -> impl Iterator<Item = f64> {
        project(&self.moves, self.unknowns, section, along, about)
    }

    /// The same for the sway, per mode.
    pub fn sway_slopes(
        &self,
        section: &Section,
        along: &Vector3<f64>,
        about: &Vector3<f64>,
    ) -> impl Iterator<Item = f64> {
        project(&self.sway_moves, self.modes, section, along, about)
    }

    /// What some unknowns of the state, by their places among the responses, do to all nodes: a column
    /// per unknown.
    pub fn moves(&self, places: &[usize]) -> DMatrix<f64> {
        let nodes = self.moves.len() / self.unknowns;
        let mut moves = DMatrix::zeros(MOVES * nodes, places.len());
        for (node, of_node) in self.moves.chunks_exact(self.unknowns).enumerate() {
            for (column, place) in places.iter().enumerate() {
                let mut at = moves.fixed_view_mut::<MOVES, 1>(MOVES * node, column);
                at.copy_from_slice(&of_node[*place]);
            }
        }
        moves
    }

    /// Coefficients of the sway per mode.
    pub fn knots(&self) -> usize {
        self.knots
    }
}

/// How the moves of both nodes of a section's element move `along . displacement + about . rotation` of it.
pub fn node_slopes(section: &Section, along: &Vector3<f64>, about: &Vector3<f64>) -> [f64; BOTH] {
    let weights = [about.x, about.y, about.z, along.x, along.y, along.z];
    let shares = [1.0 - section.share, section.share];
    std::array::from_fn(|i| shares[i / MOVES] * weights[i % MOVES])
}

fn flat(mesh: &Mesh, fields: &[Field]) -> Vec<[f64; MOVES]> {
    let at = |node: usize| {
        fields.iter().map(move |field| {
            let (turn, place) = (&field.turn[node], &field.place[node]);
            [turn.x, turn.y, turn.z, place.x, place.y, place.z]
        })
    };
    (0..mesh.len()).flat_map(at).collect()
}

fn project<'a>(
    moves: &'a [[f64; MOVES]],
    count: usize,
    section: &Section,
    along: &Vector3<f64>,
    about: &Vector3<f64>,
) -> impl Iterator<Item = f64> + 'a {
    let inner = &moves[section.node * count..][..count];
    let outer = &moves[(section.node + 1) * count..][..count];
    let slopes = node_slopes(section, along, about);
    inner.iter().zip(outer).map(move |(a, b)| {
        // In the order of the moves, one after the other.
        let (first, second) = slopes.split_at(MOVES);
        let add = |sum: f64, (part, slope): (&f64, &f64)| sum + part * slope;
        let inner = a.iter().zip(first).fold(0.0, add);
        b.iter().zip(second).fold(inner, add)
    })
}
