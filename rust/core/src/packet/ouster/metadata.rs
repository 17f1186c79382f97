//! The metadata of one sensor: a JSON file, in the older flat layout or the newer nested one.
//!
//! Source: the maker's development kit, sensor metadata.

use super::json::Json;
use super::layout::{Header, Layout};
use super::profile::{PROFILES, Profile};
use crate::error::UnitError;
use crate::packet::Model;
use crate::packet::ReturnMode;
use crate::packet::unit::UnitFile;

/// Beams of the first generation, for files that have none.
const GENERATION_1: &str = include_str!("gen1.csv");
/// Turned by half a turn about z, 36.18 mm above the base.
const LIDAR_TO_SENSOR_MM: [f64; 16] = [
    -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 36.18, 0.0, 0.0, 0.0, 1.0,
];
/// No sensor has more.
const MAX_BEAMS: usize = 1024;
const MAX_COLUMNS: usize = 8192;

/// What the metadata say of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Metadata {
    /// Product line, such as `OS-1-64`.
    pub product: String,
    /// Serial number; 0 where it is not known.
    pub serial: u64,
    /// Number drawn at the start; 0 where it is not known.
    pub init_id: u64,
    /// Sizes of data packets.
    pub layout: Layout,
    /// What stands in a pixel.
    pub profile: &'static Profile,
    /// Columns of a turn.
    pub columns_per_turn: usize,
    /// First and last column that is sent; the window may run over the seam.
    pub window: (usize, usize),
    /// Turns a second.
    pub rate_hz: f64,
    /// Elevations of the beams, from the top.
    pub elevation_rad: Vec<f64>,
    /// Azimuths of the beams after the encoder's, in its own sense (clockwise from above).
    pub azimuth_rad: Vec<f64>,
    /// Where the beams leave: distance from the axis and height, mm.
    pub beam_origin_mm: (f64, f64),
    /// From the lidar frame to the sensor frame, row by row, mm.
    pub lidar_to_sensor_mm: [f64; 16],
    /// Which returns are sent.
    pub return_mode: ReturnMode,
    /// What the device clock follows, as the file says it.
    pub clock: String,
}

/// Reads a file if it is metadata of an Ouster sensor at all.
pub fn read(file: &UnitFile) -> Option<Result<Metadata, UnitError>> {
    if file.content.iter().find(|byte| !byte.is_ascii_whitespace()) != Some(&b'{')
        && !file.content.starts_with(&[0xEF, 0xBB, 0xBF])
    {
        return None;
    }
    let json = Json::parse(&file.text()?).ok()?;
    let names = [
        "beam_intrinsics",
        "beam_altitude_angles",
        "lidar_data_format",
        "data_format",
    ];
    let is_own = names.iter().any(|name| json.get(name).is_some());
    is_own.then(|| Source { file, json: &json }.metadata())
}

struct Source<'a> {
    file: &'a UnitFile,
    json: &'a Json,
}

