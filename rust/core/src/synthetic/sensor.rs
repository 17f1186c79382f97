//! What a simulated sensor shoots, learnt from the decoder of its family: a packet is written whose echoes
//! are known, and the points that the decoder makes of them tell direction, origin and time of every shot.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3};

use crate::error::InvalidValue;
use crate::packet::writer::{Echo, Pace, Row, Shots, WriterRef, writer};
use crate::packet::{Decoded, Place};
use crate::time::Timestamp;

/// One shot of a row.
#[derive(Debug, Clone, Copy)]
pub struct Shot {
    /// Device time after the start of the row, ns.
    pub after_ns: i64,
    /// Where ranges count from, while the rotor stands at zero, sensor frame, metres.
    pub origin_m: Vector3<f64>,
    /// Direction of unit length, while the rotor stands at zero, sensor frame.
    pub direction: Vector3<f64>,
    /// The beam's number as the decoder tells it.
    pub ring: u16,
    /// Azimuth of the direction, in the sense of the rotor.
    pub azimuth_rad: f64,
}

/// A sensor that can be simulated.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// Writes its packets.
    pub writer: WriterRef,
    /// Shots by row and channel; `None` where a channel is not used.
    pub shots: Vec<Vec<Option<Shot>>>,
    /// Largest elevation, rad.
    pub reach_rad: f64,
    /// Beams.
    pub rings: usize,
}

/// Ranges of the packets that are decoded to learn from, metres; in whole units of every model.
const PROBE_M: [f64; 2] = [20.0, 100.0];
/// The rotor turns by a hundredth of a degree in a row: what decoders work out from their azimuths is
/// small, and equal azimuths would mean two returns to some of them.
const PROBE_STEP_RAD: f64 = TAU / 36_000.0;
const EPOCH: Timestamp = Timestamp(1_718_000_000_000_000_000);

impl Sensor {
    /// The sensor with this id.
    ///
    /// # Errors
    /// [`InvalidValue`] for one that cannot be simulated.
    pub fn new(id: &str) -> Result<Self, InvalidValue> {
        let writer = writer(id)?;
        let shots: Vec<_> = (0..writer.rows()).map(|row| learn(writer, row)).collect();
        let each = || shots.iter().flatten().flatten();
        if each().next().is_none() {
            return Err(InvalidValue {
                name: "lidars.model",
                expected: "a sensor whose packets are read back".into(),
                found: id.into(),
            });
        }
        let reach = |shot: &Shot| shot.direction.z.abs().min(1.0).asin();
        Ok(Self {
            writer,
            reach_rad: each().map(reach).fold(0.0, f64::max),
            rings: each()
                .map(|shot| usize::from(shot.ring) + 1)
                .max()
                .unwrap_or(0),
            shots,
        })
    }

    /// Rings in the order in which they first fire.
    pub fn firing_order(&self) -> Vec<u16> {
        let mut order = Vec::new();
        for shot in self.shots.iter().flatten().flatten() {
            if !order.contains(&shot.ring) {
                order.push(shot.ring);
            }
        }
        order
    }
}

/// Device time and azimuth of the rows of a packet that is learnt from, and the rate.
fn probe(pace: Pace, rows: usize) -> (Vec<Row>, f64) {
    let (row_ns, step_rad) = match pace {
        Pace::Clock(row_ns) => (row_ns, PROBE_STEP_RAD),
        Pace::Encoder(rows_per_turn) => {
            let rows_per_turn = f64::from(rows_per_turn);
            (1e8 / rows_per_turn, TAU / rows_per_turn)
        }
    };
    let row = |row: usize| Row {
        after_ns: (row as f64 * row_ns).round() as i64,
        azimuth_rad: row as f64 * step_rad,
        echoes: Vec::new(),
    };
    ((0..rows).map(row).collect(), step_rad / row_ns)
}

