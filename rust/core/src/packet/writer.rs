//! From shots to packets, for simulated sensors: what a family tells of the packets that it can write.
//!
//! Where the shots of a packet point and when they fire is not told here: a simulator learns it from
//! the family's own decoder, so that it stands once.

use std::fmt::Debug;

use super::unit::UnitFile;
use super::{ModelRef, hesai, ouster, robosense, velodyne};
use crate::error::InvalidValue;
use crate::packet::echoes::RawEcho;
use crate::time::Timestamp;

/// One echo; a range of 0 is none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Echo {
    /// Metres.
    pub range_m: f64,
    /// Brightness as the sensor tells it.
    pub intensity: u8,
}

impl Echo {
    /// As a sensor stores it whose ranges come in units of `unit_m`; what does not fit is no echo.
    pub fn raw(&self, unit_m: f64) -> RawEcho {
        let range = (self.range_m / unit_m).round();
        let fits = range >= 1.0 && range <= f64::from(u16::MAX);
        let echo = RawEcho {
            range: range as u16,
            intensity: self.intensity,
        };
        if fits { echo } else { RawEcho::default() }
    }
}

/// Shots of all channels that belong to one azimuth.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Device time after the packet's first row, ns.
    pub after_ns: i64,
    /// Encoder azimuth, [0, 2 pi).
    pub azimuth_rad: f64,
    /// Echoes by channel.
    pub echoes: Vec<Echo>,
}

/// What one packet holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Shots {
    /// Device time of the first row.
    pub time: Timestamp,
    /// Number of the packet since the rotor passed zero for the first time.
    pub sequence: u32,
    /// Rotation rate.
    pub rate_rad_per_ns: f64,
    /// The rows.
    pub rows: Vec<Row>,
}

/// What makes a sensor start the next row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// Its clock: so many nanoseconds after the row before.
    Clock(f64),
    /// Its encoder: so many rows make a turn.
    Encoder(u32),
}

/// Writes data packets with single returns.
pub trait Writer: Sync + Debug {
    /// The model that reads them.
    fn model(&self) -> ModelRef;

    /// Name of the sensor in scenes; a line of products has several.
    fn id(&self) -> &'static str {
        self.model().id()
    }

    /// Rows of a packet.
    fn rows(&self) -> usize;

    /// Channels of a row.
    fn channels(&self) -> usize;

    /// What makes it start the next row.
    fn pace(&self) -> Pace;

    /// When a row's azimuth holds, after the start of the row, ns.
    fn azimuth_ns(&self) -> i64 {
        0
    }

    /// Whether packets with the receiver's time come beside the data.
    fn has_position(&self) -> bool {
        false
    }

    /// What describes the unit, where its packets mean nothing without.
    fn files(&self) -> Vec<UnitFile> {
        Vec::new()
    }

    /// Writes a packet.
    fn write(&self, shots: &Shots) -> Vec<u8>;
}

/// A sensor that can be simulated.
pub type WriterRef = &'static dyn Writer;

/// All sensors that can be simulated.
pub static WRITERS: &[WriterRef] = &[
    &velodyne::writer::VLP16,
    &velodyne::writer::VLP16_HIRES,
    &velodyne::writer::HDL32E,
    &velodyne::writer::VLP32C,
    &velodyne::writer::VLS128,
    &hesai::xt::XT16,
    &hesai::xt::XT32,
    &hesai::xt::XT32M2X,
    &hesai::xt::QT64,
    &hesai::pandar::PANDAR40P,
    &hesai::pandar::PANDAR64,
    &robosense::rs::RS_16,
    &robosense::rs::RS_32,
    &robosense::helios::HELIOS_16P,
    &robosense::helios::HELIOS_32,
    &ouster::writer::OS0_32,
    &ouster::writer::OS0_64,
    &ouster::writer::OS0_128,
    &ouster::writer::OS1_32,
    &ouster::writer::OS1_64,
    &ouster::writer::OS1_128,
    &ouster::writer::OS2_32,
    &ouster::writer::OS2_64,
    &ouster::writer::OS2_128,
];

/// The writer of the sensor with this id.
///
/// # Errors
/// [`InvalidValue`] that lists the sensors that can be simulated.
pub fn writer(id: &str) -> Result<WriterRef, InvalidValue> {
    let known = WRITERS.iter().find(|writer| writer.id() == id);
    known.copied().ok_or_else(|| InvalidValue {
        name: "lidars.model",
        expected: WRITERS
            .iter()
            .map(|writer| writer.id())
            .collect::<Vec<_>>()
            .join(", "),
        found: id.into(),
    })
}

/// Hundredths of a degree, [0, 36000).
pub fn centideg(azimuth_rad: f64) -> u16 {
    (azimuth_rad.to_degrees() * 100.0)
        .round()
        .rem_euclid(36_000.0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_that_do_not_fit_are_none() {
        let echo = |range_m| Echo {
            range_m,
            intensity: 7,
        };
        assert_eq!(echo(10.0).raw(0.002).range, 5000);
        assert_eq!(echo(140.0).raw(0.002), RawEcho::default());
        assert_eq!(echo(0.0).raw(0.002), RawEcho::default());
    }

    #[test]
    fn names_are_found_and_listed() {
        assert_eq!(writer("os1-64").unwrap().id(), "os1-64");
        assert!(writer("vlp61").unwrap_err().expected.contains("xt32"));
        assert_eq!(centideg(-1e-9), 0);
    }
}
