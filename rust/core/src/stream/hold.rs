//! All echoes of a stretch of time, in the columns that a hold needs.

use super::beside::Taker;
use crate::sweep::Sweep;

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
