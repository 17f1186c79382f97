//! Calibration files of Velodyne units: YAML of the ROS driver, XML of the maker's viewer.
//!
//! The YAML has radians and metres, the XML degrees and centimetres.

use std::collections::BTreeMap;

use crate::error::{InvalidValue, UnitError};
use crate::packet::Decoder;
use crate::packet::beams::{Beam, Beams, is_near};
use crate::packet::unit::{Calibration, Fitted, UnitFile};

/// What a file says of one laser. What it leaves out is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Laser {
    /// Taken from the encoder azimuth.
    pub rotation_rad: f64,
    /// Angle above the plane of rotation.
    pub elevation_rad: f64,
    /// Added to the range of far targets.
    pub distance_m: f64,
    /// Added to the range of near targets along the viewer's x; `None` for one correction at all ranges.
    pub distance_x_m: Option<f64>,
    /// The same along y.
    pub distance_y_m: Option<f64>,
    /// Where the beam starts above the origin.
    pub vertical_offset_m: f64,
    /// Where it starts beside the spin axis.
    pub horizontal_offset_m: f64,
    /// Range at which the optics are in focus.
    pub focal_distance_m: f64,
    /// How brightness falls off the focus.
    pub focal_slope: f64,
    /// Least brightness.
    pub min_intensity: f64,
    /// Most brightness; 0 = no limit.
    pub max_intensity: f64,
}

impl Laser {
    /// The beam of a model with one correction for all ranges, and its delay from `nominal`.
    fn beam(&self, nominal: &Beam) -> Beam {
        Beam {
            elevation_rad: self.elevation_rad,
            azimuth_offset_rad: -self.rotation_rad,
            vertical_offset_m: self.vertical_offset_m,
            range_offset_m: self.distance_m,
            ..*nominal
        }
    }
}

/// Whether `file` describes a unit with so many lasers.
pub fn has_lasers(file: &UnitFile, lasers: usize) -> bool {
    file.text()
        .is_some_and(|text| count(&text).is_some_and(|found| found == lasers))
}

/// Whether `file` describes a unit of the model with these beams: as many lasers, and elevations near the
/// model's, for others have as many. What is broken is left for [`lasers`] to tell.
pub fn takes(file: &UnitFile, nominal: &Beams) -> bool {
    let nominal = nominal.channels();
    let elevations = lasers(file)
        .map(|lasers| -> Vec<f64> { lasers.iter().map(|laser| laser.elevation_rad).collect() });
    let model = nominal
        .iter()
        .map(|beam| beam.elevation_rad)
        .collect::<Vec<_>>();
    has_lasers(file, nominal.len()) && elevations.map_or(true, |told| is_near(&told, &model))
}

/// A decoder for the unit of the file among `files`, or for `nominal` beams.
pub fn fit(
    files: &[UnitFile],
    nominal: &Beams,
    decoder: impl Fn(&Beams) -> Result<Box<dyn Decoder>, InvalidValue>,
) -> Result<Fitted, UnitError> {
    let own = files.iter().find(|file| takes(file, nominal));
    let beams = match own {
        None => nominal.clone(),
        Some(file) => {
            let lasers = lasers(file)?;
            let pairs = lasers.iter().zip(nominal.channels());
            let channels = pairs.map(|(laser, nominal)| laser.beam(nominal)).collect();
            let refuse = |error: InvalidValue| file.refuse(None, error.expected, error.found);
            Beams::new(channels).map_err(refuse)?
        }
    };
    let decoder = decoder(&beams).map_err(|error| UnitError::Malformed {
        file: error.name.into(),
        place: String::new(),
        expected: error.expected,
        found: error.found,
    })?;
    let used: Vec<&UnitFile> = own.into_iter().collect();
    Ok(Fitted {
        decoder,
        calibration: Calibration::of(&used, Calibration::Factory),
    })
}

/// Lasers of a file, by number.
///
/// # Errors
/// [`UnitError`] where one is missing, named twice, or has a value that is no number.
pub fn lasers(file: &UnitFile) -> Result<Vec<Laser>, UnitError> {
    let text = file.text().unwrap_or_default();
    let items = items(&text);
    let mut lasers = vec![None; items.len()];
    for item in &items {
        let laser = item.laser(file)?;
        let number = item.number(file, "id")?;
        let place = lasers
            .get_mut(number as usize)
            .filter(|place| place.is_none() && number >= 0.0 && number.fract() == 0.0);
        match place {
            Some(place) => *place = Some(laser),
            None => {
                let expected = format!("lasers 0 to {}, each once", items.len() - 1);
                return Err(file.refuse(None, expected, format!("laser {number}")));
            }
        }
    }
    Ok(lasers.into_iter().flatten().collect())
}

