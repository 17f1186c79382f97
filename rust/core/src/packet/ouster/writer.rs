//! Data packets of simulated sensors with single returns, and the metadata that they need.
//!
//! The units are made up: evenly spread beams over the line's field of view, staggered in azimuth as
//! real ones are.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use super::layout::{RawColumn, RawPacket, encode};
use super::metadata::{self, Metadata};
use super::unit;
use crate::packet::ModelRef;
use crate::packet::unit::UnitFile;
use crate::packet::writer::{Echo, Pace, Row, Shots, Writer};

/// Columns of a turn.
const TURN: u32 = 1024;
/// Columns of a packet.
const COLUMNS: usize = 16;
/// Azimuths of neighbouring beams.
const STAGGER_DEG: [f64; 4] = [4.23, 1.41, -1.41, -4.23];
const SERIAL: u64 = 122_300_000_000;
const INIT_ID: u32 = 5_431_000;

/// A unit of 32 beams over 45 degrees.
pub static OS1_32: Made = Made {
    id: "os1-32",
    line: 1,
    beams: 32,
};
/// A unit of 64 beams over 45 degrees.
pub static OS1_64: Made = Made {
    id: "os1-64",
    line: 1,
    beams: 64,
};
/// A unit of 128 beams over 45 degrees.
pub static OS1_128: Made = Made {
    id: "os1-128",
    line: 1,
    beams: 128,
};
/// A unit of 32 beams over 90 degrees.
pub static OS0_32: Made = Made {
    id: "os0-32",
    line: 0,
    beams: 32,
};
/// A unit of 64 beams over 90 degrees.
pub static OS0_64: Made = Made {
    id: "os0-64",
    line: 0,
    beams: 64,
};
/// A unit of 128 beams over 90 degrees.
pub static OS0_128: Made = Made {
    id: "os0-128",
    line: 0,
    beams: 128,
};
/// A unit of 32 beams over 22.5 degrees.
pub static OS2_32: Made = Made {
    id: "os2-32",
    line: 2,
    beams: 32,
};
/// A unit of 64 beams over 22.5 degrees.
pub static OS2_64: Made = Made {
    id: "os2-64",
    line: 2,
    beams: 64,
};
/// A unit of 128 beams over 22.5 degrees.
pub static OS2_128: Made = Made {
    id: "os2-128",
    line: 2,
    beams: 128,
};

/// A made-up unit.
#[derive(Debug, Clone, Copy)]
pub struct Made {
    id: &'static str,
    line: usize,
    beams: usize,
}

impl Made {
    /// Field of view and distance of the beams' origins from the axis, by line.
    fn view(&self) -> (f64, f64) {
        [(90.0, 27.67), (45.0, 15.806), (22.5, 13.762)][self.line]
    }

    fn file(&self) -> UnitFile {
        let (view_deg, out_mm) = self.view();
        let step_deg = view_deg / self.beams as f64;
        let (mut up, mut aside) = (String::new(), String::new());
        for beam in 0..self.beams {
            let comma = if beam == 0 { "" } else { ", " };
            let elevation_deg = 0.5 * view_deg - (beam as f64 + 0.5) * step_deg;
            let _ = write!(up, "{comma}{elevation_deg:.3}");
            let _ = write!(aside, "{comma}{:.2}", STAGGER_DEG[beam % STAGGER_DEG.len()]);
        }
        let text = format!(
            r#"{{
  "sensor_info": {{"prod_line": "OS-{line}-{beams}", "prod_sn": "{serial}", "initialization_id": {INIT_ID}}},
  "config_params": {{"lidar_mode": "{TURN}x10", "timestamp_mode": "TIME_FROM_PTP_1588"}},
  "beam_intrinsics": {{
    "lidar_origin_to_beam_origin_mm": {out_mm},
    "beam_altitude_angles": [{up}],
    "beam_azimuth_angles": [{aside}]
  }},
  "lidar_data_format": {{
    "udp_profile_lidar": "RNG19_RFL8_SIG16_NIR16", "pixels_per_column": {beams}, "columns_per_frame": {TURN},
    "columns_per_packet": {COLUMNS}, "column_window": [0, {last}], "fps": 10
  }}
}}
"#,
            line = self.line,
            beams = self.beams,
            serial = self.serial(),
            last = TURN - 1,
        );
        UnitFile::new(format!("{}.json", self.id), text)
    }

    fn serial(&self) -> u64 {
        SERIAL + 1000 * self.line as u64 + self.beams as u64
    }

    fn metadata(&self) -> Metadata {
        let read = metadata::read(&self.file()).and_then(Result::ok);
        read.expect("the text is written to be read")
    }
}

impl Writer for Made {
    fn model(&self) -> ModelRef {
        unit::models(&[self.file()])[0]
    }

    fn id(&self) -> &'static str {
        self.id
    }

    fn rows(&self) -> usize {
        COLUMNS
    }

    fn channels(&self) -> usize {
        self.beams
    }

    fn pace(&self) -> Pace {
        Pace::Encoder(TURN)
    }

    fn files(&self) -> Vec<UnitFile> {
        vec![self.file()]
    }

    fn write(&self, shots: &Shots) -> Vec<u8> {
        let metadata = self.metadata();
        let fields = metadata.profile.echoes[0];
        let pixel = |echo: &Echo| {
            let mut bytes = vec![0; metadata.profile.pixel_len];
            fields
                .range
                .write(&mut bytes, (echo.range_m * 1e3).round() as u32);
            fields.reflectivity.write(&mut bytes, echo.intensity.into());
            bytes
        };
        let column = |row: &Row| RawColumn {
            time_ns: (shots.time.0 + row.after_ns).max(0) as u64,
            number: ((row.azimuth_rad / TAU * f64::from(TURN)).round() as u32 % TURN) as u16,
            is_valid: true,
            pixels: row.echoes.iter().map(pixel).collect(),
        };
        let packets_per_turn = TURN / COLUMNS as u32;
        encode(
            metadata.layout,
            &RawPacket {
                frame: shots.sequence / packets_per_turn,
                init_id: INIT_ID,
                serial: self.serial(),
                columns_per_turn: TURN,
                columns: shots.rows.iter().map(column).collect(),
            },
        )
    }
}
