//! Step 10: the tip as the intersection of both contour curves, projected on a plane.

use thiserror::Error;

use super::curves::ContourCurve;
use crate::error::{Coded, InvalidValue};
use crate::fit::Fit;
use crate::fit::polynomial::Polynomial;

/// Plane on which the contour curves are intersected; both hold the span.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// Seen along y: for a blade that moves along x.
    Xoz,
    /// Seen along x: for a blade that moves along y.
    Yoz,
}

/// Where an intersection counts as one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipLimits {
    max_u_m: f64,
}

impl TipLimits {
    /// Largest standard uncertainty of the tip along the span, metres.
    ///
    /// # Errors
    /// [`InvalidValue`] where it is not positive.
    pub fn new(max_u_m: f64) -> Result<Self, InvalidValue> {
        if max_u_m > 0.0 {
            return Ok(Self { max_u_m });
        }
        Err(InvalidValue {
            name: "tip_max_u_m",
            expected: "a length above zero".into(),
            found: max_u_m.to_string(),
        })
    }
}

/// The intersection, metres, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip {
    /// Its place along z; the other coordinates are the means of both curves there.
    pub z_m: f64,
    /// Standard uncertainty along z from the scatter of the samples, which is not all of it.
    pub u_z_m: f64,
}

/// Why a frame has no tip: never a number instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum NoTip {
    /// The curves do not meet within two visible lengths beyond the last sample.
    #[error("the contour curves do not meet within two visible lengths beyond the last scan line")]
    NoIntersection,
    /// The curves are nearly parallel where they meet.
    #[error("the contour curves are nearly parallel where they meet: the tip is ill-posed")]
    IllPosed,
}

impl NoTip {
    /// Word for tables.
    pub fn name(self) -> &'static str {
        match self {
            NoTip::NoIntersection => "no_intersection",
            NoTip::IllPosed => "ill_posed",
        }
    }
}

impl Coded for NoTip {
    fn code(&self) -> &'static str {
        match self {
            NoTip::NoIntersection => "measurement.no_intersection",
            NoTip::IllPosed => "measurement.ill_posed",
        }
    }

    fn hint(&self) -> Option<String> {
        Some("try the other plane, or other degrees of the curves".into())
    }
}

/// The curves must meet within so many visible lengths beyond the last sample.
const BEYOND_END: f64 = 2.0;
/// The curves may meet a little before the last sample: share of the visible length.
const BEFORE_END: f64 = 0.15;
/// Steps of the search for a change of sign.
const STEPS: u32 = 512;

/// Intersects both contour curves on a plane, beyond the visible part of the blade.
///
/// # Errors
/// [`NoTip`] where they do not meet, or too flatly to say where.
pub fn intersect(
    leading: &ContourCurve,
    trailing: &ContourCurve,
    plane: Plane,
    limits: &TipLimits,
) -> Result<Tip, NoTip> {
    let (a, b) = (on_plane(leading, plane), on_plane(trailing, plane));
    let end = leading.seen_z_m[1].max(trailing.seen_z_m[1]);
    let length = end - leading.seen_z_m[0].min(trailing.seen_z_m[0]);
    let gap = |z: f64| a.estimate.value(z) - b.estimate.value(z);
    let z_m = first_root(gap, end - BEFORE_END * length, end + BEYOND_END * length)
        .ok_or(NoTip::NoIntersection)?;
    let slope = (a.estimate.slope(z_m) - b.estimate.slope(z_m)).abs();
    let u_z_m = (a.variance_at(z_m) + b.variance_at(z_m)).sqrt() / slope;
    if u_z_m <= limits.max_u_m {
        Ok(Tip { z_m, u_z_m })
    } else {
        Err(NoTip::IllPosed)
    }
}

fn on_plane(curve: &ContourCurve, plane: Plane) -> &Fit<Polynomial> {
    match plane {
        Plane::Xoz => &curve.x,
        Plane::Yoz => &curve.y,
    }
}

/// The first change of sign in [from, to], narrowed to the last bits by halving.
fn first_root(f: impl Fn(f64) -> f64, from: f64, to: f64) -> Option<f64> {
    let at = |k: u32| from + (to - from) * f64::from(k) / f64::from(STEPS);
    let bracket = (0..STEPS).find(|k| f(at(*k)) * f(at(k + 1)) <= 0.0)?;
    let (mut low, mut high) = (at(bracket), at(bracket + 1));
    let rising = f(high) > f(low);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == rising {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::curves::{Degrees, fit_contour};

    /// Contours of a blade whose chord falls linearly to nothing at `tip`, seen from 80 to 105 m,
    /// with a ripple that stands for noise.
    fn contours(tip: f64, ripple: f64) -> [ContourCurve; 2] {
        [-0.5, 0.5].map(|side| {
            let samples: Vec<[f64; 3]> = (0..60)
                .map(|i| {
                    let z = 80.0 + 25.0 * f64::from(i) / 59.0;
                    let noise = ripple * (f64::from(i) * 2.3 + side).sin();
                    [
                        0.001 * z * z + side * 0.1 * (tip - z) + noise,
                        0.01 * z + noise,
                        z,
                    ]
                })
                .collect();
            fit_contour(&samples, Degrees::new(1, 2).unwrap()).unwrap()
        })
    }

    #[test]
    fn the_tip_of_a_wedge_comes_back() {
        let [leading, trailing] = contours(110.0, 0.0);
        let limits = TipLimits::new(1.0).unwrap();
        let tip = intersect(&leading, &trailing, Plane::Xoz, &limits).unwrap();
        assert!((tip.z_m - 110.0).abs() < 1e-6 && tip.u_z_m < 1e-3);
    }

    #[test]
    fn parallel_curves_give_a_named_failure() {
        let [leading, trailing] = contours(110.0, 0.01);
        let limits = TipLimits::new(1.0).unwrap();
        // Both y curves are the same line up to noise: wherever they cross says nothing.
        let failure = intersect(&leading, &trailing, Plane::Yoz, &limits).unwrap_err();
        assert!(matches!(failure, NoTip::IllPosed | NoTip::NoIntersection));
        let [leading, trailing] = contours(500.0, 0.0);
        let failure = intersect(&leading, &trailing, Plane::Xoz, &limits).unwrap_err();
        assert_eq!(failure.name(), "no_intersection");
    }
}