fn count(text: &str) -> Option<usize> {
    let found = items(text).len();
    (found > 0).then_some(found)
}

/// Values of one laser by their short names, and whether they are in degrees and centimetres.
struct Item<'a> {
    values: BTreeMap<&'static str, &'a str>,
    is_xml: bool,
}

/// Short names, as the YAML and as the XML have them.
const NAMES: [(&str, &str, &str); 12] = [
    ("id", "laser_id", "id_"),
    ("rotation", "rot_correction", "rotCorrection_"),
    ("elevation", "vert_correction", "vertCorrection_"),
    ("distance", "dist_correction", "distCorrection_"),
    ("distance_x", "dist_correction_x", "distCorrectionX_"),
    ("distance_y", "dist_correction_y", "distCorrectionY_"),
    (
        "vertical",
        "vert_offset_correction",
        "vertOffsetCorrection_",
    ),
    (
        "horizontal",
        "horiz_offset_correction",
        "horizOffsetCorrection_",
    ),
    ("focal_distance", "focal_distance", "focalDistance_"),
    ("focal_slope", "focal_slope", "focalSlope_"),
    ("min_intensity", "min_intensity", "minIntensity_"),
    ("max_intensity", "max_intensity", "maxIntensity_"),
];

impl Item<'_> {
    fn laser(&self, file: &UnitFile) -> Result<Laser, UnitError> {
        let length = if self.is_xml { 0.01 } else { 1.0 };
        let angle = |name| {
            let value = self.number(file, name)?;
            Ok(if self.is_xml {
                value.to_radians()
            } else {
                value
            })
        };
        let metres = |name| self.number(file, name).map(|value| value * length);
        let near = |name: &'static str| {
            let is_given = self.values.contains_key(name);
            is_given.then(|| metres(name)).transpose()
        };
        Ok(Laser {
            rotation_rad: angle("rotation")?,
            elevation_rad: angle("elevation")?,
            distance_m: metres("distance")?,
            distance_x_m: near("distance_x")?,
            distance_y_m: near("distance_y")?,
            vertical_offset_m: metres("vertical")?,
            horizontal_offset_m: metres("horizontal")?,
            focal_distance_m: self.focal_distance_m(file)?,
            focal_slope: self.number(file, "focal_slope")?,
            min_intensity: self.number(file, "min_intensity")?,
            max_intensity: self.number(file, "max_intensity")?,
        })
    }

    /// Metres in the YAML, but for files whose makers left the viewer's centimetres as they were.
    fn focal_distance_m(&self, file: &UnitFile) -> Result<f64, UnitError> {
        /// The lasers see no farther.
        const MOST_M: f64 = 131.0;
        let value = self.number(file, "focal_distance")?;
        let is_metres = !self.is_xml && value <= MOST_M;
        Ok(if is_metres { value } else { value * 0.01 })
    }

    fn number(&self, file: &UnitFile, name: &'static str) -> Result<f64, UnitError> {
        let Some(text) = self.values.get(name) else {
            return Ok(0.0);
        };
        let number = text.parse::<f64>().ok().filter(|value| value.is_finite());
        number.ok_or_else(|| file.refuse(None, format!("a number as {name}"), format!("{text:?}")))
    }
}

fn items(text: &str) -> Vec<Item<'_>> {
    if text.contains("<px") {
        return xml_items(text);
    }
    if text.contains("vert_correction") {
        yaml_items(text)
    } else {
        Vec::new()
    }
}

/// List items in block or flow style; a list ends where a line stands further left.
fn yaml_items(text: &str) -> Vec<Item<'_>> {
    let mut items: Vec<Item<'_>> = Vec::new();
    let lines = text.lines().skip_while(|line| !line.starts_with("lasers:"));
    for line in lines.skip(1) {
        let line = line.split('#').next().unwrap_or_default();
        let trimmed = line.trim_start();
        if !trimmed.is_empty() && trimmed.len() == line.len() && !trimmed.starts_with('-') {
            break; // a key at the top level
        }
        let is_new = trimmed.starts_with("- ") || trimmed.starts_with("-{");
        if is_new {
            items.push(Item {
                values: BTreeMap::new(),
                is_xml: false,
            });
        }
        let Some(item) = items.last_mut() else {
            continue;
        };
        let content = if is_new { &trimmed[1..] } else { trimmed };
        for pair in content.split(['{', '}', ',']) {
            let Some((key, value)) = pair.split_once(':') else {
                continue;
            };
            let known = NAMES.iter().find(|(_, name, _)| *name == key.trim());
            if let Some((name, ..)) = known {
                item.values.insert(name, value.trim());
            }
        }
    }
    items
}

