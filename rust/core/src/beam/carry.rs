//! How well single instants are known: the covariance of everything the holds told, carried to a
//! state by its derivatives.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, Dyn, Matrix3};
use rayon::prelude::*;

use super::adjust::Adjustment;
use super::few::Few;
use super::layout::RANGES;
use super::posed::Posed;
use super::sections::{Rests, Sections};
use super::solution::Solution;

/// What an adjustment knows of its unknowns, and of the sections in its first hold.
#[derive(Debug, Clone)]
pub struct Knowledge {
    /// The sections in the first hold.
    pub rests: Rests,
    /// Covariance of all unknowns.
    covariance: Arc<DMatrix<f64>>,
    /// Covariance of all unknowns with x, y, z of the sections in the first hold, ...
    rest_carried: DMatrix<f64>,
    /// ... and that of x, y, z of each section by itself.
    rest_own: Vec<Matrix3<f64>>,
}

/// Variances of one section at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spread {
    /// Covariance of x, y, z, square metres.
    pub position: Matrix3<f64>,
    /// The same of the deflection from the first hold.
    pub deflection: Matrix3<f64>,
    /// Variance of the twist since the first hold, square rad.
    pub twist: f64,
}

impl Knowledge {
    /// Spreads by slopes of x, y, z and twist of the first sections.
    fn spreads(&self, rows: &DMatrix<f64>) -> Vec<Spread> {
        let few = Few::of(rows, 0, rows.ncols());
        let carried = few.own_carried(&self.covariance);
        let rest = few.rows_of(&self.rest_carried);
        let of = |k: usize| {
            let own = few.slopes().columns(4 * k, 4);
            let block = own.tr_mul(&carried.columns(4 * k, 4));
            let cross = matrix(&own.tr_mul(&rest.columns(3 * k, 3)));
            let position = matrix(&block);
            Spread {
                position,
                deflection: position + self.rest_own[k] - cross - cross.transpose(),
                twist: block[(3, 3)],
            }
        };
        (0..rows.ncols() / 4).map(of).collect()
    }
}

/// Joint covariance of the values that `rows` are the slopes of, `count` to a hold.
fn joint(rows: &DMatrix<f64>, count: usize, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let holds = rows.ncols() / count;
    let few: Vec<Few> = (0..holds)
        .map(|hold| Few::of(rows, hold * count, count))
        .collect();
    let pairs: Vec<(usize, usize)> = (0..holds)
        .flat_map(|one| (0..=one).map(move |two| (one, two)))
        .collect();
    let of = |(one, two): &(usize, usize)| few[*one].with(&few[*two], covariance);
    let blocks: Vec<DMatrix<f64>> = pairs.par_iter().map(of).collect();
    let mut all = DMatrix::zeros(rows.ncols(), rows.ncols());
    for ((one, two), block) in pairs.into_iter().zip(blocks) {
        let (below, beside) = ((one * count, two * count), (two * count, one * count));
        all.view_mut(below, (count, count)).copy_from(&block);
        all.view_mut(beside, (count, count))
            .copy_from(&block.transpose());
    }
    all
}

/// The first three rows and columns.
fn matrix(block: &DMatrix<f64>) -> Matrix3<f64> {
    block.fixed_view::<3, 3>(0, 0).into_owned()
}

impl Spread {
    /// With a variance on top that has nothing to do with the first hold.
    pub(super) fn plus(&self, position: &Matrix3<f64>, twist: f64) -> Self {
        Self {
            position: self.position + position,
            deflection: self.deflection + position,
            twist: self.twist + twist,
        }
    }
}

