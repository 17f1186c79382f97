//! Where the echo of a pixel lies in the sensor frame.
//!
//! Source: the maker's sensor manual, "lidar range to XYZ".

use std::f64::consts::TAU;

use super::metadata::Metadata;

/// One beam: the factors of its direction, worked out once.
#[derive(Debug, Clone, Copy)]
struct Beam {
    /// Cosine of the elevation times cosine and sine of the beam's own azimuth.
    level: (f64, f64),
    /// Sine of the elevation.
    up: f64,
    azimuth_rad: f64,
}

/// All beams of one sensor.
#[derive(Debug, Clone)]
pub struct Geometry {
    beams: Vec<Beam>,
    /// Cosine and sine of the encoder's angle, by column.
    columns: Vec<(f64, f64)>,
    origin_mm: (f64, f64),
    /// Way from the lidar's origin to where ranges count from, mm.
    reach_mm: f64,
    to_sensor_mm: [f64; 16],
}

impl Geometry {
    /// Works out the tables of a sensor.
    pub fn new(metadata: &Metadata) -> Self {
        let angles = metadata.elevation_rad.iter().zip(&metadata.azimuth_rad);
        let beams = angles.map(|(elevation_rad, azimuth_rad)| Beam {
            level: (
                elevation_rad.cos() * azimuth_rad.cos(),
                -elevation_rad.cos() * azimuth_rad.sin(),
            ),
            up: elevation_rad.sin(),
            azimuth_rad: *azimuth_rad,
        });
        let columns = metadata.columns_per_turn;
        let angle_rad = |column: usize| TAU * (1.0 - column as f64 / columns as f64);
        let (out_mm, up_mm) = metadata.beam_origin_mm;
        Self {
            beams: beams.collect(),
            columns: (0..columns)
                .map(|column| (angle_rad(column).cos(), angle_rad(column).sin()))
                .collect(),
            origin_mm: (out_mm, up_mm),
            reach_mm: if up_mm == 0.0 {
                out_mm
            } else {
                out_mm.hypot(up_mm)
            },
            to_sensor_mm: metadata.lidar_to_sensor_mm,
        }
    }

    /// Position in metres and azimuth, clockwise from the encoder's zero; `None` outside of the tables.
    #[inline]
    pub fn place(&self, column: usize, ring: usize, range_mm: u32) -> Option<([f32; 3], f64)> {
        let (beam, (cos, sin)) = (self.beams.get(ring)?, *self.columns.get(column)?);
        let reach_mm = f64::from(range_mm) - self.reach_mm;
        let (ahead, aside) = beam.level;
        let x = reach_mm * (cos * ahead - sin * aside) + self.origin_mm.0 * cos;
        let y = reach_mm * (sin * ahead + cos * aside) + self.origin_mm.0 * sin;
        let z = reach_mm * beam.up + self.origin_mm.1;
        let m = &self.to_sensor_mm;
        let row = |at: usize| (m[at] * x + m[at + 1] * y + m[at + 2] * z + m[at + 3]) * 0.001;
        let turned_rad = TAU * column as f64 / self.columns.len() as f64;
        let xyz_m = [row(0) as f32, row(4) as f32, row(8) as f32];
        Some((xyz_m, turned_rad + beam.azimuth_rad))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::unit::UnitFile;

    #[test]
    fn an_echo_lies_where_the_manual_puts_it() {
        let text = r#"{"beam_altitude_angles": [30], "beam_azimuth_angles": [3], "lidar_origin_to_beam_origin_mm": 15,
            "data_format": {"pixels_per_column": 1, "columns_per_frame": 1024}}"#;
        let metadata = super::super::metadata::read(&UnitFile::new("m", text))
            .unwrap()
            .unwrap();
        let geometry = Geometry::new(&metadata);
        let ([x, y, z], azimuth_rad) = geometry.place(256, 0, 10_000).unwrap();
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
        assert!((azimuth_rad.to_degrees() - 93.0).abs() < 1e-9);
        assert!(geometry.place(1024, 0, 1).is_none() && geometry.place(0, 1, 1).is_none());
    }
}
