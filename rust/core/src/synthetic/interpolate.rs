//! Values between stations: linear, logarithmic, and a natural cubic spline with its slope.

/// Index of the interval of increasing `knots` that holds `x`, and the place in it; ends extend.
pub fn locate(knots: &[f64], x: f64) -> (usize, f64) {
    let last = knots.len() - 2;
    let i = knots
        .partition_point(|knot| *knot <= x)
        .saturating_sub(1)
        .min(last);
    (i, (x - knots[i]) / (knots[i + 1] - knots[i]))
}

/// Linear between stations, constant beyond the ends.
pub fn linear(knots: &[f64], values: &[f64], x: f64) -> f64 {
    let (i, t) = locate(knots, x);
    let t = t.clamp(0.0, 1.0);
    values[i] + t * (values[i + 1] - values[i])
}

/// Linear in the logarithm, for positive quantities over decades such as stiffness.
pub fn logarithmic(knots: &[f64], values: &[f64], x: f64) -> f64 {
    let (i, t) = locate(knots, x);
    let t = t.clamp(0.0, 1.0);
    values[i] * (values[i + 1] / values[i]).powf(t)
}

/// Natural cubic spline.
#[derive(Debug, Clone)]
pub struct Spline {
    knots: Vec<f64>,
    values: Vec<f64>,
    second: Vec<f64>,
}

impl Spline {
    /// Through `values` at increasing `knots` (at least two).
    pub fn new(knots: &[f64], values: &[f64]) -> Self {
        let n = knots.len();
        let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
        for i in 1..n - 1 {
            let (a, b) = (knots[i] - knots[i - 1], knots[i + 1] - knots[i]);
            let slopes = (values[i + 1] - values[i]) / b - (values[i] - values[i - 1]) / a;
            let pivot = 2.0 * (a + b) - a * upper[i - 1];
            upper[i] = b / pivot;
            right[i] = (6.0 * slopes - a * right[i - 1]) / pivot;
        }
        let mut second = vec![0.0; n];
        for i in (1..n - 1).rev() {
            second[i] = right[i] - upper[i] * second[i + 1];
        }
        Self {
            knots: knots.to_vec(),
            values: values.to_vec(),
            second,
        }
    }

    /// Slope at `x`.
    pub fn slope(&self, x: f64) -> f64 {
        let (i, t) = locate(&self.knots, x);
        let h = self.knots[i + 1] - self.knots[i];
        let (p, q) = (1.0 - t, t);
        (self.values[i + 1] - self.values[i]) / h
            + h / 6.0
                * ((3.0 * q * q - 1.0) * self.second[i + 1] - (3.0 * p * p - 1.0) * self.second[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spline_follows_a_smooth_curve() {
        let knots: Vec<f64> = (0..=20).map(|i| f64::from(i) * 0.15).collect();
        let values: Vec<f64> = knots.iter().map(|x| x.sin()).collect();
        let spline = Spline::new(&knots, &values);
        for x in [0.4, 1.0, 1.33, 2.2] {
            // Slopes of a cubic spline are good to h^3 / 24 of the fourth derivative.
            assert!((spline.slope(x) - x.cos()).abs() < 2e-4);
        }
    }

    #[test]
    fn stiffness_falls_by_equal_factors() {
        assert!((logarithmic(&[0.0, 2.0], &[1e9, 1e5], 1.0) - 1e7).abs() < 1.0);
        assert_eq!(linear(&[0.0, 2.0], &[1.0, 3.0], 5.0), 3.0);
    }
}
