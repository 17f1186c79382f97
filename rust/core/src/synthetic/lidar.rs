//! Simulated sensors: where they stand, how they turn, what their clocks say.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};

use super::random::{Stream, Subject};
use super::sensor::{Sensor, Shot};
use super::terrain::Ray;
use crate::angle::wrap_turn;
use crate::frame::WorldFromSensor;
use crate::packet::writer::Pace;
use crate::time::Timestamp;

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

/// A tripod that somebody knocks against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kick {
    /// When, seconds of scene time.
    pub at_s: f64,
    /// By how much it turns, right-hand about the world axes, rad.
    pub turn_rad: Vector3<f64>,
    /// By how much the optical centre moves, world frame, metres.
    pub shift_m: Vector3<f64>,
}

/// A sensor as it is planned.
#[derive(Debug, Clone)]
pub struct LidarPlan {
    /// What it is.
    pub sensor: Arc<Sensor>,
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
    /// Standard deviation of an elevation offset that all its beams share, rad.
    pub elevation_u_rad: f64,
    /// What moves it during the test.
    pub kick: Option<Kick>,
    /// From when to when nothing arrives from it, seconds of scene time.
    pub silent_s: Vec<[f64; 2]>,
}

/// A sensor as it stands.
#[derive(Debug, Clone)]
pub struct Lidar {
    /// What was planned.
    pub plan: LidarPlan,
    /// Its pose.
    pub world_from_sensor: WorldFromSensor,
    /// Errors of range by ring, metres.
    pub range_offset_m: Vec<f64>,
    /// Its beams point this far above where the maker says, rad.
    pub elevation_rad: f64,
    start: Timestamp,
    first_ns: i64,
    /// Number of the first row since the rotor passed zero, for sensors that the encoder paces.
    first_row: u32,
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
        let mut range_offset_m = vec![0.0; plan.sensor.rings];
        for ring in plan.sensor.firing_order() {
            range_offset_m[usize::from(ring)] = unit + plan.channel_offset_m * stream.normal();
        }
        let mut lidar = Self {
            world_from_sensor: WorldFromSensor::new(rotation, plan.position_m),
            range_offset_m,
            elevation_rad: 0.0,
            start,
            first_ns: stream.between(0.0, plan.packet_ns()) as i64,
            first_row: 0,
            phase_rad: stream.between(0.0, TAU),
            rotation,
            plan,
        };
        lidar.elevation_rad = lidar.plan.elevation_u_rad * stream.normal();
        if let Pace::Encoder(rows_per_turn) = lidar.plan.sensor.writer.pace() {
            let turns = lidar.turned_rad(lidar.first_ns as f64) / TAU;
            let rows = lidar.plan.sensor.writer.rows() as u32;
            let passed = (turns * f64::from(rows_per_turn)).ceil() as u32;
            lidar.first_row = passed.div_ceil(rows) * rows;
        }
        lidar
    }

    /// Packets that are complete before `duration_ns` of scene time.
    pub fn packets(&self, duration_ns: i64) -> u32 {
        (0..)
            .find(|packet| self.end_ns(*packet) > duration_ns as f64)
            .unwrap_or(0)
    }

    /// Scene time at which a packet is complete, ns.
    pub fn end_ns(&self, packet: u32) -> f64 {
        self.scene_ns(self.row_ns(packet + 1, 0))
    }

    /// Device time of the start of a row, counted from scene time 0, ns.
    pub fn row_ns(&self, packet: u32, row: usize) -> f64 {
        let rows = self.plan.sensor.writer.rows();
        let number = packet as usize * rows + row;
        match self.plan.sensor.writer.pace() {
            Pace::Clock(row_ns) => self.first_ns as f64 + number as f64 * row_ns,
            Pace::Encoder(rows_per_turn) => {
                let row = self.first_row as usize + number;
                let turned_rad = row as f64 / f64::from(rows_per_turn) * TAU;
                self.reached_ns(turned_rad) * (1.0 + self.plan.clock.drift)
            }
        }
    }

    /// Scene time of a device time that counts from scene time 0, ns.
    pub fn scene_ns(&self, device_ns: f64) -> f64 {
        device_ns / (1.0 + self.plan.clock.drift)
    }

    /// What the device says at a device time that counts from scene time 0.
    pub fn device(&self, device_ns: f64) -> Timestamp {
        self.start + (self.plan.clock.offset_ns + device_ns as i64)
    }

    /// Number of a packet since the rotor passed zero.
    pub fn sequence(&self, packet: u32) -> u32 {
        self.first_row / self.plan.sensor.writer.rows() as u32 + packet
    }

    /// Rate of the rotor, rad/ns.
    pub fn rate_rad_per_ns(&self) -> f64 {
        TAU * self.plan.rpm / 60e9
    }

    /// Angle turned at a scene time; the motor hunts a little.
    fn turned_rad(&self, scene_ns: f64) -> f64 {
        let seconds = scene_ns * 1e-9;
        self.phase_rad + TAU * self.plan.rpm / 60.0 * seconds + self.hunting_rad(seconds)
    }

    fn hunting_rad(&self, seconds: f64) -> f64 {
        0.004 * (TAU * 0.37 * seconds + self.phase_rad).sin()
    }

    /// Scene time at which the rotor has turned by an angle, ns.
    fn reached_ns(&self, turned_rad: f64) -> f64 {
        let even = (turned_rad - self.phase_rad) / self.rate_rad_per_ns();
        // Hunting is slow: each step leaves less than a thousandth of the error.
        (0..5).fold(even, |scene_ns, _| {
            even - self.hunting_rad(scene_ns * 1e-9) / self.rate_rad_per_ns()
        })
    }

    /// Azimuth at a scene time, [0, 2 pi).
    pub fn azimuth_rad(&self, scene_ns: f64) -> f64 {
        wrap_turn(self.turned_rad(scene_ns))
    }

    /// Its pose at a scene time.
    pub fn pose(&self, scene_ns: f64) -> (Rotation3<f64>, Vector3<f64>) {
        match &self.plan.kick {
            Some(kick) if scene_ns >= kick.at_s * 1e9 => (
                Rotation3::from_scaled_axis(kick.turn_rad) * self.rotation,
                self.plan.position_m + kick.shift_m,
            ),
            _ => (self.rotation, self.plan.position_m),
        }
    }

    /// Whether nothing arrives that is sent at a scene time.
    pub fn is_silent(&self, scene_ns: f64) -> bool {
        let seconds = scene_ns * 1e-9;
        let mut spans = self.plan.silent_s.iter();
        spans.any(|[from, to]| (*from..*to).contains(&seconds))
    }

    /// The ray of a shot at a scene time.
    pub fn ray(&self, shot: &Shot, scene_ns: f64) -> Ray {
        self.ray_at(shot, scene_ns, self.azimuth_rad(scene_ns))
    }

    /// The ray of a shot at a scene time, were the rotor at this azimuth.
    pub fn ray_at(&self, shot: &Shot, scene_ns: f64, azimuth_rad: f64) -> Ray {
        let (rotation, position_m) = self.pose(scene_ns);
        let turned = rotation * Rotation3::from_axis_angle(&Vector3::z_axis(), -azimuth_rad);
        Ray {
            origin_m: position_m + turned * shot.origin_m,
            direction: turned * raised(&shot.direction, self.elevation_rad),
        }
    }

    /// A point in the sensor's frame, metres.
    pub fn sensor_from_world(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.inverse() * (point_m - self.plan.position_m)
    }

    /// Largest elevation of a beam, rad.
    pub fn reach_rad(&self) -> f64 {
        self.plan.sensor.reach_rad
    }
}

