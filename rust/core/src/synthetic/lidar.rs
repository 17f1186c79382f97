//! Simulated sensors: where they stand, how they turn, what their clocks say.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3};

use super::random::{Stream, Subject};
use super::terrain::Ray;
use crate::angle::wrap_turn;
use crate::error::InvalidValue;
use crate::frame::WorldFromSensor;
use crate::packet::velodyne::{BLOCKS, puck};
use crate::time::{NANOS_PER_HOUR, Timestamp};

/// A model of sensor: what its drawing says. Lasers in the order in which they fire.
#[derive(Debug)]
pub struct SensorModel {
    /// The product's name as in configurations.
    pub id: &'static str,
    /// Angles above the plane of rotation, degrees.
    pub elevation_deg: &'static [f64],
    /// Distance from the spin axis to where the beams cross, metres.
    pub focal_m: f64,
}

/// The models that can be simulated.
pub static MODELS: [SensorModel; 1] = [SensorModel {
    id: "vlp16",
    elevation_deg: &[
        -15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0,
        15.0,
    ],
    focal_m: 0.041_91,
}];

/// The model of this name.
///
/// # Errors
/// [`InvalidValue`] for a model that cannot be simulated yet.
pub fn model(id: &str) -> Result<&'static SensorModel, InvalidValue> {
    MODELS
        .iter()
        .find(|model| model.id == id)
        .ok_or_else(|| InvalidValue {
            name: "lidars.model",
            expected: MODELS
                .iter()
                .map(|model| model.id)
                .collect::<Vec<_>>()
                .join(", "),
            found: id.into(),
        })
}

/// Device time that a packet spans, ns.
pub const PACKET_NS: i64 = BLOCKS as i64 * puck::BLOCK_NS;

/// A clock against UTC.
#[derive(Debug, Clone, Copy, Default)]
pub struct Clock {
    /// Ahead of UTC at the start, ns.
    pub offset_ns: i64,
    /// Gain per second, s/s.
    pub drift: f64,
    /// Whether a receiver keeps it on UTC.
    pub locked: bool,
}

/// A sensor as it is planned.
#[derive(Debug, Clone)]
pub struct LidarPlan {
    /// Its model.
    pub model: &'static SensorModel,
    /// Address it sends from.
    pub address: [u8; 4],
    /// Port it sends to.
    pub port: u16,
    /// Optical centre, world frame, metres.
    pub position_m: Vector3<f64>,
    /// Where its axes point by the plan.
    pub axes: Rotation3<f64>,
    /// Standard deviation of its tilt about each axis, rad.
    pub tilt_rad: f64,
    /// Turns per minute.
    pub rpm: f64,
    /// Its clock.
    pub clock: Clock,
    /// Standard deviation of the range offset of each laser, metres.
    pub channel_offset_m: f64,
    /// Standard deviation of the range offset of the unit, metres.
    pub unit_offset_m: f64,
}

/// A sensor as it stands.
#[derive(Debug, Clone)]
pub struct Lidar {
    /// What was planned.
    pub plan: LidarPlan,
    /// Its pose.
    pub world_from_sensor: WorldFromSensor,
    /// Errors of range by laser, metres.
    pub range_offset_m: Vec<f64>,
    start: Timestamp,
    first_ns: i64,
    phase_rad: f64,
    rotation: Rotation3<f64>,
}

impl Lidar {
    /// Puts the sensor up with errors drawn from `seed`; `index` is its number in the scene and
    /// `start` the instant of scene time 0.
    pub fn new(plan: LidarPlan, seed: u64, index: usize, start: Timestamp) -> Self {
        let mut stream = Stream::new(seed, Subject::Lidar, [index as u64, 0]);
        // Beyond two standard deviations a mount is straightened by hand.
        let tilts = [(); 3].map(|()| plan.tilt_rad * stream.normal().clamp(-2.0, 2.0));
        let rotation = Rotation3::from_scaled_axis(Vector3::from(tilts)) * plan.axes;
        let unit = plan.unit_offset_m * stream.normal();
        let offset = |_| unit + plan.channel_offset_m * stream.normal();
        let range_offset_m = (0..plan.model.elevation_deg.len()).map(offset).collect();
        Self {
            world_from_sensor: WorldFromSensor::new(rotation, plan.position_m),
            range_offset_m,
            start,
            first_ns: stream.between(0.0, PACKET_NS as f64) as i64,
            phase_rad: stream.between(0.0, TAU),
            rotation,
            plan,
        }
    }

