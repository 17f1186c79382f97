//! Angles and firing times of one unit: the maker's text files, and the tables that are built in.

use super::firing;
use super::text::Table;
use crate::error::UnitError;
use crate::packet::beams::is_near;
use crate::packet::unit::{Calibration, UnitFile};

/// Times of one way to fire, ns, by channel; `None` where a channel does not fire.
pub type FireTimes = Vec<Option<f64>>;

/// What is known of one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Angles above the plane of rotation, by channel.
    pub elevation_rad: Vec<f64>,
    /// Added to the block's azimuth, by channel.
    pub azimuth_rad: Vec<f64>,
    /// Firing times by name of the column.
    pub fire_times: Vec<(String, FireTimes)>,
    /// Targets nearer than this have the firing times for near ones, where a file tells it.
    pub near_m: Option<f64>,
}

/// How to get the files of a unit.
pub const OBTAIN: &str = "fetch the angle file from the sensor's web page or with the maker's viewer, and lay it beside the \
    capture under its name or give it: --beams ADDRESS=FILE";

impl Unit {
    /// Reads a table that is built in.
    pub fn built_in(name: &'static str, text: &str) -> Self {
        let file = UnitFile::new(name, text);
        let table = Table::new(&file).expect("the built-in tables have a header");
        let angles = angles(&table, &file).expect("the built-in tables are sound");
        let names = table.names.iter().skip(3).cloned();
        let times = names.enumerate().map(|(place, name)| {
            let column = table.column(&file, 0, place + 3, table.count());
            let column = column.expect("the built-in tables are sound");
            let nanos = column
                .into_iter()
                .map(|micros| micros.map(|us| us * 1000.0));
            (name, nanos.collect())
        });
        Self {
            elevation_rad: angles.0,
            azimuth_rad: angles.1,
            fire_times: times.collect(),
            near_m: None,
        }
    }

    /// Firing times of the column with this name.
    pub fn fire(&self, name: &str) -> Option<&FireTimes> {
        let found = self.fire_times.iter().find(|(known, _)| known == name);
        found.map(|(_, times)| times)
    }

    /// This unit with what `files` say instead; gives where the angles come from.
    ///
    /// # Errors
    /// [`UnitError`] for a file of the right kind with wrong content.
    pub fn with(mut self, files: &[UnitFile]) -> Result<(Self, Calibration), UnitError> {
        let mut used = Vec::new();
        let find = |wanted: Kind| files.iter().find(|file| kind(file) == Some(wanted));
        let nominal = Calibration::Nominal { obtain: OBTAIN };
        if let Some(file) = find(Kind::Angles) {
            let table = Table::new(file);
            let table = table.ok_or_else(|| file.refuse(None, "a header line", "none"))?;
            let angles = angles(&table, file)?;
            let channels = self.elevation_rad.len();
            if angles.0.len() != channels {
                let found = angles.0.len().to_string();
                return Err(file.refuse(None, format!("{channels} channels"), found));
            }
            (self.elevation_rad, self.azimuth_rad) = angles;
            used.push(file);
        }
        let has_angles = !used.is_empty();
        if let Some(file) = find(Kind::FireTimes) {
            self.read_fire_times(file)?;
            used.push(file);
        }
        let calibration = if has_angles {
            Calibration::of(&used, nominal)
        } else {
            nominal
        };
        Ok((self, calibration))
    }

    /// Replaces the firing times by those of a file.
    fn read_fire_times(&mut self, file: &UnitFile) -> Result<(), UnitError> {
        let channels = self.elevation_rad.len();
        let ways = self.fire_times.iter_mut();
        // Beside them an ATX has azimuths of odd frames.
        let mut ways: Vec<_> = ways
            .filter(|(name, _)| !name.starts_with("azimuth"))
            .collect();
        let firing = firing::read(file, channels, ways.len())?;
        for ((_, times), told) in ways.iter_mut().zip(firing.times) {
            *times = told;
        }
        self.near_m = firing.near_m;
        Ok(())
    }
}

