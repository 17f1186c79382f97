//! First guesses: the ground that a lidar sees, whatever stands on it.

use nalgebra::{Unit, Vector3};

use super::hold::{Beam, Hold};
use crate::fit::plane::{Plane, fit_plane};

/// Ground may lie so far from straight beneath, radians: a mounting is known to within 20 degrees.
const BENEATH_RAD: f64 = 1.3;
/// The ground's normal is within this of where the mounting puts up, radians.
const TILT_RAD: f64 = 0.5;
/// Points within this of a plane are on it, metres.
const ON_M: f64 = 0.06;
/// Points that are tried, and triples of them.
const SAMPLE: usize = 3000;
const TRIALS: usize = 400;
/// Fewer points than this are no ground.
const LEAST: usize = 60;
/// Ground farther away than this is seen too flatly, metres.
const RANGE_M: f64 = 20.0;

/// The largest nearly level plane beneath a lidar, sensor frame, normal towards the sensor.
pub fn ground(hold: &Hold, up_in_sensor: &Unit<Vector3<f64>>) -> Option<Plane> {
    let below: Vec<[f64; 3]> = hold
        .beams
        .iter()
        .filter(|b| {
            b.range_m < RANGE_M && (-b.direction.dot(up_in_sensor)).acos_at_most(BENEATH_RAD)
        })
        .map(point)
        .collect();
    if below.len() < LEAST {
        return None;
    }
    let thin = below.len().div_ceil(SAMPLE).max(1);
    let tried: Vec<[f64; 3]> = below.iter().copied().step_by(thin).collect();
    let best = (0..TRIALS)
        .filter_map(|trial| through(&tried, trial, up_in_sensor))
        .map(|plane| (on(&tried, &plane).len(), plane))
        .fold(None, |best: Option<(usize, Plane)>, next| match best {
            Some(best) if best.0 >= next.0 => Some(best),
            _ => Some(next),
        })?;
    let refined = fit_plane(&on(&below, &best.1), &Vector3::zeros()).ok()?;
    (refined.count >= LEAST).then_some(refined.estimate)
}

pub(super) fn point(beam: &Beam) -> [f64; 3] {
    (beam.direction.into_inner() * beam.range_m).into()
}

trait AngleWithin {
    fn acos_at_most(self, limit_rad: f64) -> bool;
}

impl AngleWithin for f64 {
    fn acos_at_most(self, limit_rad: f64) -> bool {
        self >= limit_rad.cos()
    }
}

/// The plane of three points chosen by the number of the trial, if it is nearly level and beneath.
fn through(points: &[[f64; 3]], trial: usize, up: &Unit<Vector3<f64>>) -> Option<Plane> {
    // Three strides without a common factor wander over all points, the same way on every machine.
    let pick = |stride: usize| points[(trial * stride + stride / 3) % points.len()];
    let three = [pick(7919), pick(104_729), pick(1_299_709)];
    let plane = fit_plane(&three, &Vector3::zeros()).ok()?.estimate;
    (plane.normal.dot(up) > TILT_RAD.cos()).then_some(plane)
}

fn on(points: &[[f64; 3]], plane: &Plane) -> Vec<[f64; 3]> {
    let near = |p: &&[f64; 3]| plane.distance_m(&Vector3::from(**p)).abs() < ON_M;
    points.iter().filter(near).copied().collect()
}