    /// Packets that are complete before `duration_ns` of scene time.
    pub fn packets(&self, duration_ns: i64) -> u32 {
        (0..)
            .find(|k| self.scene_ns(*k, PACKET_NS) > duration_ns as f64)
            .unwrap_or(0)
    }

    /// Scene time of `after_ns` of device time after the first shot of a packet, ns.
    pub fn scene_ns(&self, packet: u32, after_ns: i64) -> f64 {
        let device_ns = self.first_ns + i64::from(packet) * PACKET_NS + after_ns;
        device_ns as f64 / (1.0 + self.plan.clock.drift)
    }

    /// What the device writes into a packet, microseconds past the hour.
    pub fn stamp_us(&self, packet: u32) -> u32 {
        let ahead_ns = self.first_ns + self.plan.clock.offset_ns;
        let device = self.start + ahead_ns + i64::from(packet) * PACKET_NS;
        (device.0.rem_euclid(NANOS_PER_HOUR) / 1000) as u32
    }

    /// Azimuth at a scene time, [0, 2 pi); the motor hunts a little.
    pub fn azimuth_rad(&self, scene_ns: f64) -> f64 {
        let seconds = scene_ns * 1e-9;
        let hunting = 0.004 * (TAU * 0.37 * seconds + self.phase_rad).sin();
        wrap_turn(self.phase_rad + TAU * self.plan.rpm / 60.0 * seconds + hunting)
    }

    /// The ray of a laser at an azimuth.
    pub fn ray(&self, laser: usize, azimuth_rad: f64) -> Ray {
        let elevation = self.plan.model.elevation_deg[laser].to_radians();
        let (sin_e, cos_e) = elevation.sin_cos();
        let (sin_a, cos_a) = azimuth_rad.sin_cos();
        let start = Vector3::new(0.0, 0.0, -self.plan.model.focal_m * sin_e / cos_e);
        let direction = Vector3::new(cos_e * cos_a, -cos_e * sin_a, sin_e);
        Ray {
            origin_m: self.plan.position_m + self.rotation * start,
            direction: self.rotation * direction,
        }
    }

    /// A point in the sensor's frame, metres.
    pub fn sensor_from_world(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.inverse() * (point_m - self.plan.position_m)
    }

    /// Largest elevation of a laser, rad.
    pub fn reach_rad(&self) -> f64 {
        let angles = self.plan.model.elevation_deg.iter();
        angles
            .map(|angle| angle.abs())
            .fold(0.0, f64::max)
            .to_radians()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) fn lidar(clock: Clock) -> Lidar {
        let plan = LidarPlan {
            model: &MODELS[0],
            address: [192, 168, 1, 201],
            port: 2368,
            position_m: Vector3::new(3.0, -7.0, 90.0),
            axes: Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI),
            tilt_rad: 0.03,
            rpm: 600.0,
            clock,
            channel_offset_m: 0.01,
            unit_offset_m: 0.0,
        };
        Lidar::new(plan, 3, 0, Timestamp(1_718_000_000_000_000_000))
    }

    #[test]
    fn packets_follow_their_own_clock() {
        let clock = Clock {
            offset_ns: -1_000_000_000,
            drift: 5e-5,
            locked: false,
        };
        let (own, utc) = (lidar(clock), lidar(Clock::default()));
        assert_eq!(own.stamp_us(0) + 1_000_000, utc.stamp_us(0));
        // After 10 s a clock that gains 50 ppm is 0.5 ms ahead.
        let late_ns = utc.scene_ns(7535, 0) - own.scene_ns(7535, 0);
        assert!((late_ns - 0.5e6).abs() < 1e4);
        assert!((752..=753).contains(&utc.packets(1_000_000_000)));
    }

    #[test]
    fn rays_point_as_the_driver_publishes() {
        let lidar = lidar(Clock::default());
        let ray = lidar.ray(15, 0.3);
        let point = lidar.sensor_from_world(&ray.at(20.0));
        assert!((point.y / point.x + 0.3f64.tan()).abs() < 1e-12);
        assert!((point.z - 20.0 * 15f64.to_radians().sin() + 0.011_23).abs() < 1e-5);
    }
}
