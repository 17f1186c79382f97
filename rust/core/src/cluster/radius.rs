//! The search radius as a function of range: what the sensor's angular step leaves between points.

use crate::error::InvalidValue;
use crate::neighbors::checked_radius;

/// `Eps = mu tan(alpha) MinPts d + beta`, equation (10) of Hu et al. 2024.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadiusModel {
    slope: f64,
    beta_m: f64,
}

impl RadiusModel {
    /// A model of angular step `alpha_rad`, factor `mu`, least number of points and constant part.
    ///
    /// # Errors
    /// [`InvalidValue`] unless 0 < alpha < pi/2, mu is positive (the paper: above 1), `min_points`
    /// is at least 1 and beta is not negative.
    pub fn new(
        alpha_rad: f64,
        mu: f64,
        beta_m: f64,
        min_points: usize,
    ) -> Result<Self, InvalidValue> {
        let quarter = std::f64::consts::FRAC_PI_2;
        let is_angle = alpha_rad > 0.0 && alpha_rad < quarter;
        require("alpha_rad", "an angle in (0, pi/2)", alpha_rad, is_angle)?;
        let is_factor = mu > 0.0 && mu.is_finite();
        require("mu", "a positive number", mu, is_factor)?;
        let is_length = beta_m >= 0.0 && beta_m.is_finite();
        require("beta_m", "a length of at least 0 m", beta_m, is_length)?;
        require("min_points", "at least 1", 0.0, min_points >= 1)?;
        Ok(Self {
            slope: mu * alpha_rad.tan() * min_points as f64,
            beta_m,
        })
    }

    /// Search radius at distance `distance_m` from the sensor, metres.
    pub fn radius_m(&self, distance_m: f64) -> f64 {
        self.slope * distance_m + self.beta_m
    }

    /// Search radii at several distances, metres.
    pub fn radii_at_m(&self, distances_m: &[f64]) -> Vec<f64> {
        distances_m.iter().map(|&d| self.radius_m(d)).collect()
    }

    /// Search radius of every point from its own distance to `origin_m`, metres: the model without
    /// intervals.
    ///
    /// # Errors
    /// [`InvalidValue`] where a radius is not positive and finite (beta 0 and a point at the origin).
    pub fn radii_m<T: crate::neighbors::Coordinate>(
        &self,
        points: &[[T; 3]],
        origin_m: [f64; 3],
    ) -> Result<Vec<f64>, InvalidValue> {
        let radius_of = |p: &[T; 3]| {
            let distance_m = distance(crate::neighbors::wide(*p), origin_m);
            checked_radius("radius_m", self.radius_m(distance_m))
        };
        points.iter().map(radius_of).collect()
    }
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    crate::neighbors::squared_distance(p, q).sqrt()
}

/// The range of distances over a whole test, cut into equal intervals; each has one radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intervals {
    min_m: f64,
    max_m: f64,
    count: usize,
}

impl Intervals {
    /// `count` intervals over `[min_m, max_m]`, the extreme distances of the whole test.
    ///
    /// # Errors
    /// [`InvalidValue`] unless 0 <= min <= max, both finite, and there is at least one interval.
    pub fn new(min_m: f64, max_m: f64, count: usize) -> Result<Self, InvalidValue> {
        require("min_m", "at least 0 m", min_m, min_m >= 0.0)?;
        let is_above = max_m >= min_m && max_m.is_finite();
        require("max_m", "at least min_m and finite", max_m, is_above)?;
        require("count", "at least 1 interval", 0.0, count >= 1)?;
        Ok(Self {
            min_m,
            max_m,
            count,
        })
    }

    /// Right edges for several distances, metres.
    pub fn right_edges_m(&self, distances_m: &[f64]) -> Vec<f64> {
        distances_m.iter().map(|&d| self.right_edge_m(d)).collect()
    }

    /// Right edge of the interval that holds `distance_m`; an inner edge belongs to the interval on
    /// its left, distances outside belong to the first or the last.
    pub fn right_edge_m(&self, distance_m: f64) -> f64 {
        let step = (self.max_m - self.min_m) / self.count as f64;
        let is_right_of = |i: &usize| distance_m <= self.min_m + step * *i as f64;
        let found = (1..self.count).find(is_right_of);
        found.map_or(self.max_m, |i| self.min_m + step * i as f64)
    }
}

fn require(
    name: &'static str,
    expected: &str,
    found: f64,
    is_met: bool,
) -> Result<(), InvalidValue> {
    if is_met {
        return Ok(());
    }
    Err(InvalidValue {
        name,
        expected: expected.into(),
        found: found.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_is_that_of_equation_10() {
        let model = RadiusModel::new(0.2f64.to_radians(), 1.5, 0.03, 4).unwrap();
        let expected = 1.5 * 0.2f64.to_radians().tan() * 4.0 * 20.0 + 0.03;
        assert!((model.radius_m(20.0) - expected).abs() < 1e-15);
        let radii = model.radii_m(&[[1.0, 12.0, 16.0]], [1.0, 0.0, 0.0]);
        assert!((radii.unwrap()[0] - expected).abs() < 1e-15);
    }

    #[test]
    fn parameters_without_meaning_are_refused_by_name() {
        let refused = |alpha, mu, beta, min| RadiusModel::new(alpha, mu, beta, min).unwrap_err();
        assert_eq!(refused(0.0, 1.5, 0.0, 4).name, "alpha_rad");
        assert_eq!(refused(0.1, f64::NAN, 0.0, 4).name, "mu");
        assert_eq!(refused(0.1, 1.5, -1.0, 4).name, "beta_m");
        assert_eq!(refused(0.1, 1.5, 0.0, 0).name, "min_points");
        let model = RadiusModel::new(0.1, 1.5, 0.0, 4).unwrap();
        let at_origin = model.radii_m(&[[0.0f32; 3]], [0.0; 3]);
        assert_eq!(at_origin.unwrap_err().name, "radius_m");
    }

    #[test]
    fn each_distance_takes_the_right_edge_of_its_interval() {
        let intervals = Intervals::new(10.0, 30.0, 4).unwrap();
        let edges = [10.0, 12.0, 15.0, 15.1, 29.0, 30.0].map(|d| intervals.right_edge_m(d));
        assert_eq!(edges, [15.0, 15.0, 15.0, 20.0, 30.0, 30.0]);
        assert_eq!(intervals.right_edge_m(9.0), 15.0);
        assert_eq!(intervals.right_edge_m(31.0), 30.0);
    }

    #[test]
    fn a_still_blade_has_one_radius() {
        let intervals = Intervals::new(10.0, 10.0, 5).unwrap();
        assert_eq!(intervals.right_edge_m(10.0), 10.0);
        assert!(Intervals::new(10.0, 9.0, 5).is_err() && Intervals::new(1.0, 9.0, 0).is_err());
    }
}