/// A direction whose elevation above the plane of rotation is larger by an angle, rad.
fn raised(direction: &Vector3<f64>, elevation_rad: f64) -> Vector3<f64> {
    if elevation_rad == 0.0 {
        return *direction;
    }
    match Vector3::z().cross(direction).try_normalize(1e-9) {
        Some(level) => Rotation3::new(level * -elevation_rad) * direction,
        None => *direction, // along the axis of rotation there is no elevation
    }
}

impl LidarPlan {
    /// Time that a packet spans, ns.
    pub fn packet_ns(&self) -> f64 {
        let writer = self.sensor.writer;
        let row_ns = match writer.pace() {
            Pace::Clock(row_ns) => row_ns,
            Pace::Encoder(rows_per_turn) => 60e9 / self.rpm / f64::from(rows_per_turn),
        };
        row_ns * writer.rows() as f64
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) fn lidar(clock: Clock) -> Lidar {
        of("vlp16", clock)
    }

    fn of(id: &str, clock: Clock) -> Lidar {
        let plan = LidarPlan {
            sensor: Arc::new(Sensor::new(id).unwrap()),
            address: [192, 168, 1, 201],
            port: 2368,
            position_m: Vector3::new(3.0, -7.0, 90.0),
            axes: Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI),
            tilt_rad: 0.03,
            rpm: 600.0,
            clock,
            channel_offset_m: 0.01,
            unit_offset_m: 0.0,
            elevation_u_rad: 0.0,
            kick: None,
            silent_s: Vec::new(),
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
        let [ours, theirs] = [&own, &utc].map(|lidar| lidar.device(lidar.row_ns(0, 0)));
        assert_eq!(ours + 1_000_000_000, theirs);
        // After 10 s a clock that gains 50 ppm is 0.5 ms ahead.
        let [ours, theirs] = [&own, &utc].map(|lidar| lidar.end_ns(7534));
        assert!((theirs - ours - 0.5e6).abs() < 1e4);
        assert!((752..=753).contains(&utc.packets(1_000_000_000)));
    }