impl Adjustment {
    /// The sections at `s_m` of all holds, and what states of single instants need.
    pub fn knowledge(&self, s_m: &[f64], solution: &Solution) -> (Sections, Knowledge) {
        let covariance = Arc::clone(&solution.covariance);
        let rests = self.rests(s_m);
        let (values, rows) = self.section_rows(&rests);
        let columns: Vec<usize> = (0..3 * s_m.len()).map(|k| 4 * (k / 3) + k % 3).collect();
        let first = rows.select_columns(&columns);
        let rest_carried = Few::of(&first, 0, first.ncols()).carried(&covariance);
        let own = |k: usize| {
            let at = rows.columns(4 * k, 3);
            matrix(&at.tr_mul(&rest_carried.columns(3 * k, 3)))
        };
        let knowledge = Knowledge {
            rest_own: (0..s_m.len()).map(own).collect(),
            rests,
            rest_carried,
            covariance,
        };
        let covariance = joint(&rows, 4 * s_m.len(), &knowledge.covariance);
        (Sections { values, covariance }, knowledge)
    }

    /// States of a hold at instants, by instant and section: x, y, z and twist, and how well they are
    /// known; beyond the first `each` sections the latter is that of the middle instant.
    pub fn instants(
        &self,
        knowledge: &Knowledge,
        hold: usize,
        times_ns: &[i64],
        each: usize,
    ) -> (Vec<[f64; 4]>, Vec<Spread>) {
        let (posed, rests) = (self.posed(hold), &knowledge.rests);
        let spreads = |rests: &Rests, time_ns: i64| {
            let mut rows = self.states_at(rests, &posed, hold, time_ns).1;
            self.fill_rests(&mut rows, rests, &posed, hold, time_ns);
            knowledge.spreads(&rows)
        };
        let Some(middle) = times_ns.get(times_ns.len() / 2) else {
            return (Vec::new(), Vec::new());
        };
        let (others, few) = (spreads(rests, *middle), rests.first(each));
        let of_each = |time_ns: &i64| {
            let mut spreads = spreads(&few, *time_ns);
            spreads.extend_from_slice(&others[each..]);
            (self.values_at(rests, &posed, hold, *time_ns), spreads)
        };
        let found: Vec<_> = times_ns.par_iter().map(of_each).collect();
        let (values, spreads): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        (values.concat(), spreads.concat())
    }

    /// Adds to the slopes of a state's twists those by the first hold.
    fn fill_rests(
        &self,
        rows: &mut DMatrix<f64>,
        rests: &Rests,
        posed: &Posed,
        hold: usize,
        time_ns: i64,
    ) {
        for (k, (s_m, rest)) in rests.s_m.iter().zip(&rests.places).enumerate() {
            let at = self.place_at(posed, hold, *s_m, Some(time_ns));
            self.fill_rest(rows, 4 * k + 3, &rests.posed, rest, &at);
        }
    }

    /// Variances of states of a stretch that come from what the holds told: `rows` are slopes by all
    /// unknowns of the stretch, `normal` its normal equations over all of them, `factor` those of what
    /// is free in it.
    pub(super) fn inherited(
        &self,
        stretch: &Adjustment,
        knowledge: &Knowledge,
        between: (usize, usize, f64),
        (normal, factor): (&DMatrix<f64>, &Cholesky<f64, Dyn>),
        rows: &DMatrix<f64>,
    ) -> Vec<Spread> {
        let (first, count) = (stretch.free.start, stretch.free.len());
        let answer = factor.solve(&rows.rows(first, count).into_owned());
        let held = rows - normal * &answer;
        let mut parent = DMatrix::zeros(self.layout.len(), rows.ncols());
        let mut add = |to: usize, weight: f64, row: nalgebra::RowDVector<f64>| {
            let mut at = parent.row_mut(to);
            at += row * weight;
        };
        for (from, to) in self.same_unknowns(stretch) {
            add(to, 1.0, held.row(from).into_owned());
        }
        let (low, high, share) = between;
        let ends = [(low, 1.0 - share), (high, share)];
        let first_own = stretch.layout.own_at(0);
        for (k, unknown) in stretch.own[0].iter().enumerate() {
            let expected = answer.row(first_own + k - first) * stretch.tightness[first_own + k];
            for (hold, weight) in ends {
                let scale = self.own[hold][k].sigma / unknown.sigma;
                add(
                    self.layout.own_at(hold) + k,
                    weight * scale,
                    expected.clone(),
                );
            }
        }
        let mut own = DMatrix::zeros(0, rows.ncols());
        for (lidar, side) in self.groups() {
            let row = held
                .row(stretch.layout.edge_offset_at(0, lidar, side))
                .into_owned();
            for (hold, weight) in ends {
                add(
                    self.layout.edge_offset_at(hold, lidar, side),
                    weight,
                    row.clone(),
                );
            }
            let last = own.nrows();
            own = own.insert_row(last, 0.0);
            own.set_row(last, &row);
        }
        let told = knowledge.spreads(&parent);
        let more = |(k, spread): (usize, Spread)| {
            let at = own.columns(4 * k, 4);
            let block = at.tr_mul(&at);
            spread.plus(&matrix(&block), block[(3, 3)])
        };
        told.into_iter().enumerate().map(more).collect()
    }

