//! Where the echo of a pixel lies in the sensor frame.
//!
//! Source: the maker's sensor manual, "lidar range to XYZ".

use std::f64::consts::TAU;

use super::metadata::Metadata;
use crate::packet::fan::{Beam, Fan};

/// Axes of the sensor frame from those of the rotor, and where the rotor's origin lies, metres.
type Frame = ([[f64; 3]; 3], [f64; 3]);

/// All beams and columns of one sensor.
#[derive(Debug, Clone)]
pub struct Geometry {
    beams: Vec<Beam>,
    frames: Vec<Frame>,
}

impl Geometry {
    /// Works out the tables of a sensor.
    pub fn new(metadata: &Metadata) -> Self {
        let columns = metadata.columns_per_turn;
        let frame = |column: usize| {
            let angle_rad = TAU * (1.0 - column as f64 / columns as f64);
            turned(&metadata.lidar_to_sensor_mm, angle_rad.sin_cos())
        };
        Self {
            beams: beams(metadata).collect(),
            frames: (0..columns).map(frame).collect(),
        }
    }

    /// The beams, from the top one, in the frame that turns with the encoder.
    pub fn fan(&self) -> Fan {
        self.beams.iter().copied().collect()
    }

    /// How that frame stands in a column; `None` where the turn has no such column.
    pub fn frame(&self, column: usize) -> Option<Frame> {
        self.frames.get(column).copied()
    }
}

/// Ranges count from the lidar's origin, along the beam from where it leaves.
fn beams(metadata: &Metadata) -> impl Iterator<Item = Beam> {
    let (out_mm, up_mm) = metadata.beam_origin_mm;
    let reach_mm = if up_mm == 0.0 {
        out_mm
    } else {
        out_mm.hypot(up_mm)
    };
    let angles = metadata.elevation_rad.iter().zip(&metadata.azimuth_rad);
    let angles = (0_u16..).zip(angles);
    angles.map(move |(ring, (elevation_rad, azimuth_rad))| {
        let ((up, level), (sin, cos)) = (elevation_rad.sin_cos(), azimuth_rad.sin_cos());
        let direction = [level * cos, -level * sin, up];
        let origin_mm = [out_mm, 0.0, up_mm];
        let origin_m = |axis: usize| (origin_mm[axis] - reach_mm * direction[axis]) * 0.001;
        Beam {
            ring,
            azimuth_rad: *azimuth_rad,
            direction,
            origin_m: [0, 1, 2].map(origin_m),
            ..Beam::default()
        }
    })
}

/// The sensor frame from one that is turned in the lidar frame.
fn turned(to_sensor_mm: &[f64; 16], (sin, cos): (f64, f64)) -> Frame {
    let row = |axis: usize| {
        let [x, y, z, _] = [0, 1, 2, 3].map(|column| to_sensor_mm[4 * axis + column]);
        [x * cos + y * sin, y * cos - x * sin, z]
    };
    let origin_m = |axis: usize| to_sensor_mm[4 * axis + 3] * 0.001;
    ([0, 1, 2].map(row), [0, 1, 2].map(origin_m))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::cloud::ReturnKind;
    use crate::packet::Decoded;
    use crate::packet::fan::{Desk, Row};
    use crate::packet::unit::UnitFile;

    #[test]
    fn an_echo_lies_where_the_manual_puts_it() {
        let text = r#"{"beam_altitude_angles": [30], "beam_azimuth_angles": [3], "lidar_origin_to_beam_origin_mm": 15,
            "data_format": {"pixels_per_column": 1, "columns_per_frame": 1024}}"#;
        let metadata = super::super::metadata::read(&UnitFile::new("m", text))
            .unwrap()
            .unwrap();
        let geometry = Geometry::new(&metadata);
        let (axes, origin_m) = geometry.frame(256).unwrap();
        let row = Row {
            encoder_rad: FRAC_PI_2,
            azimuth_rad: FRAC_PI_2,
            axes,
            origin_m,
            unit_m: 0.001,
            time_ns: 0,
            packets: [0; 3],
        };
        let (mut desk, mut out) = (Desk::default(), Decoded::default());
        desk.open(1, 1);
        desk.echoes(0).range[0] = 10_000;
        let kind = ReturnKind::Strongest;
        desk.push_single(&geometry.fan(), None, &row, kind, &mut out);
        desk.flush(&mut out);
        let [x, y, z] = out.cloud.xyz_m[0];
        let azimuth_rad = f64::from(out.cloud.azimuth_rad[0]);
        // A quarter turn clockwise: the encoder looks along -y of the lidar, which is +y of the sensor.
        let (level, own) = (9.985 * 30_f64.to_radians().cos(), 3_f64.to_radians());
        assert!((f64::from(x) - level * own.sin()).abs() < 1e-6, "{x}");
        assert!(
            (f64::from(y) - (level * own.cos() + 0.015)).abs() < 1e-6,
            "{y}"
        );
        assert!(
            (f64::from(z) - (9.985 * 0.5 + 0.036_18)).abs() < 1e-6,
            "{z}"
        );
        assert!((azimuth_rad.to_degrees() - 93.0).abs() < 1e-4);
        assert!(geometry.frame(1024).is_none());
    }
}
