//! Curves in space as polynomials over one coordinate: their length and the way along them.

use super::Polynomial;
use crate::error::{FitError, InvalidValue};

/// The coordinate over which a curve is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpanAxis {
    /// Over x: y(x), z(x).
    X,
    /// Over y: x(y), z(y).
    Y,
    /// Over z: x(z), y(z), as the paper writes it.
    Z,
}

impl SpanAxis {
    /// Indices of the abscissa and of the two other coordinates, ascending.
    pub fn indices(self) -> (usize, [usize; 2]) {
        match self {
            Self::X => (0, [1, 2]),
            Self::Y => (1, [0, 2]),
            Self::Z => (2, [0, 1]),
        }
    }

    /// The axis of index 0, 1 or 2.
    ///
    /// # Errors
    /// [`InvalidValue`] for any other index.
    pub fn from_index(index: usize) -> Result<Self, InvalidValue> {
        let found = [Self::X, Self::Y, Self::Z].get(index).copied();
        found.ok_or_else(|| InvalidValue {
            name: "axis",
            expected: "0, 1 or 2".into(),
            found: index.to_string(),
        })
    }
}

/// A curve whose parameter t is one of its coordinates, metres.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceCurve {
    /// The coordinate that is the parameter.
    pub axis: SpanAxis,
    /// The two other coordinates, in ascending order of their index.
    pub across: [Polynomial; 2],
}

/// Nodes of the Kronrod rule of 15 points on [0, 1) (the rule is symmetric), every second of them a
/// node of the Gauss rule of 7; Piessens et al., QUADPACK, 1983.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_89,
    0.209_482_141_084_727_82,
];
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_66,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];
/// Intervals after which a length is given up; contours of blades take a handful.
const MOST_INTERVALS: usize = 10_000;
/// Steps of the walk; each at least halves the bracket or is one of Newton's.
const MOST_STEPS: usize = 100;

impl SpaceCurve {
    /// Point at parameter `t_m`, metres.
    pub fn point_m(&self, t_m: f64) -> [f64; 3] {
        self.placed(t_m, t_m, Polynomial::value)
    }

    /// Points at several parameters, metres.
    pub fn points_m(&self, ts_m: &[f64]) -> Vec<[f64; 3]> {
        ts_m.iter().map(|&t| self.point_m(t)).collect()
    }

    /// Shortest distances of several points from the curve, metres.
    pub fn distances_m(&self, points_m: &[[f64; 3]]) -> Vec<f64> {
        points_m.iter().map(|&p| self.distance_m(p)).collect()
    }

    /// Derivative of the point by the parameter.
    pub fn tangent(&self, t_m: f64) -> [f64; 3] {
        self.placed(t_m, 1.0, Polynomial::slope)
    }

    fn placed(&self, t_m: f64, own: f64, of: impl Fn(&Polynomial, f64) -> f64) -> [f64; 3] {
        let (along, across) = self.axis.indices();
        let mut placed = [0.0; 3];
        placed[along] = own;
        for (&index, polynomial) in across.iter().zip(&self.across) {
            placed[index] = of(polynomial, t_m);
        }
        placed
    }

    /// Metres of curve per metre of parameter, at least 1.
    pub fn speed(&self, t_m: f64) -> f64 {
        self.tangent(t_m).iter().map(|c| c * c).sum::<f64>().sqrt()
    }

    /// Length of the curve from `from_m` to `to_m` along the parameter, negative backwards; equation
    /// (15) of Hu et al. 2024 to an absolute `tolerance_m`.
    ///
    /// # Errors
    /// [`FitError::NotConverged`] where the tolerance is not reached, as with ends that are not finite
    /// or a tolerance below the rounding of the length.
    pub fn arc_length_m(&self, from_m: f64, to_m: f64, tolerance_m: f64) -> Result<f64, FitError> {
        let mut stack = vec![(from_m, to_m, tolerance_m)];
        let mut length_m = 0.0;
        for _ in 0..MOST_INTERVALS {
            let Some((a, b, tolerance)) = stack.pop() else {
                return Ok(length_m);
            };
            let (value, error) = self.kronrod(a, b);
            // Rounding of the rule itself: below it, halving gains nothing.
            if error <= tolerance.max(8.0 * f64::EPSILON * value.abs()) {
                length_m += value;
            } else {
                let middle = 0.5 * (a + b);
                stack.push((middle, b, 0.5 * tolerance));
                stack.push((a, middle, 0.5 * tolerance));
            }
        }
        Err(not_converged("arc length", tolerance_m, MOST_INTERVALS))
    }

