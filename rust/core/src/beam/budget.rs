//! What a value's interval is made of, what the data moved, and the check of the length that is kept.

use std::ops::Range;

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::adjust::{Adjustment, Gates, Stage};
use super::factor::Factor;
use super::family::Kind;
use super::few::Few;
use super::layout::RIG;
use super::normal::Normal;
use super::rows::Rows;
use super::solution::Solution;
use super::sums::Part;
use crate::error::BeamError;

/// Values of a section of a hold: x, y, z, their changes and that of the whole, twist.
pub const VALUES: usize = 8;
/// Names of the groups, in the order of a budget.
pub const GROUPS: [&str; 12] = [
    "range_noise",
    "edge_steps",
    "registration",
    "range_offsets",
    "edge_angle",
    "surface",
    "stiffness",
    "weight_and_prebend",
    "loads",
    "root",
    "sway",
    "clocks",
];
/// Weights of a change of no length have no direction: below this it has none, metres.
const STILL_M: f64 = 1e-9;

/// Variance by source: the sum over the groups is the whole variance.
#[derive(Debug, Clone)]
pub struct Budget {
    /// Name and variances by hold, section and value, in m^2 and rad^2.
    pub groups: Vec<(&'static str, Vec<f64>)>,
}

impl Adjustment {
    /// How much each source gives to the variance of every section in every hold.
    ///
    /// An estimate is the sum of gains times independent sources; a source of information `W` gives
    /// `v^T W v` to the variance of a value, with `v` its slopes solved by the normal matrix.
    pub fn budget(&self, s_m: &[f64], solution: &Solution) -> Budget {
        let (rows, gates) = (self.value_rows(s_m), &solution.gates);
        let edges = mirrored(self.edges(gates));
        let prior = mirrored(self.prior(gates.stage));
        let solved = self.answers(&rows, &solution.covariance);
        let (of_edges, of_prior) = rayon::join(|| &edges * &solved, || &prior * &solved);
        let mut groups = vec![vec![0.0; rows.ncols()]; GROUPS.len()];
        for column in 0..rows.ncols() {
            let answer = solved.column(column);
            let total = rows.column(column).dot(&answer);
            let step = of_edges.column(column).dot(&answer);
            groups[1][column] = step;
            groups[0][column] = total - step;
            for (group, unknowns) in self.sources() {
                let part: f64 = unknowns
                    .map(|i| of_prior[(i, column)] * solved[(i, column)])
                    .sum();
                groups[group][column] += part;
                groups[0][column] -= part;
            }
        }
        Budget {
            groups: GROUPS.into_iter().zip(groups).collect(),
        }
    }

    /// By unknown: name of its group, change by the data, standard deviation before and after them.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn posterior(
        &self,
        solution: &Solution,
    ) -> Result<Vec<(&'static str, [f64; 3])>, BeamError> {
        let before = self.deviations_before(solution.gates.stage)?;
        let after = &solution.covariance;
        let mut known = vec![("", [0.0; 3]); self.layout.len()];
        let (rig, count) = (self.layout.lidar_at(0), self.layout.rig_len());
        for (group, unknowns) in self.sources() {
            for i in unknowns {
                let change = if (rig..rig + count).contains(&i) {
                    self.rig.values[i - rig] - self.rig.prior[i - rig]
                } else {
                    self.values[i] - self.expected[i]
                };
                let deviations = [before[i], after[(i, i)].sqrt()];
                known[i] = (GROUPS[group], [change, deviations[0], deviations[1]]);
            }
        }
        Ok(known)
    }

    /// Slopes solved by the normal matrix; those of one hold touch few unknowns.
    fn answers(&self, rows: &DMatrix<f64>, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        let count = rows.ncols() / self.problem.holds.len();
        let of = |hold: usize| Few::of(rows, hold * count, count).carried(covariance);
        let holds = (0..self.problem.holds.len()).into_par_iter();
        let parts: Vec<DMatrix<f64>> = holds.map(of).collect();
        let mut solved = DMatrix::zeros(rows.nrows(), rows.ncols());
        for (hold, part) in parts.iter().enumerate() {
            solved.columns_mut(hold * count, count).copy_from(part);
        }
        solved
    }

    /// Standard deviations of all unknowns before the data: clocks, lidars and the slow ones of the surface are
    /// known together.
    fn deviations_before(&self, stage: Stage) -> Result<Vec<f64>, BeamError> {
        let prior = self.prior(stage).matrix;
        let slow = self.problem.shape.waves_from();
        let (first, end) = (self.layout.clock_at(0), self.layout.shape_at() + slow);
        let block = prior.view((first, first), (end - first, end - first));
        let together = Factor::new(block.into_owned()).ok_or(BeamError::Singular)?;
        let covariance = together.inverse();
        let of = |i: usize| match (first..end).contains(&i) {
            true => covariance[(i - first, i - first)].sqrt(),
            false => prior[(i, i)].recip().sqrt(),
        };
        Ok((0..self.layout.len()).map(of).collect())
    }

