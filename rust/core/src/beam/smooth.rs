//! Between holds a blade moves smoothly: its knots lie as close as winches that start and stop need, and closer
//! than its echoes could tell each of them.

use super::adjust::Adjustment;
use super::normal::Normal;

/// Weights of five knots in a row: their fourth difference.
const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Standard deviation of the fourth difference of the knots of the load (share of full load), the sway in its
/// first mode in x and y, and in its second (metres at the tip): that of winches that start, several times that
/// of a sway, and what a swing of 2 m at 1.2 Hz has.
const ROUGH: [f64; 5] = [0.004, 0.03, 0.03, 0.016, 0.016];

impl Adjustment {
    /// Adds to what is known of a stretch before the data that fourth differences of its knots are small.
    pub(super) fn smooth(&self, prior: &mut Normal) {
        let (knots, sway) = (self.layout.knots[0], self.layout.sway_at(0));
        for (mode, rough) in ROUGH.iter().enumerate() {
            let (first, sigma) = (sway + mode * knots, rough / self.modes_m[mode]);
            for knot in first..=first + knots - FOURTH.len() {
                self.smooth_at(prior, knot, 1.0 / (sigma * sigma));
            }
        }
    }

    fn smooth_at(&self, prior: &mut Normal, knot: usize, weight: f64) {
        let (row, column) = (knot - prior.asked.start, knot - prior.free.start);
        let values = self.values.rows(knot, FOURTH.len());
        let difference: f64 = FOURTH.iter().zip(&values).map(|(c, value)| c * value).sum();
        for (i, one) in FOURTH.iter().enumerate() {
            prior.right[row + i] -= weight * one * difference;
            for (j, other) in FOURTH.iter().enumerate().take(i + 1) {
                prior.matrix[(row + i, column + j)] += weight * one * other;
            }
        }
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