    /// Integral of the speed over [a, b] and how far the two rules differ.
    fn kronrod(&self, a: f64, b: f64) -> (f64, f64) {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let (mut fine, mut coarse) = (0.0, 0.0);
        for (i, node) in NODES.iter().enumerate() {
            let mut speed = self.speed(middle + half * node);
            if *node > 0.0 {
                speed += self.speed(middle - half * node);
            }
            fine += KRONROD[i] * speed;
            if i % 2 == 1 {
                coarse += GAUSS[i / 2] * speed;
            }
        }
        (half * fine, (half * (fine - coarse)).abs())
    }

    /// Parameter reached from `from_m` after `length_m` of curve, backwards where it is negative, to
    /// `tolerance_m` of length.
    ///
    /// # Errors
    /// [`FitError::NotConverged`] as of [`SpaceCurve::arc_length_m`].
    pub fn walk_m(&self, from_m: f64, length_m: f64, tolerance_m: f64) -> Result<f64, FitError> {
        // The speed is at least 1, so the end lies within the length.
        let (mut low, mut high) = (from_m + length_m.min(0.0), from_m + length_m.max(0.0));
        let mut t = from_m + length_m / self.speed(from_m);
        for _ in 0..MOST_STEPS {
            let excess = self.arc_length_m(from_m, t, 0.1 * tolerance_m)? - length_m;
            if excess.abs() <= 0.5 * tolerance_m.max(16.0 * f64::EPSILON * length_m.abs()) {
                return Ok(t);
            }
            if excess > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let newton = t - excess / self.speed(t);
            let is_inside = newton > low && newton < high;
            t = if is_inside {
                newton
            } else {
                0.5 * (low + high)
            };
        }
        Err(not_converged("walk along a curve", tolerance_m, MOST_STEPS))
    }

    /// Shortest distance of a point from the curve, metres.
    pub fn distance_m(&self, point_m: [f64; 3]) -> f64 {
        if self
            .across
            .iter()
            .all(|polynomial| polynomial.degree() <= 1)
        {
            return self.distance_from_line_m(point_m);
        }
        let along = point_m[self.axis.indices().0];
        let straight = self.squared_distance(point_m, along).sqrt();
        // No point of the curve farther along than this can be nearer.
        let step = 2.0 * straight / PROBES as f64;
        let probe = |i: usize| along - straight + step * i as f64;
        let value = |i: &usize| self.squared_distance(point_m, probe(*i));
        let best = (0..=PROBES).min_by(|a, b| value(a).total_cmp(&value(b)));
        let best = probe(best.unwrap_or(0));
        self.refined(point_m, best - step, best + step)
            .sqrt()
            .min(straight)
    }

    /// The same for a straight line, by the foot of the perpendicular.
    fn distance_from_line_m(&self, point_m: [f64; 3]) -> f64 {
        let (along, across) = self.axis.indices();
        let t_m = point_m[along];
        let slopes = [0, 1].map(|k| self.across[k].slope(t_m));
        let asides_m = [0, 1].map(|k| point_m[across[k]] - self.across[k].value(t_m));
        let speed_squared = 1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1];
        let foot_m = (slopes[0] * asides_m[0] + slopes[1] * asides_m[1]) / speed_squared;
        let [x, y] = [0, 1].map(|k| asides_m[k] - slopes[k] * foot_m);
        (foot_m * foot_m + x * x + y * y).sqrt()
    }

    fn squared_distance(&self, point_m: [f64; 3], t_m: f64) -> f64 {
        crate::neighbors::squared_distance(self.point_m(t_m), point_m)
    }

    /// Least squared distance over [low, high], by the golden section.
    fn refined(&self, point_m: [f64; 3], mut low: f64, mut high: f64) -> f64 {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let value = |t| self.squared_distance(point_m, t);
        let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (mut at_left, mut at_right) = (value(left), value(right));
        for _ in 0..GOLDEN_STEPS {
            if at_left < at_right {
                (high, right, at_right) = (right, left, at_left);
                left = high - GOLDEN * (high - low);
                at_left = value(left);
            } else {
                (low, left, at_left) = (left, right, at_right);
                right = low + GOLDEN * (high - low);
                at_right = value(right);
            }
        }
        at_left.min(at_right)
    }
}

/// Places tried on the curve before the nearest is refined.
const PROBES: usize = 64;
/// 0.618^40 = 4e-9 of the bracket; the distance is stationary there, so its square is exact.
const GOLDEN_STEPS: usize = 40;