impl Source<'_> {
    /// A value of a section of the nested layout, or of the flat one.
    fn value(&self, section: &str, name: &str) -> Option<&Json> {
        let nested = self.json.get(section).and_then(|inner| inner.get(name));
        let value = nested.or_else(|| self.json.get(name));
        value.filter(|value| **value != Json::Word("null"))
    }

    /// A value of the data format; old firmware writes an error message instead of the section.
    fn format(&self, name: &str) -> Option<&Json> {
        let section = self.json.get("lidar_data_format");
        let section = section.or_else(|| self.json.get("data_format"))?;
        section
            .get(name)
            .filter(|value| **value != Json::Word("null"))
    }

    fn text(&self, section: &str, name: &str) -> String {
        let text = self.value(section, name).and_then(Json::text);
        text.unwrap_or_default().to_owned()
    }

    fn refuse(
        &self,
        name: &str,
        expected: impl std::fmt::Display,
        found: impl Into<String>,
    ) -> UnitError {
        self.file.refuse(None, format!("{name}: {expected}"), found)
    }

    fn metadata(&self) -> Result<Metadata, UnitError> {
        let (elevation_rad, azimuth_rad) = self.beams()?;
        let mode = self.mode();
        let columns_per_turn = self.count("columns_per_frame", mode.0, MAX_COLUMNS)?;
        let profile = self.profile()?;
        let serial = self.text("sensor_info", "prod_sn");
        let init_id = self.value("sensor_info", "initialization_id");
        Ok(Metadata {
            product: self.text("sensor_info", "prod_line"),
            serial: serial.parse().unwrap_or(0),
            init_id: init_id.and_then(Json::count).unwrap_or(0) as u64,
            layout: self.layout(profile, elevation_rad.len())?,
            profile,
            columns_per_turn,
            window: self.window(columns_per_turn)?,
            rate_hz: self
                .format("fps")
                .and_then(Json::number)
                .filter(|fps| *fps > 0.0)
                .unwrap_or(mode.1),
            elevation_rad,
            azimuth_rad,
            beam_origin_mm: self.beam_origin()?,
            lidar_to_sensor_mm: self
                .matrix("lidar_intrinsics", "lidar_to_sensor_transform")?
                .unwrap_or(LIDAR_TO_SENSOR_MM),
            return_mode: self.return_mode(profile),
            clock: self.text("config_params", "timestamp_mode"),
        })
    }

    /// Elevations and azimuths, radians.
    fn beams(&self) -> Result<(Vec<f64>, Vec<f64>), UnitError> {
        let list = |name: &str| {
            self.value("beam_intrinsics", name).map(|value| {
                let numbers = value
                    .numbers()
                    .filter(|list| !list.is_empty() && list.len() <= MAX_BEAMS);
                numbers.ok_or_else(|| {
                    self.refuse(name, format!("1 to {MAX_BEAMS} angles"), "something else")
                })
            })
        };
        let angles = match (list("beam_altitude_angles"), list("beam_azimuth_angles")) {
            (Some(elevations), Some(azimuths)) => (elevations?, azimuths?),
            (None, None) => generation_1(),
            _ => return Err(self.refuse("beam angles", "altitudes and azimuths", "one of them")),
        };
        let pixels = self.count("pixels_per_column", angles.0.len(), MAX_BEAMS)?;
        if angles.0.len() != pixels || angles.1.len() != pixels {
            let found = format!(
                "{} altitudes and {} azimuths",
                angles.0.len(),
                angles.1.len()
            );
            return Err(self.refuse("beam angles", format!("{pixels} of each"), found));
        }
        let radians = |degrees: Vec<f64>| degrees.into_iter().map(f64::to_radians).collect();
        Ok((radians(angles.0), radians(angles.1)))
    }

    /// A number of the data format from 1 to `most`.
    fn count(&self, name: &str, otherwise: usize, most: usize) -> Result<usize, UnitError> {
        let Some(value) = self.format(name) else {
            return Ok(otherwise);
        };
        let count = value.count().filter(|count| (1..=most).contains(count));
        count.ok_or_else(|| self.refuse(name, format!("1 to {most}"), format!("{value:?}")))
    }

    /// Columns of a turn and turns a second, as `1024x10` says.
    fn mode(&self) -> (usize, f64) {
        let text = self.text("config_params", "lidar_mode");
        let parts = text.split_once('x');
        let numbers =
            parts.and_then(|(columns, rate)| Some((columns.parse().ok()?, rate.parse().ok()?)));
        let sound = numbers.filter(|(columns, rate)| {
            (1..=MAX_COLUMNS).contains(columns) && (1.0..=100.0).contains(rate)
        });
        sound.unwrap_or((1024, 10.0))
    }

    fn profile(&self) -> Result<&'static Profile, UnitError> {
        let name = self.format("udp_profile_lidar").and_then(Json::text);
        let name = name.unwrap_or(PROFILES[0].name);
        Profile::named(name).ok_or_else(|| {
            let known: Vec<&str> = PROFILES.iter().map(|profile| profile.name).collect();
            self.refuse("udp_profile_lidar", known.join(", "), name)
        })
    }

    fn layout(&self, profile: &Profile, pixels: usize) -> Result<Layout, UnitError> {
        let is_safety = profile.name.starts_with("FUSA_")
            || self.format("header_type").and_then(Json::text) == Some("FUSA");
        Ok(Layout {
            header: if profile.is_legacy() {
                Header::Legacy
            } else if is_safety {
                Header::Safety
            } else {
                Header::Standard
            },
            columns: self.count("columns_per_packet", 16, 128)?,
            pixels,
            pixel_len: profile.pixel_len,
        })
    }

    fn window(&self, columns: usize) -> Result<(usize, usize), UnitError> {
        let Some(value) = self.format("column_window") else {
            return Ok((0, columns - 1));
        };
        match value.numbers().as_deref() {
            Some([first, last])
                if [first, last]
                    .iter()
                    .all(|edge| (0.0..columns as f64).contains(*edge)) =>
            {
                Ok((*first as usize, *last as usize))
            }
            _ => Err(self.refuse(
                "column_window",
                format!("two columns below {columns}"),
                format!("{value:?}"),
            )),
        }
    }

    /// Distance from the axis and height, mm.
    fn beam_origin(&self) -> Result<(f64, f64), UnitError> {
        if let Some(matrix) = self.matrix("beam_intrinsics", "beam_to_lidar_transform")? {
            return Ok((matrix[3], matrix[11]));
        }
        let name = "lidar_origin_to_beam_origin_mm";
        let known = self.value("beam_intrinsics", name).and_then(Json::number);
        let product = self.text("sensor_info", "prod_line");
        // As the maker's kit has it, which takes no account of the first OS-1-64 (12.163).
        let by_product = || match product.get(..5) {
            Some("OS-0-") => 27.67,
            Some("OS-1-") => 15.806,
            Some("OS-2-") => 13.762,
            _ => 12.163,
        };
        Ok((known.unwrap_or_else(by_product), 0.0))
    }

    fn matrix(&self, section: &str, name: &str) -> Result<Option<[f64; 16]>, UnitError> {
        let Some(value) = self.value(section, name) else {
            return Ok(None);
        };
        let numbers: Option<[f64; 16]> = value.numbers().and_then(|list| list.try_into().ok());
        let matrix = numbers.ok_or_else(|| self.refuse(name, "16 numbers", "something else"))?;
        Ok(Some(matrix))
    }

    fn return_mode(&self, profile: &Profile) -> ReturnMode {
        let order = self.text("config_params", "return_order");
        match (profile.echoes.len(), order.as_str()) {
            (1, "FARTHEST_TO_NEAREST") => ReturnMode::Last,
            (1, "NEAREST_TO_FARTHEST") => ReturnMode::First,
            (1, _) => ReturnMode::Strongest,
            (_, "FARTHEST_TO_NEAREST" | "NEAREST_TO_FARTHEST") => ReturnMode::FirstLast,
            _ => ReturnMode::StrongestSecond,
        }
    }
}