    /// Lidars and sides.
    fn groups(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..2 * self.layout.channels.len()).map(|group| (group / 2, group % 2))
    }

    /// Unknowns that a stretch takes from this adjustment as they are: its number and the one here.
    fn same_unknowns(&self, stretch: &Adjustment) -> Vec<(usize, usize)> {
        let (theirs, ours) = (&stretch.layout, &self.layout);
        let mut same: Vec<(usize, usize)> = (0..ours.shared).map(|k| (k, k)).collect();
        let rig = ours.rig_len() + ours.shape + 1; // the edge angle stands behind the surface
        same.extend((0..rig).map(|k| (theirs.lidar_at(0) + k, ours.lidar_at(0) + k)));
        let ranges = RANGES * ours.channels.len();
        same.extend((0..ranges).map(|k| (theirs.range_at(0) + k, ours.range_at(0) + k)));
        same
    }
}

#[cfg(test)]
mod tests {
    use super::super::adjust::{Gates, Stage};
    use super::super::sample;
    use super::super::track::{Stretch, load_knots};
    use super::*;

    const GATES: Gates = Gates {
        echo_m: 0.05,
        edge_m: 0.05,
        stage: Stage::All,
    };
    const SPAN_NS: (i64, i64) = (0, 800_000_000);
    const TIME_NS: i64 = 400_000_000;

    fn stretch(holds: &Adjustment) -> Stretch {
        Stretch {
            seen: holds.problem.holds[0].seen.clone(),
            span_ns: SPAN_NS,
            load: vec![1.0; load_knots(SPAN_NS).len()],
            sway_m: [0.15, 0.15, 0.04, 0.04],
        }
    }

    /// Place of a section in a stretch that takes everything else from the holds.
    fn followed(holds: &Adjustment, knowledge: &Knowledge) -> nalgebra::Vector3<f64> {
        let stretch = stretch(holds);
        let mut part = holds.stretch(&stretch, &[1.0]).unwrap();
        let between = stretch.between(&[1.0]);
        let found = part.follow((holds, knowledge), between, &[TIME_NS], &[GATES; 4]);
        let [x, y, z, _] = found.unwrap().values[0];
        nalgebra::Vector3::new(x, y, z)
    }