fn not_converged(what: &'static str, tolerance: f64, steps: usize) -> FitError {
    FitError::NotConverged {
        what,
        tolerance,
        steps,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(x: &[f64], y: &[f64]) -> SpaceCurve {
        let polynomial = |c: &[f64]| Polynomial::from_powers(c.to_vec()).unwrap();
        SpaceCurve {
            axis: SpanAxis::Z,
            across: [polynomial(x), polynomial(y)],
        }
    }

    #[test]
    fn a_straight_line_has_the_length_of_pythagoras() {
        let line = curve(&[1.0, 2.0], &[5.0, -2.0]);
        assert!((line.arc_length_m(1.0, 4.0, 1e-9).unwrap() - 9.0).abs() < 1e-12);
        assert!((line.arc_length_m(4.0, 1.0, 1e-9).unwrap() + 9.0).abs() < 1e-12);
        assert!((line.walk_m(4.0, -9.0, 1e-9).unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(line.walk_m(4.0, 0.0, 1e-9).unwrap(), 4.0);
    }

    #[test]
    fn a_parabola_has_its_closed_length() {
        // x = a z^2: length from 0 to z is (v sqrt(1 + v^2) + asinh v) / (4 a) with v = 2 a z.
        for a in [0.003, 0.5, 40.0] {
            let parabola = curve(&[0.0, 0.0, a], &[0.0]);
            let v: f64 = 2.0 * a * 10.0;
            let expected = (v * (1.0 + v * v).sqrt() + v.asinh()) / (4.0 * a);
            let found = parabola.arc_length_m(0.0, 10.0, 1e-9).unwrap();
            assert!((found - expected).abs() < 1e-9, "{a}: {found} {expected}");
            let back = parabola.walk_m(10.0, -expected, 1e-9).unwrap();
            assert!(back.abs() < 2e-9, "{back}"); // the speed is 1 at the vertex
        }
    }

    #[test]
    fn the_axis_chooses_the_parameter() {
        let constant = |c: f64| Polynomial::from_powers(vec![c]).unwrap();
        let along_y = SpaceCurve {
            axis: SpanAxis::from_index(1).unwrap(),
            across: [constant(3.0), constant(4.0)],
        };
        assert_eq!(along_y.point_m(7.0), [3.0, 7.0, 4.0]);
        assert_eq!(along_y.tangent(7.0), [0.0, 1.0, 0.0]);
        assert!(SpanAxis::from_index(3).is_err());
    }

    #[test]
    fn distances_are_to_the_nearest_point_of_the_curve() {
        // From (0, c) to x = z^2 the nearest point has x = c - 1/2, distance sqrt(c - 1/4).
        let parabola = curve(&[0.0, 0.0, 1.0], &[0.0]);
        let found = parabola.distance_m([5.0, 0.0, 0.0]);
        assert!((found - 4.75f64.sqrt()).abs() < 1e-9, "{found}");
        assert_eq!(parabola.distance_m([4.0, 0.0, 2.0]), 0.0);
        assert!((parabola.distance_m([0.0, 3.0, 0.0]) - 3.0).abs() < 1e-9);
    }

    #[test]
    fn distances_from_a_straight_line_are_those_across_it() {
        // Along (2, -2, 1) / 3; from a point on it 5 m along (1, 2, 2) / 3 and (2, 1, -2) / 3, both across.
        let line = curve(&[1.0, 2.0], &[5.0, -2.0]);
        for across in [[1.0, 2.0, 2.0], [2.0, 1.0, -2.0]] {
            let at = |k: usize| line.point_m(7.0)[k] + 5.0 / 3.0 * across[k];
            let found = line.distance_m([at(0), at(1), at(2)]);
            assert!((found - 5.0).abs() < 1e-12, "{found}");
        }
        let constant = curve(&[3.0], &[0.0, 0.0]);
        assert_eq!(constant.distance_m([3.0, 4.0, 9.0]), 4.0);
        // The way of a bent curve finds the same: a parabola without its square.
        let bent = curve(&[1.0, 2.0, 0.0], &[5.0, -2.0]);
        for point in [[0.3, 2.0, 80.0], [-7.0, 1.0, 3.0], [1.0, 5.0, 0.0]] {
            assert!((line.distance_m(point) - bent.distance_m(point)).abs() < 1e-7);
        }
    }

    #[test]
    fn ends_that_are_not_finite_fail_by_name() {
        let line = curve(&[0.0, 1.0], &[0.0]);
        for end in [f64::NAN, f64::INFINITY] {
            let error = line.arc_length_m(0.0, end, 1e-9).unwrap_err();
            assert!(matches!(error, FitError::NotConverged { .. }));
            assert!(line.walk_m(0.0, end, 1e-9).is_err());
        }
    }
}