/// Elevations and azimuths of the first generation, degrees.
fn generation_1() -> (Vec<f64>, Vec<f64>) {
    let row = |line: &'static str| {
        let (elevation, azimuth) = line.split_once(',')?;
        Some((elevation.parse::<f64>().ok()?, azimuth.parse::<f64>().ok()?))
    };
    GENERATION_1.lines().filter_map(row).unzip()
}

impl Metadata {
    /// Id of the product: line and number of beams, or the line alone for a number that is not sold.
    pub fn id(&self) -> &'static str {
        let product = format!("{}-{}", self.line(), self.layout.pixels);
        let known = super::bare::PRODUCTS.iter().map(Model::id);
        let mut same = known.filter(|id| **id == *product);
        same.next().unwrap_or(self.line())
    }

    /// Id of the product line.
    fn line(&self) -> &'static str {
        let product = self.product.to_ascii_lowercase();
        match product.split('-').nth(1) {
            Some("0") => "os0",
            Some("1") => "os1",
            Some("2") => "os2",
            Some("dome") => "osdome",
            _ => "ouster",
        }
    }

    /// Packets of a turn that lie in the window.
    pub fn packets_per_turn(&self) -> usize {
        let columns = self.layout.columns;
        let all = self.columns_per_turn.div_ceil(columns);
        let (first, last) = (self.window.0 / columns, self.window.1 / columns);
        if self.window.0 <= self.window.1 {
            last - first + 1
        } else if first == last {
            all // the window closes in the packet in which it opens
        } else {
            all - first + last + 1
        }
    }

    /// Number of a packet within the turn, by its first column. The frame counts from column 0 on, also
    /// where the window runs over the seam.
    pub fn packet_of(&self, column: usize) -> usize {
        let packet = column / self.layout.columns;
        let (first, last) = (
            self.window.0 / self.layout.columns,
            self.window.1 / self.layout.columns,
        );
        if self.window.0 <= self.window.1 {
            packet
                .saturating_sub(first)
                .min(self.packets_per_turn() - 1)
        } else if packet <= last {
            packet
        } else {
            (packet + last + 1)
                .saturating_sub(first)
                .min(self.packets_per_turn() - 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<Metadata, UnitError> {
        read(&UnitFile::new("sensor.json", text)).unwrap()
    }

    #[test]
    fn nested_and_flat_files_say_the_same() {
        let nested = of(r#"{"sensor_info": {"prod_line": "OS-1-2", "prod_sn": "122239000672", "initialization_id": 7},
            "beam_intrinsics": {"beam_altitude_angles": [1, -1], "beam_azimuth_angles": [2, -2], "lidar_origin_to_beam_origin_mm": 15.8},
            "lidar_data_format": {"columns_per_frame": 512, "pixels_per_column": 2, "column_window": [0, 511],
              "udp_profile_lidar": "RNG15_RFL8_NIR8"}, "config_params": {"lidar_mode": "512x20"}}"#).unwrap();
        let flat = of(r#"{"prod_line": "OS-1-2", "prod_sn": "122239000672", "initialization_id": 7,
            "beam_altitude_angles": [1, -1], "beam_azimuth_angles": [2, -2], "lidar_origin_to_beam_origin_mm": 15.8,
            "data_format": {"columns_per_frame": 512, "pixels_per_column": 2, "udp_profile_lidar": "RNG15_RFL8_NIR8"},
            "lidar_mode": "512x20"}"#).unwrap();
        assert_eq!(nested, flat);
        assert_eq!(
            (flat.id(), flat.packets_per_turn(), flat.rate_hz),
            ("os1", 32, 20.0)
        );
        assert_eq!(flat.serial, 122_239_000_672);
    }

    #[test]
    fn old_files_with_an_error_instead_of_the_format_are_read() {
        let old = of(r#"{"lidar_mode": "2048x10", "lidar_data_format": "error: unknown", "prod_line": "OS-1-64"}"#).unwrap();
        assert_eq!((old.elevation_rad.len(), old.columns_per_turn), (64, 2048));
        assert_eq!(
            (old.layout.packet_len(), old.beam_origin_mm),
            (12_608, (15.806, 0.0))
        );
    }

    #[test]
    fn other_files_are_not_taken_and_broken_ones_say_what_is_broken() {
        assert!(read(&UnitFile::new("a.csv", "Channel,Elevation")).is_none());
        assert!(read(&UnitFile::new("a.json", "{\"prod\": 1}")).is_none());
        let error =
            of(r#"{"beam_altitude_angles": [1, 2], "beam_azimuth_angles": [1]}"#).unwrap_err();
        assert!(
            error.to_string().contains("2 altitudes and 1 azimuths"),
            "{error}"
        );
        let error = of(r#"{"data_format": {"udp_profile_lidar": "RNG21"}}"#).unwrap_err();
        assert!(error.to_string().contains("RNG15_RFL8_NIR8"), "{error}");
        assert!(of(r#"{"data_format": {"column_window": [0, 1024]}}"#).is_err());
    }

    #[test]
    fn packets_are_numbered_within_the_window() {
        let window = |first: usize, last: usize| {
            of(&format!(
                r#"{{"data_format": {{"column_window": [{first}, {last}]}}}}"#
            ))
            .unwrap()
        };
        let plain = window(912, 1022);
        assert_eq!(
            (
                plain.packets_per_turn(),
                plain.packet_of(912),
                plain.packet_of(1008)
            ),
            (7, 0, 6)
        );
        let over_seam = window(960, 40);
        assert_eq!(over_seam.packets_per_turn(), 7);
        let numbers = [0, 16, 32, 960, 976, 992, 1008].map(|column| over_seam.packet_of(column));
        assert_eq!(numbers, [0, 1, 2, 3, 4, 5, 6]);
    }
}
