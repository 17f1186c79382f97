//! All echoes of a stretch of time, in the columns that a hold needs.

use super::StreamInfo;
use super::beside::Taker;
use crate::sweep::Sweep;
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
    /// Brightness as the sensor reports it.
    pub intensity: Vec<f32>,
}

impl HoldEchoes {
    /// None yet, with room for those of a stretch of time: growing on the way would take twice the memory.
    pub fn of(info: &StreamInfo, start: Timestamp, stop: Timestamp) -> Self {
        let whole_ns = (info.last - info.first).max(1) as f64;
        let share = ((stop - start) as f64 / whole_ns).clamp(0.0, 1.0);
        let room = (info.points as f64 * share * 1.02) as usize;
        Self {
            xyz_m: Vec::with_capacity(room),
            ring: Vec::with_capacity(room),
            azimuth_deg: Vec::with_capacity(room),
            intensity: Vec::with_capacity(room),
        }
    }
}

impl Taker for HoldEchoes {
    fn take(&mut self, sweep: &Sweep) {
        let cloud = &sweep.cloud;
        self.xyz_m.extend_from_slice(&cloud.xyz_m);
        self.ring.extend_from_slice(&cloud.ring);
        self.azimuth_deg.extend(cloud.azimuths_deg());
        let intensity = cloud.intensity.iter();
        self.intensity
            .extend(intensity.map(|seen| f32::from(*seen)));
    }
}
