//! States between the holds: short stretches of time with what the holds told of lidars and surface.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Vector3};

use super::adjust::{Adjustment, Gates, Hold, Problem};
use super::echoes::Seen;
use super::family::{self, Loading};
use super::posed::knots;
use super::rows::Tally;
use crate::error::BeamError;

/// Time between two knots, nanoseconds.
const KNOT_NS: i64 = 100_000_000;
/// Standard deviation of the load against its channel, share of full load.
const LOAD_SHARE: f64 = 0.02;
/// Weight of what the holds on both sides tell of a state's own unknowns: it is known to a fifth.
const OWN_TIGHTNESS: f64 = 25.0;

/// A stretch of time to follow.
#[derive(Debug, Clone)]
pub struct Stretch {
    /// What was seen in it.
    pub seen: Seen,
    /// First and last instant, nanoseconds.
    pub span_ns: (i64, i64),
    /// Load at its knots, share of full load; as many as [`load_knots`] gives.
    pub load: Vec<f64>,
    /// Standard deviations of its sway in the first mode in x and y and in the second, metres at the tip.
    pub sway_m: [f64; 4],
}

/// Instants at which a stretch wants the load: one per knot.
pub fn load_knots(span_ns: (i64, i64)) -> Vec<i64> {
    let count = knots(span_ns, KNOT_NS) as i64;
    (0..count).map(|k| span_ns.0 + (k - 1) * KNOT_NS).collect()
}

impl Adjustment {
    /// The adjustment of one stretch: lidars, surface and what all states share stay as this one found
    /// them; loads, sway and what is its own are free. `loads` are the shares of full load of the holds.
    ///
    /// # Errors
    /// [`BeamError::Unsettled`] where the load has no equilibrium.
    pub fn stretch(&self, stretch: &Stretch, loads: &[f64]) -> Result<Adjustment, BeamError> {
        let middle = stretch.load.iter().sum::<f64>() / stretch.load.len().max(1) as f64;
        let full_n = self.full_forces(loads);
        let hold = Hold {
            seen: stretch.seen.clone(),
            span_ns: stretch.span_ns,
            loading: Loading {
                force_n: self.problem.full_n.iter().map(|f| f * middle).collect(),
                full_n: self.problem.holds[0].loading.full_n,
            },
        };
        let problem = Problem {
            holds: vec![hold],
            full_n,
            mesh: self.problem.mesh.clone(),
            saddles: self.problem.saddles.clone(),
            trust: self.problem.trust,
            shape: self.problem.shape.clone(),
        };
        let mut part = self.blank(problem, &stretch.sway_m);
        self.hand_down(&mut part, stretch, loads, middle);
        part.linearise()?;
        Ok(part)
    }

    /// Full load as the hold with most load shows it, newtons.
    fn full_forces(&self, loads: &[f64]) -> Vec<Vector3<f64>> {
        let most = (0..loads.len()).max_by(|a, b| loads[*a].abs().total_cmp(&loads[*b].abs()));
        let Some(hold) = most.filter(|hold| loads[*hold].abs() > 0.05) else {
            return self.problem.full_n.clone();
        };
        let forces = self.physics(hold).forces;
        forces
            .iter()
            .map(|(_, force)| force / loads[hold])
            .collect()
    }

    /// An adjustment of one hold with this one's lidars and weights, without values.
    fn blank(&self, problem: Problem, sway_m: &[f64; 4]) -> Adjustment {
        let own = family::hold_unknowns(&problem.holds[0].loading, &problem.trust);
        let mut layout = self.layout.clone();
        layout.own = vec![own.len()];
        layout.knots = vec![knots(problem.holds[0].span_ns, KNOT_NS)];
        layout.modes = sway_m.len() + 1;
        let free: Range<usize> = layout.shared..layout.lidar_at(0);
        let mut modes_m = vec![LOAD_SHARE];
        modes_m.extend(sway_m);
        let mut blank = self.like(problem, layout);
        blank.free = free;
        blank.modes_m = modes_m;
        blank.knot_ns = KNOT_NS;
        blank.follows_load = true;
        blank.own = vec![own];
        blank
    }