/// One `<px>` each; limits of brightness stand in lists of their own.
fn xml_items(text: &str) -> Vec<Item<'_>> {
    let bodies = text.split("<px").skip(1);
    let bodies = bodies.filter_map(|rest| rest.split_once("</px>").map(|(body, _)| body));
    let least = xml_list(text, "minIntensity_");
    let most = xml_list(text, "maxIntensity_");
    bodies
        .enumerate()
        .map(|(place, body)| {
            let known = NAMES
                .iter()
                .filter_map(|(name, _, tag)| Some((*name, xml_value(body, tag)?)));
            let mut values: BTreeMap<_, _> = known.collect();
            values.extend(least.get(place).map(|value| ("min_intensity", *value)));
            values.extend(most.get(place).map(|value| ("max_intensity", *value)));
            Item {
                values,
                is_xml: true,
            }
        })
        .collect()
}

fn xml_value<'a>(text: &'a str, tag: &str) -> Option<&'a str> {
    let (_, rest) = text.split_once(&format!("<{tag}>"))?;
    rest.split_once('<').map(|(value, _)| value.trim())
}

fn xml_list<'a>(text: &'a str, tag: &str) -> Vec<&'a str> {
    let Some((_, rest)) = text.split_once(&format!("<{tag}")) else {
        return Vec::new();
    };
    let (body, _) = rest.split_once(&format!("</{tag}>")).unwrap_or_default();
    let items = body.split("<item>").skip(1);
    items
        .filter_map(|item| item.split_once('<').map(|(value, _)| value.trim()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: &str = "num_lasers: 2\nlasers:\n  - laser_id: 1\n    rot_correction: 0.5\n    \
        vert_correction: -0.25 # down\n  - laser_id: 0\n    vert_correction: 0.125\ndistance_resolution: 0.002\n";
    const FLOW: &str = "lasers:\n- {dist_correction: 1.5, dist_correction_x: 1.25, laser_id: 0,\n  \
        vert_correction: 0.125, vert_offset_correction: 0.01}\n- {laser_id: 1, rot_correction: 0.5,\n  \
        vert_correction: -0.25}\nnum_lasers: 2\n";

    #[test]
    fn both_styles_of_the_list_are_read_by_number() {
        for text in [BLOCK, FLOW] {
            let file = UnitFile::new("unit.yaml", text);
            assert!(has_lasers(&file, 2) && !has_lasers(&file, 16));
            let lasers = lasers(&file).unwrap();
            assert_eq!(lasers[0].elevation_rad, 0.125);
            assert_eq!(
                (lasers[1].rotation_rad, lasers[1].elevation_rad),
                (0.5, -0.25)
            );
        }
        let flow = lasers(&UnitFile::new("unit.yaml", FLOW)).unwrap();
        assert_eq!(
            (flow[0].distance_m, flow[0].distance_x_m),
            (1.5, Some(1.25))
        );
        assert_eq!(
            (flow[1].distance_x_m, flow[0].vertical_offset_m),
            (None, 0.01)
        );
    }

    #[test]
    fn the_viewer_writes_degrees_and_centimetres() {
        let text = "<DB><minIntensity_><count>1</count><item>7</item></minIntensity_><points_><item>\
            <px class_id=\"10\"><id_>0</id_><rotCorrection_>180</rotCorrection_><vertCorrection_>-90\
            </vertCorrection_><distCorrection_>140</distCorrection_></px></item></points_></DB>";
        let file = UnitFile::new("db.xml", text);
        assert!(has_lasers(&file, 1));
        let laser = lasers(&file).unwrap()[0];
        assert!((laser.rotation_rad - std::f64::consts::PI).abs() < 1e-12);
        assert!((laser.elevation_rad + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((laser.distance_m - 1.4).abs() < 1e-12 && laser.min_intensity == 7.0);
    }

    #[test]
    fn the_focus_is_in_metres_or_centimetres() {
        let focus_m = |value: &str| {
            let text = BLOCK.replace(
                "vert_correction: 0.125",
                &format!("vert_correction: 0.125\n    focal_distance: {value}"),
            );
            lasers(&UnitFile::new("u", text)).unwrap()[0].focal_distance_m
        };
        assert_eq!((focus_m("10.5"), focus_m("1050")), (10.5, 10.5));
    }

    #[test]
    fn broken_files_are_refused_with_what_was_expected() {
        let twice = UnitFile::new("u", BLOCK.replace("laser_id: 1", "laser_id: 0"));
        assert!(
            lasers(&twice)
                .unwrap_err()
                .to_string()
                .contains("each once")
        );
        let word = UnitFile::new("u", BLOCK.replace("0.125", "up"));
        assert!(lasers(&word).unwrap_err().to_string().contains("\"up\""));
        assert!(!has_lasers(&UnitFile::new("u", "lasers: none"), 0));
        assert!(!has_lasers(&UnitFile::new("u", [0_u8, 1, 2].as_slice()), 0));
    }
}
