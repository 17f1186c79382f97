//! Directions, offsets and timing of the beams of one unit.

use crate::error::InvalidValue;

/// What is known of each channel of one unit, in the order of the channels within a firing.
#[derive(Debug, Clone, PartialEq)]
pub struct Beams {
    channels: Vec<Beam>,
}

/// One channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Number of the beam in results.
    pub ring: u16,
    /// Angle above the plane of rotation.
    pub elevation_rad: f64,
    /// Added to the encoder azimuth.
    pub azimuth_offset_rad: f64,
    /// Where the beam starts along the spin axis, metres above the origin of the sensor frame.
    pub vertical_offset_m: f64,
    /// Added to the measured range.
    pub range_offset_m: f64,
    /// Delay of the shot after the first one of its firing.
    pub delay_ns: i64,
}

impl Beams {
    /// Checks the channels of one unit.
    ///
    /// # Errors
    /// [`InvalidValue`] where there is none or one has a number that is not finite.
    pub fn new(channels: Vec<Beam>) -> Result<Self, InvalidValue> {
        let refuse = |found: String| InvalidValue {
            name: "beams",
            expected: "at least one channel, all its numbers finite".into(),
            found,
        };
        if channels.is_empty() {
            return Err(refuse("no channel".into()));
        }
        match channels.iter().position(|beam| !beam.is_finite()) {
            Some(place) => Err(refuse(format!("channel {place}: {:?}", channels[place]))),
            None => Ok(Self { channels }),
        }
    }

    /// Checks the number of channels.
    ///
    /// # Errors
    /// [`InvalidValue`] for another number than `count`.
    pub fn expect(&self, count: usize) -> Result<(), InvalidValue> {
        if self.channels.len() == count {
            return Ok(());
        }
        Err(InvalidValue {
            name: "beams",
            expected: format!("{count} channels"),
            found: self.channels.len().to_string(),
        })
    }

    /// Channels in the order within a firing.
    pub fn channels(&self) -> &[Beam] {
        &self.channels
    }
}

impl Beam {
    fn is_finite(&self) -> bool {
        [
            self.elevation_rad,
            self.azimuth_offset_rad,
            self.vertical_offset_m,
            self.range_offset_m,
        ]
        .iter()
        .all(|value| value.is_finite())
    }
}

/// Whether elevations may be of a unit of a model with these: units differ from their model by tenths of a
/// degree, models of as many lasers by degrees.
pub fn is_near(told_rad: &[f64], model_rad: &[f64]) -> bool {
    const MOST_DEG: f64 = 1.0;
    let pairs = told_rad.iter().zip(model_rad);
    let mut apart_rad: Vec<f64> = pairs.map(|(one, other)| (one - other).abs()).collect();
    apart_rad.sort_by(f64::total_cmp);
    let middle_rad = apart_rad.get(apart_rad.len() / 2);
    middle_rad.is_none_or(|apart_rad| apart_rad.to_degrees() <= MOST_DEG)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_without_a_number_is_refused() {
        let mut beam = Beam {
            ring: 0,
            elevation_rad: 0.1,
            azimuth_offset_rad: 0.0,
            vertical_offset_m: 0.0,
            range_offset_m: 0.0,
            delay_ns: 0,
        };
        assert_eq!(Beams::new(vec![beam]).unwrap().channels(), [beam]);
        beam.elevation_rad = f64::NAN;
        assert!(Beams::new(vec![beam]).is_err());
        assert!(Beams::new(vec![]).is_err());
    }
}
