//! Point clouds: columns of equal length, one row per echo.

use std::marker::PhantomData;
use std::ops::Range;

use nalgebra::Point3;

use crate::frame::RigidTransform;
use crate::time::Timestamp;

/// What an echo is among the echoes of its laser shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum ReturnKind {
    /// The only or the strongest one of a single-return sensor setting.
    Strongest = 0,
    /// The last along the ray.
    Last = 1,
    /// The first along the ray.
    First = 2,
    /// The second strongest.
    Second = 3,
    /// A second return that repeats the first: one echo, reported twice by the sensor.
    Merged = 4,
}

/// One echo in the frame of its sensor, as decoded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Return {
    /// Position, metres.
    pub xyz_m: [f32; 3],
    /// Instant of the shot.
    pub time: Timestamp,
    /// Range, metres.
    pub range_m: f32,
    /// Azimuth of the shot in the sensor's own sense of rotation, [0, 2 pi).
    pub azimuth_rad: f32,
    /// Number of the beam; the order is the family's (Velodyne: 0 = lowest).
    pub ring: u16,
    /// Brightness as the sensor reports it.
    pub intensity: u16,
    /// Place among the returns of the shot, 0-based.
    pub return_index: u8,
    /// Meaning of the return.
    pub return_kind: ReturnKind,
    /// Number of the packet among the data packets of its stream, 0-based.
    pub packet: u32,
    /// Block or column within the packet.
    pub block: u16,
}

#[cfg(test)]
impl Return {
    /// An echo for tests, at a place and an instant; the rest to be changed where it matters.
    pub(crate) fn made_up(xyz_m: [f32; 3], time: Timestamp) -> Self {
        Self {
            xyz_m,
            time,
            range_m: 1.0,
            azimuth_rad: 0.0,
            ring: 0,
            intensity: 1,
            return_index: 0,
            return_kind: ReturnKind::Strongest,
            packet: 0,
            block: 0,
        }
    }
}

/// Echoes in frame `F`, one column per quantity.
#[derive(Debug, Clone)]
pub struct PointCloud<F> {
    /// Positions, metres.
    pub xyz_m: Vec<[f32; 3]>,
    /// Instants of the shots, nanoseconds since 1970 UTC.
    pub time_ns: Vec<i64>,
    /// Ranges, metres.
    pub range_m: Vec<f32>,
    /// Azimuths of the shots, [0, 2 pi).
    pub azimuth_rad: Vec<f32>,
    /// Numbers of the beams.
    pub ring: Vec<u16>,
    /// Brightness as the sensor reports it.
    pub intensity: Vec<u16>,
    /// Places among the returns of the shot.
    pub return_index: Vec<u8>,
    /// Meanings of the returns.
    pub return_kind: Vec<ReturnKind>,
    /// Numbers of the packets within their stream.
    pub packet: Vec<u32>,
    /// Blocks or columns within the packets.
    pub block: Vec<u16>,
    frame: PhantomData<F>,
}

impl<F> Default for PointCloud<F> {
    fn default() -> Self {
        Self {
            xyz_m: Vec::new(),
            time_ns: Vec::new(),
            range_m: Vec::new(),
            azimuth_rad: Vec::new(),
            ring: Vec::new(),
            intensity: Vec::new(),
            return_index: Vec::new(),
            return_kind: Vec::new(),
            packet: Vec::new(),
            block: Vec::new(),
            frame: PhantomData,
        }
    }
}

impl<F> PointCloud<F> {
    /// Number of echoes.
    pub fn len(&self) -> usize {
        self.xyz_m.len()
    }

    /// Whether there is no echo.
    pub fn is_empty(&self) -> bool {
        self.xyz_m.is_empty()
    }

    /// Appends one echo.
    pub fn push(&mut self, echo: &Return) {
        self.xyz_m.push(echo.xyz_m);
        self.time_ns.push(echo.time.0);
        self.range_m.push(echo.range_m);
        self.azimuth_rad.push(echo.azimuth_rad);
        self.ring.push(echo.ring);
        self.intensity.push(echo.intensity);
        self.return_index.push(echo.return_index);
        self.return_kind.push(echo.return_kind);
        self.packet.push(echo.packet);
        self.block.push(echo.block);
    }