/// Elevations and azimuths, radians.
fn angles(table: &Table, file: &UnitFile) -> Result<(Vec<f64>, Vec<f64>), UnitError> {
    let count = table.count();
    let whole = |column: usize| {
        let values = table.column(file, 0, column, count)?;
        let all: Option<Vec<f64>> = values.iter().map(|deg| deg.map(f64::to_radians)).collect();
        all.ok_or_else(|| file.refuse(None, format!("channels 1 to {count}, each once"), "a gap"))
    };
    Ok((whole(1)?, whole(2)?))
}

/// What a text file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Elevations and azimuths of the channels.
    Angles,
    /// Firing times.
    FireTimes,
    /// Which lasers the channels of each loop are.
    Channels,
}

/// What a file is, judged by its header line.
pub fn kind(file: &UnitFile) -> Option<Kind> {
    let text = file.text()?;
    let head: Vec<String> = text.lines().take(4).map(str::to_ascii_lowercase).collect();
    let has = |word: &str| head.iter().any(|line| line.contains(word));
    if has("elevation") && has("azimuth") {
        Some(Kind::Angles)
    } else if firing::is_head(&head) {
        Some(Kind::FireTimes)
    } else if has("loop1") && has("lasernum") {
        Some(Kind::Channels)
    } else {
        None
    }
}

/// Whether a file of angles is of a unit of the model with this table: as many channels, and elevations near
/// the model's, for others have as many. What is broken is left for [`Unit::with`] to tell.
pub fn is_of(file: &UnitFile, model: &Unit) -> bool {
    let Some(table) = Table::new(file) else {
        return false;
    };
    let is_near =
        || angles(&table, file).map_or(true, |told| is_near(&told.0, &model.elevation_rad));
    table.channels() == model.elevation_rad.len() && is_near()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain() -> Unit {
        Unit::built_in(
            "test",
            "Channel,Elevation,Azimuth,fire\n1,15,-1,6\n2,-15,1,-\n",
        )
    }

    #[test]
    fn rows_in_any_order_and_what_vendors_add_are_read() {
        let angles = UnitFile::new(
            "a",
            "\u{feff}EEFF,1,1\r\nLaser id,Elevation,Azimuth\r\n2,-14.5,1.25\r\n1,14,0\r\nab12ff\r\n",
        );
        let times = UnitFile::new("t", "Channel,fire time(\u{3bc}s)\r\n2,-4.5\r\n1,3\r\n");
        let (unit, calibration) = plain().with(&[times, angles]).unwrap();
        assert!((unit.elevation_rad[1].to_degrees() + 14.5).abs() < 1e-12);
        assert!((unit.azimuth_rad[1].to_degrees() - 1.25).abs() < 1e-12);
        assert_eq!(unit.fire("fire").unwrap(), &[Some(3000.0), Some(-4500.0)]);
        assert_eq!(calibration.describe(), "a, t");
    }

    #[test]
    fn without_angles_the_table_is_nominal() {
        let (unit, calibration) = plain().with(&[]).unwrap();
        assert_eq!(unit.fire("fire").unwrap(), &[Some(6000.0), None]);
        assert!(calibration.describe().starts_with("nominal"));
    }

    #[test]
    fn firing_times_of_another_shape_are_refused() {
        let table = "Channel,Elevation,Azimuth,loop1,loop2\n1,1,1,-,-\n2,2,2,-,-\n";
        let file = UnitFile::new("t", "Channel,fire time(us)\n1,1.5\n2,1.6\n");
        let error = Unit::built_in("q", table).with(&[file]).unwrap_err();
        assert!(
            error.to_string().contains("2 columns of firing times"),
            "{error}"
        );
    }

    #[test]
    fn broken_files_are_refused_where_they_are_broken() {
        let refuse = |text: &str| {
            plain()
                .with(&[UnitFile::new("a", text)])
                .unwrap_err()
                .to_string()
        };
        assert!(refuse("Channel,Elevation,Azimuth\n1,14,0\n").contains("2 channels"));
        assert!(refuse("Channel,Elevation,Azimuth\n1,up,0\n2,1,1\n").contains("line 2"));
        assert!(refuse("Channel,Elevation,Azimuth\n1,1,0\n1,1,1\n").contains("each once"));
        assert!(refuse("Channel,Elevation,Azimuth\n1,1,0\n3,1,1\n").contains("from 1 to 2"));
    }
}