/// Shots of one row: of each channel the point that its echo becomes at two ranges.
fn learn(writer: WriterRef, row: usize) -> Vec<Option<Shot>> {
    let (rows, rate_rad_per_ns) = probe(writer.pace(), writer.rows());
    let mut shots = Shots {
        time: EPOCH,
        sequence: 1,
        rate_rad_per_ns,
        rows,
    };
    let points = PROBE_M.map(|range_m| {
        // The brightness tells the channel.
        let echo = |channel: usize| Echo {
            range_m,
            intensity: (channel + 1) as u8,
        };
        shots.rows[row].echoes = (0..writer.channels()).map(echo).collect();
        decode(writer, &shots)
    });
    let start = &shots.rows[row];
    (1..=writer.channels())
        .map(|number| {
            let [near, far] = [0, 1].map(|i| {
                points[i]
                    .iter()
                    .find(|point| usize::from(point.intensity) == number)
            });
            let (near, far) = (near?, far?);
            let after_ns = near.time - EPOCH - start.after_ns;
            let turned =
                start.azimuth_rad + rate_rad_per_ns * (after_ns - writer.azimuth_ns()) as f64;
            let back = Rotation3::from_axis_angle(&Vector3::z_axis(), turned);
            let [a, b] = [near, far].map(|p| back * Vector3::from(p.xyz_m.map(f64::from)));
            let direction = (b - a).normalize();
            Some(Shot {
                after_ns,
                origin_m: a - direction * PROBE_M[0],
                direction,
                ring: near.ring,
                azimuth_rad: (-direction.y).atan2(direction.x),
            })
        })
        .collect()
}

fn decode(writer: WriterRef, shots: &Shots) -> Vec<crate::cloud::Return> {
    let mut out = Decoded::default();
    let place = Place {
        time: EPOCH,
        packet: 0,
        mean_rate_rad_per_ns: 0.0,
    };
    if let Ok(mut fitted) = writer.model().fit(&writer.files()) {
        fitted.decoder.decode(&writer.write(shots), place, &mut out);
    }
    out.cloud.iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::writer::WRITERS;

    #[test]
    fn all_channels_of_every_sensor_are_learnt() {
        for writer in WRITERS {
            let sensor = Sensor::new(writer.id()).unwrap();
            for (row, shots) in sensor.shots.iter().enumerate() {
                let missing = shots.iter().filter(|shot| shot.is_none()).count();
                assert_eq!(missing, 0, "{} row {row}", writer.id());
                let first = sensor.shots[0][0].unwrap();
                let same = shots[0].unwrap();
                // All rows shoot alike; f32 points 100 m off are good to 4e-6 m.
                assert!(
                    (same.direction - first.direction).norm() < 2e-6,
                    "{}",
                    writer.id()
                );
                assert!(
                    (same.origin_m - first.origin_m).norm() < 1e-4,
                    "{}",
                    writer.id()
                );
                assert!(shots.iter().flatten().all(|s| s.after_ns.abs() < 200_000));
            }
        }
    }

    #[test]
    fn a_vlp16_shoots_as_its_drawing_says() {
        let sensor = Sensor::new("vlp16").unwrap();
        assert_eq!(
            (sensor.rings, sensor.shots.len(), sensor.shots[0].len()),
            (16, 12, 32)
        );
        let shot = sensor.shots[3][16 + 5].unwrap();
        assert_eq!((shot.after_ns, shot.ring), (55_296 + 5 * 2_304, 10));
        let expected_rad = 5f64.to_radians();
        assert!((shot.direction.z.asin() - expected_rad).abs() < 1e-6);
        assert!((shot.origin_m.z + 0.041_91 * expected_rad.tan()).abs() < 1e-5);
        assert_eq!(sensor.firing_order()[..3], [0, 8, 1]);
    }

    #[test]
    fn an_xt32_looks_along_y_at_zero() {
        let sensor = Sensor::new("xt32").unwrap();
        let level = sensor.shots[0]
            .iter()
            .flatten()
            .min_by(|a, b| a.direction.z.abs().total_cmp(&b.direction.z.abs()));
        assert!(level.unwrap().direction.y > 0.999 && sensor.rings == 32);
    }
}
