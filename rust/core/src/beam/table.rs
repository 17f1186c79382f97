//! Values between stations of a drawing.

/// Interval of rising `knots` that holds `x`, and the place in it from 0 to 1; ends are kept.
pub fn interval(knots: &[f64], x: f64) -> (usize, f64) {
    let last = knots.len().saturating_sub(2);
    let after = knots.partition_point(|knot| *knot <= x);
    let index = after.saturating_sub(1).min(last);
    let length = knots[index + 1] - knots[index];
    (index, ((x - knots[index]) / length).clamp(0.0, 1.0))
}

/// The same for who knows the interval in which it probably lies: no search where it does.
pub fn interval_near(knots: &[f64], x: f64, near: usize) -> (usize, f64) {
    match knots.get(near..near + 2) {
        Some([from, to]) if (*from..*to).contains(&x) => (near, (x - from) / (to - from)),
        _ => interval(knots, x),
    }
}

/// Linear between stations, constant beyond the ends.
pub fn linear(knots: &[f64], values: &[f64], x: f64) -> f64 {
    let (index, share) = interval(knots, x);
    values[index] * (1.0 - share) + values[index + 1] * share
}

/// Straight in the logarithm: stiffness falls by decades along a blade.
pub fn logarithmic(knots: &[f64], values: &[f64], x: f64) -> f64 {
    let (index, share) = interval(knots, x);
    (values[index].ln() * (1.0 - share) + values[index + 1].ln() * share).exp()
}

/// Slopes of `values` at their knots, each of the parabola through its neighbours.
pub fn slopes(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let chords: Vec<f64> = knots
        .windows(2)
        .zip(values.windows(2))
        .map(|(k, v)| (v[1] - v[0]) / (k[1] - k[0]))
        .collect();
    let inner = |i: usize| {
        let (before, after) = (knots[i] - knots[i - 1], knots[i + 1] - knots[i]);
        (chords[i - 1] * after + chords[i] * before) / (before + after)
    };
    let last = knots.len() - 1;
    let mut slopes = vec![chords[0]; knots.len()];
    slopes[last] = chords[last - 1];
    (1..last).for_each(|i| slopes[i] = inner(i));
    if last >= 2 {
        slopes[0] = 2.0 * chords[0] - slopes[1];
        slopes[last] = 2.0 * chords[last - 1] - slopes[last - 1];
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOTS: [f64; 4] = [0.0, 1.0, 3.0, 4.0];

    #[test]
    fn a_guess_of_the_interval_changes_nothing() {
        for x in [-1.0, 0.0, 0.5, 1.0, 2.9, 3.0, 4.0, 9.0] {
            for near in 0..6 {
                assert_eq!(interval_near(&KNOTS, x, near), interval(&KNOTS, x));
            }
        }
    }

    #[test]
    fn values_meet_their_stations_and_stay_beyond_the_ends() {
        let values = [1.0, 2.0, 8.0, 4.0];
        assert_eq!(linear(&KNOTS, &values, 2.0), 5.0);
        assert!((logarithmic(&KNOTS, &values, 2.0) - 4.0).abs() < 1e-12);
        assert_eq!(linear(&KNOTS, &values, -1.0), 1.0);
        assert_eq!(linear(&KNOTS, &values, 9.0), 4.0);
    }

    #[test]
    fn slopes_of_a_parabola_are_exact() {
        let values = KNOTS.map(|x| 3.0 * x * x - x);
        for (slope, x) in slopes(&KNOTS, &values).iter().zip(KNOTS) {
            assert!((slope - (6.0 * x - 1.0)).abs() < 1e-12);
        }
    }
}