    /// Slopes of all values of all sections by all unknowns.
    fn value_rows(&self, s_m: &[f64]) -> DMatrix<f64> {
        let (values, rows) = self.section_rows(&self.rests(s_m));
        let mut wanted = DMatrix::zeros(rows.nrows(), VALUES * values.len());
        for (place, value) in values.iter().enumerate() {
            let rest = place % s_m.len();
            let moved = Vector3::from_fn(|axis, _| value[axis] - values[rest][axis]);
            let along = moved.try_normalize(STILL_M).unwrap_or_default();
            for axis in 0..3 {
                let own = rows.column(4 * place + axis);
                let change = own - rows.column(4 * rest + axis);
                wanted.set_column(VALUES * place + axis, &own);
                wanted.set_column(VALUES * place + 3 + axis, &change);
                let mut whole = wanted.column_mut(VALUES * place + 6);
                whole.axpy(along[axis], &change, 1.0);
            }
            wanted.set_column(VALUES * place + 7, &rows.column(4 * place + 3));
        }
        wanted
    }

    fn edges(&self, gates: &Gates) -> Normal {
        let lidars = self.lidars();
        let of = |hold| Rows::new(self, hold, &lidars, gates).of_edges();
        let parts: Vec<Part> = (0..self.problem.holds.len())
            .into_par_iter()
            .map(of)
            .collect();
        let mut sum = Normal::new(&self.free, &self.free);
        parts.iter().for_each(|part| sum.join(part));
        sum
    }

    /// Every unknown by number of its group.
    fn sources(&self) -> Vec<(usize, Range<usize>)> {
        let layout = &self.layout;
        let mut groups = Vec::new();
        let own = self.own.iter().flatten();
        for (i, unknown) in self.shared.iter().chain(own).enumerate() {
            groups.push((group_of(unknown.kind), i..i + 1));
        }
        groups.push((10, layout.sway_at(0)..layout.clock_at(0)));
        groups.push((11, layout.clock_at(0)..layout.lidar_at(0)));
        for (lidar, channels) in layout.channels.iter().enumerate() {
            let first = layout.lidar_at(lidar);
            groups.push((2, first..first + 6));
            groups.push((3, first + 6..first + RIG + channels));
        }
        groups.push((5, layout.shape_at()..layout.edge_at()));
        groups.push((4, layout.edge_at()..layout.range_at(0)));
        groups.push((3, layout.range_at(0)..layout.len()));
        groups
    }
}

fn group_of(kind: Kind) -> usize {
    match kind {
        Kind::Soft { .. } => 6,
        Kind::Weight(_) | Kind::Free { .. } | Kind::Prebend => 7,
        Kind::Force { .. } | Kind::Couple { .. } | Kind::Load => 8,
        Kind::Root { .. } => 9,
    }
}

fn mirrored(normal: Normal) -> DMatrix<f64> {
    let mut matrix = normal.matrix;
    matrix.fill_upper_triangle_with_lower_triangle();
    matrix
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    const LAST: Gates = Gates {
        echo_m: 0.05,
        edge_m: 0.05,
        stage: Stage::All,
    };

    #[test]
    fn the_parts_of_a_budget_sum_to_the_variance() {
        let adjustment = sample::adjustment(0.0);
        let s_m = [40.0, 55.0];
        let solution = adjustment.solution(&LAST).unwrap();
        let whole = adjustment.knowledge(&s_m, &solution).0.covariance;
        let budget = adjustment.budget(&s_m, &solution);
        for (section, column) in [(0, 0), (0, 2), (1, 1)] {
            let place = VALUES * section + column;
            let sum: f64 = budget.groups.iter().map(|group| group.1[place]).sum();
            let variance = whole[(4 * section + column, 4 * section + column)];
            assert!((sum / variance - 1.0).abs() < 1e-6, "{sum} of {variance}");
            let noise = budget.groups[0].1[place];
            assert!(noise > 0.0 && noise < variance);
        }
    }

    #[test]
    fn more_noise_is_a_larger_part_of_noise_and_no_larger_part_of_the_prior() {
        let mut adjustment = sample::adjustment(0.0);
        let part = |a: &Adjustment, group: usize| {
            let solution = a.solution(&LAST).unwrap();
            a.budget(&[55.0], &solution).groups[group].1[1]
        };
        let before = part(&adjustment, 0);
        adjustment.weights.noise_m = vec![0.02];
        assert!(part(&adjustment, 0) > before);
    }

    #[test]
    fn data_narrow_what_was_known_and_never_widen_it() {
        let adjustment = sample::adjustment(0.0);
        let solution = adjustment.solution(&LAST).unwrap();
        let known = adjustment.posterior(&solution).unwrap();
        assert!(known.iter().all(|(name, _)| GROUPS.contains(name)));
        for (name, [_, before, after]) in &known {
            assert!(
                *after <= before * (1.0 + 1e-9),
                "{name}: {before} to {after}"
            );
        }
        let mut offsets = known.iter().filter(|k| k.0 == "range_offsets");
        assert!(offsets.any(|k| k.1[2] < 0.9 * k.1[1]));
    }

    #[test]
    fn a_blade_that_keeps_its_length_has_no_strain_and_a_stretched_one_has() {
        let mut adjustment = sample::adjustment(0.0);
        let found = adjustment.solution(&LAST).unwrap();
        let (strain, deviation) = (found.strain[0], found.strain_covariance[(0, 0)].sqrt());
        assert!(strain.abs() < 3.0 * deviation, "{strain} of {deviation}");
        // The lidar is held and the blade is seen 40 mm nearer to the root than it stands.
        adjustment.rig.values[5] -= 0.04;
        adjustment.rig.prior[5] -= 0.04;
        let moved = adjustment.solution(&LAST).unwrap().strain[0];
        assert!(moved < strain, "{moved} after {strain}");
    }
}
