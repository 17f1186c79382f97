//! All echoes of a stretch of time, in the columns that a hold needs.

use std::ops::Range;

use super::StreamInfo;
use super::beside::Taker;
use crate::cloud::{PointCloud, in_degrees};
use crate::frame::Sensor;
use crate::sweep::{Gathered, Kept, Sweep};
use crate::time::Timestamp;

/// Echoes of one lidar in the order of the shots, sensor frame.
#[derive(Debug, Default)]
pub struct HoldEchoes {
    /// Positions, metres.
    pub xyz_m: Vec<[f32; 3]>,
    /// Numbers of the beams.
    pub ring: Vec<u16>,
    /// Azimuths of the shots in the sensor's own sense of rotation, degrees.
    pub azimuth_deg: Vec<f32>,
    /// Brightness as the sensor reports it; none where nobody asked for it.
    pub intensity: Vec<f32>,
    is_dark: bool,
}

impl HoldEchoes {
    /// None yet, with room for those of a stretch of time: growing on the way would take twice the memory.
    pub fn of(info: &StreamInfo, start: Timestamp, stop: Timestamp, with_intensity: bool) -> Self {
        let room = (info.points_within(stop - start) * 1.02) as usize;
        Self {
            xyz_m: Vec::with_capacity(room),
            ring: Vec::with_capacity(room),
            azimuth_deg: Vec::with_capacity(room),
            intensity: Vec::with_capacity(if with_intensity { room } else { 0 }),
            is_dark: !with_intensity,
        }
    }
}

impl Taker for HoldEchoes {
    type Kept = Self;

    fn take(&mut self, sweep: &Sweep<Self>) {
        let cloud = &sweep.cloud;
        self.xyz_m.extend_from_slice(&cloud.xyz_m);
        self.ring.extend_from_slice(&cloud.ring);
        self.azimuth_deg.extend_from_slice(&cloud.azimuth_deg);
        if !self.is_dark {
            self.intensity.extend_from_slice(&cloud.intensity);
        }
    }
}

impl Kept for HoldEchoes {
    const IS_SLIM: bool = false;

    fn take(&mut self, from: &PointCloud<Sensor>, places: Range<usize>) {
        self.xyz_m.extend_from_slice(&from.xyz_m[places.clone()]);
        self.ring.extend_from_slice(&from.ring[places.clone()]);
        let azimuths = from.azimuth_rad[places.clone()].iter();
        self.azimuth_deg.extend(azimuths.map(in_degrees));
        let intensity = from.intensity[places].iter();
        self.intensity
            .extend(intensity.map(|seen| f32::from(*seen)));
    }
}

impl Gathered for HoldEchoes {
    fn count(&self) -> usize {
        self.xyz_m.len()
    }

    fn make_room(&mut self, additional: usize) {
        self.xyz_m.reserve(additional);
        self.ring.reserve(additional);
        self.azimuth_deg.reserve(additional);
        self.intensity.reserve(additional);
    }

    fn empty(&mut self) {
        self.xyz_m.clear();
        self.ring.clear();
        self.azimuth_deg.clear();
        self.intensity.clear();
    }
}