    /// Values of this adjustment for the part: what is shared, and what lies between its holds.
    fn hand_down(&self, part: &mut Adjustment, stretch: &Stretch, loads: &[f64], middle: f64) {
        let shared = self.layout.shared;
        part.values
            .rows_mut(0, shared)
            .copy_from(&self.values.rows(0, shared));
        let (from, to) = (self.layout.shape_at(), part.layout.shape_at());
        let count = self.layout.shape + 1; // the edge angle stands behind the surface
        part.values
            .rows_mut(to, count)
            .copy_from(&self.values.rows(from, count));
        let (low, high, share) = neighbours(loads, middle);
        for lidar in 0..self.layout.channels.len() {
            for side in 0..2 {
                let of = |hold| self.values[self.layout.edge_offset_at(hold, lidar, side)];
                let at = part.layout.edge_offset_at(0, lidar, side);
                part.values[at] = of(low) * (1.0 - share) + of(high) * share;
            }
        }
        let first = part.layout.own_at(0);
        for (k, unknown) in part.own[0].iter().enumerate() {
            let of =
                |hold: usize| self.values[self.layout.own_at(hold) + k] * self.own[hold][k].sigma;
            let value = of(low) * (1.0 - share) + of(high) * share;
            part.values[first + k] = value / unknown.sigma;
            part.tightness[first + k] = OWN_TIGHTNESS;
        }
        let sway = part.layout.sway_at(0);
        for (k, load) in stretch.load.iter().take(part.layout.knots[0]).enumerate() {
            part.values[sway + k] = (load - middle) / LOAD_SHARE;
        }
        part.expected = part.values.clone();
    }

    /// What became of the data, and states at instants: per instant and section x, y, z in metres and
    /// the twist in rad since the first hold of `reference`, and the variances from noise alone.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn follow(
        &mut self,
        reference: &Adjustment,
        s_m: &[f64],
        times_ns: &[i64],
        gates: &[Gates],
    ) -> Result<Followed, BeamError> {
        let mut tally = Tally::default();
        for gate in gates {
            tally = self.step(gate)?.tallies.pop().unwrap_or_default();
        }
        let last = gates[gates.len() - 1];
        let factor = self.normal(&last).0.solve().ok_or(BeamError::Singular)?.1;
        let mut found = Followed {
            tally,
            values: Vec::new(),
            variances: Vec::new(),
        };
        for time_ns in times_ns {
            let (values, rows) = self.states_at(reference, 0, s_m, *time_ns);
            let free = rows.rows(self.free.start, self.free.len()).into_owned();
            let spread = factor.solve(&free);
            let variance = |k: usize| free.column(k).dot(&spread.column(k));
            found
                .variances
                .extend((0..s_m.len()).map(|i| [0, 1, 2, 3].map(|k| variance(4 * i + k))));
            found.values.extend(values);
        }
        Ok(found)
    }

    /// States of sections of one hold at an instant and their slopes by all unknowns.
    pub fn states_at(
        &self,
        reference: &Adjustment,
        hold: usize,
        s_m: &[f64],
        time_ns: i64,
    ) -> (Vec<[f64; 4]>, DMatrix<f64>) {
        let (posed, rest) = (self.posed(hold), reference.posed(0));
        let mut rows = DMatrix::zeros(self.layout.len(), 4 * s_m.len());
        let mut values = Vec::with_capacity(s_m.len());
        for (i, s) in s_m.iter().enumerate() {
            let place = self.place_at(&posed, hold, *s, Some(time_ns));
            let rest = reference.place_at(&rest, 0, *s, None);
            values.push(self.fill_state(&mut rows, 4 * i, &posed, hold, &place, &rest));
        }
        (values, rows)
    }
}

/// States of a stretch.
#[derive(Debug, Clone)]
pub struct Followed {
    /// What became of the data in the last step.
    pub tally: Tally,
    /// By instant and section: x, y, z in metres, twist in rad.
    pub values: Vec<[f64; 4]>,
    /// Their variances.
    pub variances: Vec<[f64; 4]>,
}

/// Holds whose loads lie on both sides of a load, and the share of the way between them.
pub fn neighbours(loads: &[f64], load: f64) -> (usize, usize, f64) {
    let mut order: Vec<usize> = (0..loads.len()).collect();
    order.sort_by(|a, b| loads[*a].total_cmp(&loads[*b]));
    let above = order.iter().position(|hold| loads[*hold] >= load);
    match above {
        None => (order[order.len() - 1], order[order.len() - 1], 0.0),
        Some(0) => (order[0], order[0], 0.0),
        Some(k) => {
            let (low, high) = (order[k - 1], order[k]);
            let reach = (loads[high] - loads[low]).max(1e-9);
            (low, high, ((load - loads[low]) / reach).clamp(0.0, 1.0))
        }
    }
}

/// An empty vector of unknowns for a layout.
pub(super) fn zeros(length: usize) -> DVector<f64> {
    DVector::zeros(length)
}