    /// Variance that a stretch inherits where one unknown of the holds has a unit variance.
    fn told(
        holds: &Adjustment,
        knowledge: &Knowledge,
        unknown: usize,
        variance: f64,
    ) -> Matrix3<f64> {
        let mut knowledge = knowledge.clone();
        let covariance = Arc::make_mut(&mut knowledge.covariance);
        covariance.fill(0.0);
        covariance[(unknown, unknown)] = variance;
        let stretch = stretch(holds);
        let mut part = holds.stretch(&stretch, &[1.0]).unwrap();
        for _ in 0..3 {
            part.step(&GATES).unwrap();
        }
        part.asked = 0..part.layout.len();
        let (normal, _) = part.last_step(&GATES).unwrap();
        let factor = part.free_factor(&normal).unwrap();
        let (_, rows) = part.states_at(&knowledge.rests, &part.posed(0), 0, TIME_NS);
        let between = stretch.between(&[1.0]);
        let solved = (&normal.matrix, &factor);
        holds.inherited(&part, &knowledge, between, solved, &rows)[0].position
    }

    #[test]
    fn a_stretch_that_is_asked_for_no_state_tells_the_same_of_the_clocks() {
        let holds = sample::adjustment(0.0);
        let solution = holds.solution(&GATES).unwrap();
        let (_, knowledge) = holds.knowledge(&[55.0], &solution);
        let news = |times_ns: &[i64]| {
            let mut part = holds.stretch(&stretch(&holds), &[1.0]).unwrap();
            let found = part.follow((&holds, &knowledge), (0, 0, 0.0), times_ns, &[GATES; 2]);
            found.unwrap().clocks.unwrap().information[(0, 0)]
        };
        let (alone, with_states) = (news(&[]), news(&[TIME_NS]));
        assert!(
            (alone / with_states - 1.0).abs() < 1e-6,
            "{alone} {with_states}"
        );
    }

    #[test]
    fn a_state_between_holds_answers_to_what_they_told_as_its_slopes_say() {
        let holds = sample::adjustment(0.0);
        let solution = holds.solution(&GATES).unwrap();
        let (_, knowledge) = holds.knowledge(&[55.0], &solution);
        let layout = &holds.layout;
        let rig = layout.lidar_at(0);
        // A force, the lidar's place.
        for (unknown, step) in [(layout.own_at(0), 0.02), (rig + 3, 1e-4), (rig + 4, 1e-4)] {
            let moved = |change: f64| {
                let mut holds = holds.clone();
                holds.shift(unknown, change);
                followed(&holds, &knowledge)
            };
            let slope = (moved(step) - moved(-step)) / (2.0 * step);
            let none = told(&holds, &knowledge, unknown, 0.0);
            let with = told(&holds, &knowledge, unknown, 1.0) - none;
            for axis in 0..2 {
                let expected = slope[axis].powi(2);
                // Weights of residuals answer as well, which the slopes leave out: a tenth of a deviation.
                let close =
                    (with[(axis, axis)] - expected).abs() < 0.25 * slope.norm_squared() + 1e-9;
                assert!(
                    close,
                    "unknown {unknown}, axis {axis}: {} not {expected}",
                    with[(axis, axis)]
                );
            }
        }
    }

    #[test]
    fn spreads_are_the_whole_covariance_carried_by_all_slopes() {
        let holds = sample::adjustment(0.0);
        let solution = holds.solution(&GATES).unwrap();
        let (_, knowledge) = holds.knowledge(&[50.0, 55.0], &solution);
        let posed = holds.posed(0);
        let (_, rows) = holds.states_at(&knowledge.rests, &posed, 0, TIME_NS);
        let whole = rows.transpose() * &*knowledge.covariance * &rows;
        let found = knowledge.spreads(&rows);
        for (k, spread) in found.iter().enumerate() {
            let expected = whole.fixed_view::<3, 3>(4 * k, 4 * k);
            assert!((spread.position - expected).amax() < 1e-9 * expected.amax());
            let twist = whole[(4 * k + 3, 4 * k + 3)];
            assert!((spread.twist / twist - 1.0).abs() < 1e-9);
        }
        // Of a state that is the first hold itself nothing is left but its sway.
        let still = holds.section_rows(&knowledge.rests).1;
        for spread in knowledge.spreads(&still) {
            assert!(spread.deflection.amax() < 1e-9 * spread.position.amax());
        }
    }
}