    /// Appends the echoes of another cloud at these places.
    ///
    /// # Panics
    /// Where `places` reaches beyond the other cloud.
    pub fn extend(&mut self, other: &Self, places: Range<usize>) {
        self.xyz_m.extend_from_slice(&other.xyz_m[places.clone()]);
        self.time_ns
            .extend_from_slice(&other.time_ns[places.clone()]);
        self.range_m
            .extend_from_slice(&other.range_m[places.clone()]);
        self.azimuth_rad
            .extend_from_slice(&other.azimuth_rad[places.clone()]);
        self.ring.extend_from_slice(&other.ring[places.clone()]);
        self.intensity
            .extend_from_slice(&other.intensity[places.clone()]);
        self.return_index
            .extend_from_slice(&other.return_index[places.clone()]);
        self.return_kind
            .extend_from_slice(&other.return_kind[places.clone()]);
        self.packet.extend_from_slice(&other.packet[places.clone()]);
        self.block.extend_from_slice(&other.block[places]);
    }

    /// The echo at a place.
    ///
    /// # Panics
    /// Where there is none.
    pub fn get(&self, place: usize) -> Return {
        Return {
            xyz_m: self.xyz_m[place],
            time: Timestamp(self.time_ns[place]),
            range_m: self.range_m[place],
            azimuth_rad: self.azimuth_rad[place],
            ring: self.ring[place],
            intensity: self.intensity[place],
            return_index: self.return_index[place],
            return_kind: self.return_kind[place],
            packet: self.packet[place],
            block: self.block[place],
        }
    }

    /// The echoes one by one.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Return> + '_ {
        (0..self.len()).map(|place| self.get(place))
    }

    /// Removes all echoes and keeps the memory.
    pub fn clear(&mut self) {
        self.xyz_m.clear();
        self.time_ns.clear();
        self.range_m.clear();
        self.azimuth_rad.clear();
        self.ring.clear();
        self.intensity.clear();
        self.return_index.clear();
        self.return_kind.clear();
        self.packet.clear();
        self.block.clear();
    }

    /// Takes the azimuths out, in degrees, [0, 360).
    pub fn take_azimuth_deg(&mut self) -> Vec<f32> {
        let mut azimuth = std::mem::take(&mut self.azimuth_rad);
        azimuth.iter_mut().for_each(|own| *own = in_degrees(own));
        azimuth
    }

    /// Takes the meanings of the returns out as numbers: the place of each in the declaration of [`ReturnKind`].
    pub fn take_return_kind_codes(&mut self) -> Vec<u8> {
        let return_kind = std::mem::take(&mut self.return_kind).into_iter();
        return_kind.map(|kind| kind as u8).collect()
    }

    /// Makes room for `additional` more echoes.
    pub fn reserve(&mut self, additional: usize) {
        self.xyz_m.reserve(additional);
        self.time_ns.reserve(additional);
        self.range_m.reserve(additional);
        self.azimuth_rad.reserve(additional);
        self.ring.reserve(additional);
        self.intensity.reserve(additional);
        self.return_index.reserve(additional);
        self.return_kind.reserve(additional);
        self.packet.reserve(additional);
        self.block.reserve(additional);
    }

    /// Carries all positions into another frame; the other columns move along unchanged.
    pub fn transform<To>(self, to_from: &RigidTransform<To, F>) -> PointCloud<To> {
        let carry = |[x, y, z]: [f32; 3]| {
            let point = Point3::new(f64::from(x), f64::from(y), f64::from(z));
            let carried = to_from.transform(&point);
            [carried.x as f32, carried.y as f32, carried.z as f32]
        };
        PointCloud {
            xyz_m: self.xyz_m.into_iter().map(carry).collect(),
            time_ns: self.time_ns,
            range_m: self.range_m,
            azimuth_rad: self.azimuth_rad,
            ring: self.ring,
            intensity: self.intensity,
            return_index: self.return_index,
            return_kind: self.return_kind,
            packet: self.packet,
            block: self.block,
            frame: PhantomData,
        }
    }
}

/// An azimuth in degrees as files and cells have it.
#[inline]
pub fn in_degrees(azimuth_rad: &f32) -> f32 {
    f64::from(*azimuth_rad).to_degrees() as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Sensor, WorldFromSensor};
    use nalgebra::{Rotation3, Vector3};

    #[test]
    fn a_cloud_moves_with_its_pose() {
        let echo = Return {
            xyz_m: [1.0, 0.0, 0.0],
            time: Timestamp(7),
            range_m: 1.0,
            azimuth_rad: 0.0,
            ring: 3,
            intensity: 100,
            return_index: 0,
            return_kind: ReturnKind::Strongest,
            packet: 0,
            block: 0,
        };
        let mut cloud = PointCloud::<Sensor>::default();
        cloud.push(&echo);
        let quarter = Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        let pose = WorldFromSensor::new(quarter, Vector3::new(0.0, 0.0, 10.0));
        let world = cloud.transform(&pose);
        assert!((world.xyz_m[0][1] - 1.0).abs() < 1e-6 && world.xyz_m[0][2] == 10.0);
        assert_eq!((world.len(), world.ring[0], world.time_ns[0]), (1, 3, 7));
    }
}
