//! Yaw from a surveyed wall: a ground normal leaves the turn about the vertical free.

use nalgebra::{Rotation3, Unit, Vector3};
use thiserror::Error;

use crate::error::Coded;
use crate::fit::Fit;
use crate::fit::plane::{Plane, fit_plane};

/// Step of the search over yaw, radians: at 30 m a third of [`BAND_M`].
const STEP_RAD: f64 = 0.0017;
/// Points within this distance of the expected plane vote for a yaw, metres.
const BAND_M: f64 = 0.15;
/// Fewer votes than this are no wall.
const MIN_POINTS: usize = 50;

/// A surveyed wall as one lidar should see it.
#[derive(Debug, Clone, Copy)]
pub struct ExpectedWall {
    /// Normal of the surveyed plane, world frame.
    pub normal: Unit<Vector3<f64>>,
    /// Signed distance from the sensor to the plane along `normal`, metres.
    pub distance_m: f64,
    /// How far the yaw may be from the one assumed, radians.
    pub yaw_range_rad: f64,
    /// Points lower than this above the sensor do not count: the ground, metres.
    pub min_height_m: f64,
}

/// The yaw that brings a wall where it was surveyed.
#[derive(Debug, Clone)]
pub struct WallYaw {
    /// Turn about world up, radians, to be applied after levelling.
    pub yaw_rad: f64,
    /// Plane through the wall's points before that turn, origin at the sensor.
    pub plane: Fit<Plane>,
}

/// Why no yaw came out.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum WallError {
    /// Too little of it was seen.
    #[error(
        "no wall within {range_deg:.1} degrees of yaw at {distance_m:.2} m: \
         {found} points within {BAND_M} m of it, {MIN_POINTS} needed"
    )]
    NotSeen {
        /// Distance at which it was expected, metres.
        distance_m: f64,
        /// Range of the search, degrees.
        range_deg: f64,
        /// Most points that agreed.
        found: usize,
    },
}

impl Coded for WallError {
    fn code(&self) -> &'static str {
        "calibration.wall_not_seen"
    }

    fn hint(&self) -> Option<String> {
        Some(
            "check the surveyed wall points and the position of this lidar, or leave the wall out"
                .into(),
        )
    }
}

/// Finds the yaw of a levelled cloud (origin at the sensor, axes of the world up to yaw, metres)
/// from a wall at a known distance: search over yaw by votes, then the plane of the voters,
/// equations (2)-(6).
///
/// # Errors
/// [`WallError::NotSeen`] where fewer than fifty points agree on any yaw.
pub fn yaw_from_wall(levelled: &[[f32; 3]], wall: &ExpectedWall) -> Result<WallYaw, WallError> {
    let candidates: Vec<Vector3<f64>> = levelled
        .iter()
        .map(|p| Vector3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])))
        .filter(|p| p.y >= wall.min_height_m)
        .collect();
    let steps = (wall.yaw_range_rad / STEP_RAD).ceil() as i32;
    // The middle first, so that ties go to the smallest turn.
    let yaws = (0..=steps)
        .flat_map(|k| [f64::from(k), f64::from(-k)])
        .map(|k| k * STEP_RAD);
    let best = yaws
        .map(|yaw| (voters(&candidates, wall, yaw).count(), yaw))
        .fold(
            (0, 0.0),
            |best, next| if next.0 > best.0 { next } else { best },
        );
    let refuse = || WallError::NotSeen {
        distance_m: wall.distance_m.abs(),
        range_deg: wall.yaw_range_rad.to_degrees(),
        found: best.0,
    };
    if best.0 < MIN_POINTS {
        return Err(refuse());
    }
    let inliers: Vec<[f64; 3]> = voters(&candidates, wall, best.1)
        .map(|p| (*p).into())
        .collect();
    let plane = fit_plane(&inliers, &Vector3::zeros()).map_err(|_| refuse())?;
    Ok(WallYaw {
        yaw_rad: yaw_between(&plane.estimate.normal, wall),
        plane,
    })
}

fn voters<'a>(
    points: &'a [Vector3<f64>],
    wall: &ExpectedWall,
    yaw_rad: f64,
) -> impl Iterator<Item = &'a Vector3<f64>> {
    // n . (R p) = (R^T n) . p: turn the one normal instead of all points.
    let normal = Rotation3::from_axis_angle(&Vector3::y_axis(), -yaw_rad) * *wall.normal;
    let distance_m = wall.distance_m;
    points
        .iter()
        .filter(move |p| (normal.dot(p) - distance_m).abs() < BAND_M)
}

/// Turn about world up from the seen normal (towards the sensor) to the surveyed one.
fn yaw_between(seen: &Vector3<f64>, wall: &ExpectedWall) -> f64 {
    let towards_sensor = if wall.distance_m > 0.0 {
        -*wall.normal
    } else {
        *wall.normal
    };
    let heading = |v: &Vector3<f64>| v.x.atan2(v.z);
    crate::angle::wrap_half_turn(heading(&towards_sensor) - heading(seen))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of 100 m2 at x = -20, turned by `yaw`, as a sensor at the origin sees it.
    fn wall_points(yaw: f64) -> Vec<[f32; 3]> {
        let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), -yaw);
        let grid = (0..50).flat_map(|i| (0..20).map(move |j| (i, j)));
        grid.map(|(i, j)| {
            let p = turned * Vector3::new(-20.0, f64::from(j) * 0.3, f64::from(i) * 0.4 - 10.0);
            [p.x as f32, p.y as f32, p.z as f32]
        })
        .collect()
    }

    fn expected() -> ExpectedWall {
        ExpectedWall {
            normal: Vector3::x_axis(),
            distance_m: -20.0,
            yaw_range_rad: 0.17,
            min_height_m: -0.5,
        }
    }

    #[test]
    fn the_yaw_comes_back() {
        for yaw in [0.0, 0.03, -0.11, 0.169] {
            let mut points = wall_points(yaw);
            points.extend((0..400).map(|i| [5.0 + (i % 20) as f32, (i / 20) as f32, 3.0])); // a box
            let found = yaw_from_wall(&points, &expected()).unwrap();
            assert!(
                (found.yaw_rad - yaw).abs() < 1e-6,
                "{yaw}: {}",
                found.yaw_rad
            );
            assert_eq!(found.plane.count, 1000);
        }
    }

    #[test]
    fn no_wall_is_an_error_with_the_votes() {
        let error = yaw_from_wall(&wall_points(0.6)[..200], &expected()).unwrap_err();
        assert_eq!(error.code(), "calibration.wall_not_seen");
    }
}
