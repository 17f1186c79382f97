//! The plan of a simulated test, and what follows from it alone.

use nalgebra::{Rotation3, Vector3};

use super::blade::{Blade, BuildErrors, Orientation};
use super::body::Saddle;
use super::echo::Optics;
use super::lidar::LidarPlan;
use super::motion::{Schedule, Sway};
use super::network::NetworkPlan;
use super::reference::Stations;
use super::solver::Pull;
use super::target::Target;
use super::terrain::{Crate, GroundPlan, Wall};
use crate::error::InvalidValue;
use crate::time::Timestamp;

/// Where a winch pulls.
#[derive(Debug, Clone, Copy)]
pub struct SaddlePlan {
    /// Arc length, metres.
    pub s_m: f64,
    /// Force at full load, N.
    pub force_n: f64,
    /// Where the cable is fixed, from the axis along chord and towards the suction side, metres.
    pub lever_m: [f64; 2],
    /// End of the cable at the winch, metres.
    pub anchor_m: Vector3<f64>,
}

/// Everything that a simulated test is made of.
#[derive(Debug, Clone)]
pub struct ScenePlan {
    /// Seed of all that is drawn.
    pub seed: u64,
    /// UTC of scene time 0.
    pub start: Timestamp,
    /// The drawing of the blade.
    pub stations: Stations,
    /// How it is clamped.
    pub orientation: Orientation,
    /// How far the built blade may differ.
    pub errors: BuildErrors,
    /// Direction of the pull, world frame.
    pub direction: Vector3<f64>,
    /// Whether the pull turns with the section.
    pub follower: bool,
    /// Pulls.
    pub saddles: Vec<SaddlePlan>,
    /// Whether the saddles' frames can be seen.
    pub show_saddles: bool,
    /// Radius of the cables, metres; 0 = none.
    pub cable_radius_m: f64,
    /// Load steps.
    pub schedule: Schedule,
    /// Modes in which the blade sways.
    pub sways: Vec<Sway>,
    /// Rotation of the root at full load, rad about the world axes.
    pub root_turn_rad: Vector3<f64>,
    /// The ground.
    pub ground: GroundPlan,
    /// A wall.
    pub wall: Option<Wall>,
    /// Boxes.
    pub boxes: Vec<Crate>,
    /// Targets.
    pub targets: Vec<Target>,
    /// Sensors.
    pub lidars: Vec<LidarPlan>,
    /// Optics of all sensors.
    pub optics: Optics,
    /// The network.
    pub network: NetworkPlan,
}

impl ScenePlan {
    /// Pulls at the nodes `arc_m`.
    pub(super) fn pulls(&self, blade: &Blade, arc_m: &[f64]) -> Result<Vec<Pull>, InvalidValue> {
        let pull = |saddle: &SaddlePlan| {
            let node = arc_m.iter().position(|s| (s - saddle.s_m).abs() < 1e-6);
            let node = node.filter(|node| *node > 0).ok_or_else(|| InvalidValue {
                name: "saddles.s_m",
                expected: format!("above 0 and up to {} m", blade.built.length_m()),
                found: saddle.s_m.to_string(),
            })?;
            let (chord, normal) = blade.directions(saddle.s_m);
            Ok(Pull {
                node,
                force_n: self.direction.normalize() * saddle.force_n,
                lever_m: chord * saddle.lever_m[0] + normal * saddle.lever_m[1],
                follower: self.follower,
            })
        };
        self.saddles.iter().map(pull).collect()
    }

    /// What is seen of the saddles: frames a hand wider than the section.
    pub(super) fn frames(&self, blade: &Blade, pulls: &[Pull]) -> Vec<Saddle> {
        let frame = |(saddle, pull): (&SaddlePlan, &Pull)| {
            let skin = blade.skin(saddle.s_m);
            let (chord, normal) = blade.directions(saddle.s_m);
            let extent = |axis: &Vector3<f64>| {
                let places = skin.iter().map(|p| axis.x * p.x + axis.y * p.y);
                places.fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p), b.max(p)))
            };
            let [(a, b), (c, d)] = [extent(&chord), extent(&normal)];
            Saddle {
                node: pull.node,
                middle_m: chord * (0.5 * (a + b)) + normal * (0.5 * (c + d)),
                half_m: Vector3::new(0.5 * (b - a) + 0.15, 0.5 * (d - c) + 0.15, 0.25),
                chord,
                anchor_m: saddle.anchor_m,
                cable_radius_m: self.cable_radius_m,
            }
        };
        let shown = if self.show_saddles { pulls.len() } else { 0 };
        self.saddles
            .iter()
            .zip(pulls)
            .take(shown)
            .map(frame)
            .collect()
    }
}

/// The rotation whose columns are where the sensor's axes point.
///
/// # Errors
/// [`InvalidValue`] where the three are not a right-handed set of perpendicular directions.
pub fn axes(columns: [Vector3<f64>; 3]) -> Result<Rotation3<f64>, InvalidValue> {
    let [x, y, z] = columns;
    let right = x.cross(&y).dot(&z);
    if (right - 1.0).abs() < 1e-6 && [x, y, z].iter().all(|a| (a.norm() - 1.0).abs() < 1e-6) {
        return Ok(Rotation3::from_basis_unchecked(&[x, y, z]));
    }
    Err(InvalidValue {
        name: "lidars.axes",
        expected: "x, y and z perpendicular, of length one and right-handed".into(),
        found: format!("x cross y along z is {right:.3}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_must_be_right_handed() {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        assert_eq!(axes([-x, -y, z]).unwrap() * x, -x);
        assert!(axes([x, -y, z]).is_err() && axes([x, x, z]).is_err());
    }
}
