//! States between the holds: short stretches of time with what the holds told of lidars and surface.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Vector3};

use super::adjust::{Adjustment, Gates, Hold, Problem};
use super::carry::{Knowledge, Spread};
use super::clocks::ClockNews;
use super::echoes::Seen;
use super::family::{self, Loading};
use super::layout::RANGES;
use super::normal::Normal;
use super::posed::{Posed, knots};
use super::sections::{Place, Rests};
use super::weights::Tally;
use crate::error::BeamError;

/// Time between two knots, nanoseconds.
const KNOT_NS: i64 = 50_000_000;
/// Standard deviation of the load against its channel, share of full load.
const LOAD_SHARE: f64 = 0.02;
/// At most so many echoes of a stretch are used: what the holds told of lidars and surface leaves more unsure
/// than their noise. Its edges are few, and all of them are.
const ECHOES: usize = 4000;
/// Weight of what the holds on both sides tell of a state's own unknowns: it is known to a fifth.
const OWN_TIGHTNESS: f64 = 25.0;

/// A stretch of time to follow.
#[derive(Debug, Clone)]
pub struct Stretch {
    /// What was seen in it.
    pub seen: Arc<Seen>,
    /// First and last instant, nanoseconds.
    pub span_ns: (i64, i64),
    /// Load at its knots, share of full load; as many as [`load_knots`] gives.
    pub load: Vec<f64>,
    /// Standard deviations of its sway in the first mode in x and y and in the second, metres at the tip.
    pub sway_m: [f64; 4],
}

impl Stretch {
    /// Mean load, share of full load.
    fn middle(&self) -> f64 {
        self.load.iter().sum::<f64>() / self.load.len().max(1) as f64
    }

    /// Where its load lies among those of the holds, see [`neighbours`].
    pub fn between(&self, loads: &[f64]) -> (usize, usize, f64) {
        neighbours(loads, self.middle())
    }
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
        let middle = stretch.middle();
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
        blank.solve_for(free);
        blank.weights.echoes = blank.weights.echoes.min(ECHOES);
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
        let ranges = RANGES * self.layout.channels.len();
        part.values
            .rows_mut(part.layout.range_at(0), ranges)
            .copy_from(&self.values.rows(self.layout.range_at(0), ranges));
        let (low, high, share) = neighbours(loads, middle);
        let loose = self.loose_edges().into_iter();
        let loose = loose.filter(|found| [low, high].contains(&found.0));
        part.muted = loose.map(|(_, lidar, side, _)| (lidar, side)).collect();
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
        if let Some(clocks) = &self.clocks {
            part.set_clocks(clocks);
        }
    }

    /// What became of the data, and states at instants: per instant and section x, y, z in metres and
    /// the twist in rad since the first hold of `reference`, and how well they are known by what it
    /// knows and by the data of the stretch. `between` is where the load lies, see [`neighbours`].
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn follow(
        &mut self,
        reference: (&Adjustment, &Knowledge),
        between: (usize, usize, f64),
        times_ns: &[i64],
        gates: &[Gates],
    ) -> Result<Followed, BeamError> {
        for gate in &gates[..gates.len() - 1] {
            self.slope_step(gate)?;
        }
        // What else the states answer to is asked only for states.
        let asked = match times_ns.is_empty() {
            true => self.free.clone(),
            false => 0..self.layout.len(),
        };
        self.asked = asked;
        let (normal, tally) = self.last_step(&gates[gates.len() - 1])?;
        let factor = self.free_factor(&normal)?;
        let known = factor.inverse();
        let (knowledge, posed) = (reference.1, self.posed(0));
        let at = |time_ns: i64| self.states_at(&knowledge.rests, &posed, 0, time_ns);
        let told = match times_ns.get(times_ns.len() / 2) {
            Some(time_ns) => {
                let rows = at(*time_ns).1;
                reference
                    .0
                    .inherited(self, knowledge, between, (&normal.matrix, &factor), &rows)
            }
            None => Vec::new(),
        };
        let mut found = Followed {
            clocks: self.clock_news(&known),
            tally,
            values: Vec::new(),
            spreads: Vec::new(),
        };
        for time_ns in times_ns {
            let (values, rows) = at(*time_ns);
            let noise = self.noise(&known, &rows);
            let parts = told.iter().zip(noise);
            found
                .spreads
                .extend(parts.map(|(told, (position, twist))| told.plus(&position, twist)));
            found.values.extend(values);
        }
        Ok(found)
    }

    /// The last step, with the normal equations that led to it.
    pub(super) fn last_step(&mut self, gates: &Gates) -> Result<(Normal, Tally), BeamError> {
        let (normal, mut tallies) = self.normal(gates);
        let first = self.free.start - self.asked.start;
        let right = normal.right.rows(first, self.free.len());
        let step = self.free_factor(&normal)?.solve(&right);
        let mut at = self.values.rows_mut(self.free.start, self.free.len());
        at += step;
        Ok((normal, tallies.pop().unwrap_or_default()))
    }

    pub(super) fn free_factor(&self, normal: &Normal) -> Result<Cholesky<f64, Dyn>, BeamError> {
        let (first, count) = (self.free.start - self.asked.start, self.free.len());
        let block = normal.matrix.rows(first, count);
        block.into_owned().cholesky().ok_or(BeamError::Singular)
    }

    /// Covariance of the place and variance of the twist of each section by the data of the stretch, which
    /// leave the free unknowns a covariance.
    fn noise(&self, known: &DMatrix<f64>, rows: &DMatrix<f64>) -> Vec<(Matrix3<f64>, f64)> {
        let free = rows.rows(self.free.start, self.free.len()).into_owned();
        let answer = known * &free;
        let of = |k: usize| {
            let block = free.columns(4 * k, 4).tr_mul(&answer.columns(4 * k, 4));
            (block.fixed_view::<3, 3>(0, 0).into_owned(), block[(3, 3)])
        };
        (0..rows.ncols() / 4).map(of).collect()
    }

    /// States of sections of one hold at an instant.
    pub(super) fn values_at(
        &self,
        rests: &Rests,
        posed: &Posed,
        hold: usize,
        time_ns: i64,
    ) -> Vec<[f64; 4]> {
        let sections = rests.s_m.iter().zip(&rests.places);
        let state = |(s_m, rest): (&f64, &Place)| {
            self.state_of(&self.place_at(posed, hold, *s_m, Some(time_ns)), rest)
        };
        sections.map(state).collect()
    }

    /// The same and their slopes by all unknowns.
    pub(super) fn states_at(
        &self,
        rests: &Rests,
        posed: &Posed,
        hold: usize,
        time_ns: i64,
    ) -> (Vec<[f64; 4]>, DMatrix<f64>) {
        let mut rows = DMatrix::zeros(self.layout.len(), 4 * rests.s_m.len());
        let mut values = Vec::with_capacity(rests.s_m.len());
        for (k, (s_m, rest)) in rests.s_m.iter().zip(&rests.places).enumerate() {
            let place = self.place_at(posed, hold, *s_m, Some(time_ns));
            values.push(self.fill_state(&mut rows, 4 * k, posed, hold, &place, rest));
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
    /// How well they are known.
    pub spreads: Vec<Spread>,
    /// What it tells of the clocks; none where it tells nothing.
    pub clocks: Option<ClockNews>,
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
