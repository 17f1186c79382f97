//! What neighbouring unknowns have in common before the data: between holds a blade moves smoothly, its knots lie as close
//! as winches that start and stop need, and closer than its echoes could tell each of them; chord and twist vary
//! smoothly where no drawing tells them.

use super::adjust::Adjustment;
use super::normal::Normal;

/// Weights of five knots in a row: their fourth difference.
const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Standard deviation of the fourth difference of the knots of the load (share of full load), the sway in its
/// first mode in x and y, and in its second (metres at the tip): that of winches that start, several times that
/// of a sway, and what a swing of 2 m at 1.2 Hz has.
const ROUGH: [f64; 5] = [0.004, 0.03, 0.03, 0.016, 0.016];

/// A weighted sum of unknowns in a row that is known to be small.
pub(super) struct Small {
    /// The first of them.
    pub first: usize,
    /// Their weights.
    pub weights: Vec<f64>,
    /// Standard deviation of the sum.
    pub sigma: f64,
}

impl Adjustment {
    /// Adds to what is known before the data that neighbours differ little.
    pub(super) fn smooth(&self, prior: &mut Normal) {
        let (asked, free) = (prior.asked.start, prior.free.clone());
        for small in self.small().filter(|small| free.contains(&small.first)) {
            let (row, column) = (small.first - asked, small.first - free.start);
            let (sum, weight) = (self.sum(&small), small.sigma.powi(-2));
            for (i, one) in small.weights.iter().enumerate() {
                prior.right[row + i] -= weight * one * sum;
                for (j, other) in small.weights.iter().enumerate().take(i + 1) {
                    prior.matrix[(row + i, column + j)] += weight * one * other;
                }
            }
        }
    }

    /// How far neighbours differ, as a weighted sum of squares.
    pub(super) fn roughness(&self) -> f64 {
        let free = self
            .small()
            .filter(|small| self.free.contains(&small.first));
        free.map(|small| (self.sum(&small) / small.sigma).powi(2))
            .sum()
    }

    fn small(&self) -> impl Iterator<Item = Small> {
        self.surface().chain(self.motion())
    }

    /// Bends of chord and twist.
    fn surface(&self) -> impl Iterator<Item = Small> {
        let first = self.layout.shape_at();
        self.problem.shape.bends().map(move |bend| Small {
            first: first + bend.first,
            ..bend
        })
    }

    /// Fourth differences of the knots of a stretch.
    fn motion(&self) -> impl Iterator<Item = Small> {
        let (knots, sway) = (self.layout.knots[0], self.layout.sway_at(0));
        let modes = if self.follows_load { ROUGH.len() } else { 0 };
        (0..modes).flat_map(move |mode| {
            (0..=knots - FOURTH.len()).map(move |knot| Small {
                first: sway + mode * knots + knot,
                weights: FOURTH.to_vec(),
                sigma: ROUGH[mode] / self.modes_m[mode],
            })
        })
    }

    fn sum(&self, small: &Small) -> f64 {
        let values = self.values.rows(small.first, small.weights.len());
        small
            .weights
            .iter()
            .zip(&values)
            .map(|(w, value)| w * value)
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::super::track::{Stretch, load_knots};
    use super::*;

    /// What a stretch is pulled by whose second mode's knots lie where `of` has them.
    fn pulls(of: impl Fn(usize) -> f64) -> Vec<f64> {
        let holds = sample::adjustment(0.0);
        let span_ns = (0, 800_000_000);
        let stretch = Stretch {
            seen: holds.problem.holds[0].seen.clone(),
            span_ns,
            load: vec![1.0; load_knots(span_ns).len()],
            sway_m: [0.15, 0.15, 0.04, 0.04],
        };
        let mut part = holds.stretch(&stretch, &[1.0]).unwrap();
        let knots = part.layout.knots[0];
        let first = part.layout.sway_at(0) + knots;
        (0..knots).for_each(|k| part.values[first + k] = of(k));
        let mut prior = Normal::new(&part.free, &part.free);
        part.smooth(&mut prior);
        let at = first - prior.free.start;
        prior.right.rows(at, knots).iter().copied().collect()
    }

    #[test]
    fn a_motion_that_gains_speed_evenly_is_left_alone() {
        let found = pulls(|k| 0.3 - 0.2 * k as f64 + 0.05 * (k as f64).powi(3));
        assert!(found.iter().all(|pull| pull.abs() < 1e-9), "{found:?}");
    }

    #[test]
    fn a_knot_that_sticks_out_is_pulled_back() {
        // By 6 times its own share of 6, and those of the differences about it.
        let found = pulls(|k| if k == 8 { 0.1 } else { 0.0 });
        let expected = -0.1 * 70.0 * (0.15 / ROUGH[1]).powi(2);
        assert!((found[8] - expected).abs() < 1e-9, "{found:?}");
    }
}