    #[test]
    fn rays_point_as_the_driver_publishes() {
        let lidar = lidar(Clock::default());
        let shot = lidar.plan.sensor.shots[0][15].unwrap();
        let ray = lidar.ray_at(&shot, 0.0, 0.3);
        let point = lidar.sensor_from_world(&ray.at(20.0));
        assert!((point.y / point.x + 0.3f64.tan()).abs() < 1e-6);
        assert!((point.z - 20.0 * 15f64.to_radians().sin() + 0.011_23).abs() < 2e-5);
    }

    #[test]
    fn an_elevation_offset_lifts_every_ray_alike() {
        let exact = lidar(Clock::default());
        let plan = LidarPlan {
            elevation_u_rad: 1e-3,
            ..exact.plan.clone()
        };
        let lifted = Lidar::new(plan, 3, 0, Timestamp(1_718_000_000_000_000_000));
        assert!(lifted.elevation_rad.abs() > 1e-5);
        assert_eq!(lifted.range_offset_m, exact.range_offset_m); // all else is drawn as before
        for ring in [0, 7, 15] {
            let shot = exact.plan.sensor.shots[0][ring].unwrap();
            let elevation = |lidar: &Lidar| {
                let ray = lidar.ray_at(&shot, 0.0, 0.3);
                (lidar.rotation.inverse() * ray.direction).z.asin()
            };
            let by = elevation(&lifted) - elevation(&exact);
            assert!((by - lifted.elevation_rad).abs() < 1e-9, "{by}");
        }
    }

    #[test]
    fn a_kicked_tripod_stands_otherwise_from_then_on() {
        let mut lidar = lidar(Clock::default());
        lidar.plan.kick = Some(Kick {
            at_s: 2.0,
            turn_rad: Vector3::y() * 5e-4,
            shift_m: Vector3::x() * 2e-3,
        });
        lidar.plan.silent_s = vec![[3.0, 4.0]];
        let shot = lidar.plan.sensor.shots[0][7].unwrap();
        let [before, after] = [1.9e9, 2.1e9].map(|ns| lidar.ray_at(&shot, ns, 1.0));
        assert!((after.origin_m - before.origin_m).norm() < 2.1e-3);
        assert!(((after.origin_m - before.origin_m).x - 2e-3).abs() < 3e-5);
        assert!((after.direction - before.direction).norm() > 1e-4);
        assert!(lidar.is_silent(3.5e9) && !lidar.is_silent(4.5e9));
    }

    #[test]
    fn an_encoder_paces_rows_at_even_angles() {
        let lidar = of("os1-32", Clock::default());
        for (packet, row) in [(0, 0), (3, 7), (200, 15)] {
            let azimuth = lidar.azimuth_rad(lidar.scene_ns(lidar.row_ns(packet, row)));
            let number = (lidar.sequence(packet) * 16) as usize + row;
            let expected = wrap_turn(number as f64 / 1024.0 * TAU);
            assert!((azimuth - expected).abs() < 1e-8, "{azimuth} {expected}");
        }
        assert!((lidar.plan.packet_ns() - 1_562_500.0).abs() < 1e-6);
    }
}
