//! The lidars in an adjustment: poses, range offsets, elevation and scale with what is known of them.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

use super::layout::RIG;
use super::sight::Contact;
use crate::error::InvalidValue;
use crate::frame::WorldFromSensor;

/// Poses and errors of all lidars with their joint covariance.
#[derive(Debug, Clone)]
pub struct Rig {
    /// Poses to start from.
    pub poses: Vec<WorldFromSensor>,
    /// Channels of each lidar.
    pub channels: Vec<usize>,
    /// Standard deviation of each lidar's clock against the others, seconds.
    pub clock_s: Vec<f64>,
    /// By lidar: rotation (3), translation (3), elevation, scale, channel offsets; as estimated so far.
    pub values: DVector<f64>,
    /// Before the data: expected values ...
    pub prior: DVector<f64>,
    /// ... and their inverse covariance.
    pub information: DMatrix<f64>,
}

/// A lidar as the present unknowns have it.
#[derive(Debug, Clone)]
pub struct Lidar {
    turn: Matrix3<f64>,
    /// Optical centre, world, metres.
    pub origin: Vector3<f64>,
    elevation_rad: f64,
    scale: f64,
    channels: Vec<f64>,
    spin: Vector3<f64>,
}

impl Rig {
    /// Checks shapes and inverts the covariance of all unknowns of all lidars.
    ///
    /// # Errors
    /// [`InvalidValue`] where sizes do not fit or the covariance is not positive.
    pub fn new(
        poses: Vec<WorldFromSensor>,
        channels: Vec<usize>,
        clock_s: Vec<f64>,
        prior: DVector<f64>,
        mut covariance: DMatrix<f64>,
    ) -> Result<Self, InvalidValue> {
        let count: usize = channels.iter().map(|c| c + RIG).sum();
        let refuse = |found: String| InvalidValue {
            name: "covariance",
            expected: format!("{count} x {count}, positive"),
            found,
        };
        if covariance.shape() != (count, count)
            || prior.len() != count
            || poses.len() != channels.len()
            || clock_s.len() != channels.len()
        {
            return Err(refuse(format!(
                "{:?} and {} values",
                covariance.shape(),
                prior.len()
            )));
        }
        // An exactly known value would make the inverse infinite.
        for (i, floor) in floors(&channels).into_iter().enumerate() {
            covariance[(i, i)] += floor * floor;
        }
        let factor = covariance
            .cholesky()
            .ok_or_else(|| refuse("one that is not positive".into()))?;
        Ok(Self {
            poses,
            channels,
            clock_s,
            values: prior.clone(),
            prior,
            information: factor.inverse(),
        })
    }

    /// First value of a lidar.
    fn at(&self, lidar: usize) -> usize {
        self.channels[..lidar].iter().map(|c| c + RIG).sum()
    }

    /// A lidar with its present corrections.
    pub fn lidar(&self, lidar: usize) -> Lidar {
        let first = self.at(lidar);
        let value = |k: usize| self.values[first + k];
        let turn = Rotation3::from_scaled_axis(Vector3::new(value(0), value(1), value(2)));
        let pose = &self.poses[lidar];
        let turn = turn.matrix() * pose.rotation().matrix();
        Lidar {
            origin: pose.translation_m() + Vector3::new(value(3), value(4), value(5)),
            elevation_rad: value(6),
            scale: value(7),
            channels: (0..self.channels[lidar]).map(|c| value(RIG + c)).collect(),
            spin: turn.column(2).into_owned(),
            turn,
        }
    }
}

/// Nothing is known better than this: 1 microrad, 10 micrometres, 0.1 ppm.
fn floors(channels: &[usize]) -> Vec<f64> {
    let of = |count: &usize| {
        let mut floors = vec![1e-6, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5, 1e-6, 1e-7];
        floors.resize(RIG + count, 1e-5);
        floors
    };
    channels.iter().flat_map(of).collect()
}

impl Lidar {
    /// World direction of a shot, unit length.
    pub fn direction(&self, sensor: &Vector3<f64>) -> Vector3<f64> {
        let direction = self.turn * sensor;
        (direction + self.up(&direction) * self.elevation_rad).normalize()
    }

    /// Towards larger elevation, at a right angle to a direction.
    fn up(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let up = self.spin - direction * self.spin.dot(direction);
        up / up.norm().max(1e-6)
    }

    /// What the sensor would report for a true range, metres: its offset and scale taken back.
    pub fn reported_m(&self, true_m: f64, ring: usize) -> f64 {
        let offset = self.channels.get(ring).copied().unwrap_or(0.0);
        (true_m - offset) / (1.0 + self.scale)
    }

    /// The range, for what the sensor reports, metres.
    pub fn true_m(&self, reported_m: f64, ring: usize) -> f64 {
        let offset = self.channels.get(ring).copied().unwrap_or(0.0);
        reported_m * (1.0 + self.scale) + offset
    }

    /// How a lidar's unknowns move `along . displacement` of a contact against its rays; from `first`.
    pub fn slopes(
        &self,
        contact: &Contact,
        along: &Vector3<f64>,
        first: usize,
        out: &mut Vec<(usize, f64)>,
    ) {
        let lever = contact.point - self.origin;
        let turn = along.cross(&lever);
        out.extend((0..3).map(|k| (first + k, turn[k])));
        out.extend((0..3).map(|k| (first + 3 + k, -along[k])));
        let range = lever.norm();
        out.push((first + 6, -along.dot(&self.up(&(lever / range))) * range));
    }
}
