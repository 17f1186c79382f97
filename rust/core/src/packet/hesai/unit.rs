//! Angles and firing times of one unit: the maker's text files, and the tables that are built in.
//!
//! A text file has a header line that names its columns. Channels count from 1; rows may stand in any
//! order; a byte order mark, empty cells, `EEFF` lines before the header and a digest at the end do not
//! matter.

use crate::error::UnitError;
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
}

/// How to get the files of a unit.
pub const OBTAIN: &str = "fetch the angle file from the sensor's web page or with the maker's viewer, and lay it beside the \
    capture under its name or give it: --beams ADDRESS=FILE";

impl Unit {
    /// Reads a table that is built in.
    pub fn built_in(name: &'static str, text: &str) -> Self {
        let file = UnitFile::new(name, text);
        let table = Table::new(&file).expect("the built-in tables have a header");
        let angles = table.angles(&file).expect("the built-in tables are sound");
        let names = table.names.iter().skip(3).cloned();
        let times = names.enumerate().map(|(place, name)| {
            let column = table.column(&file, 0, place + 3, table.rows.len());
            (name, column.expect("the built-in tables are sound"))
        });
        Self {
            elevation_rad: angles.0,
            azimuth_rad: angles.1,
            fire_times: times.collect(),
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
            let angles = Table::new(file)
                .ok_or_else(|| file.refuse(None, "a header line", "none"))?
                .angles(file)?;
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

    /// Replaces the firing times that the file has: one column of channels, or one a loop.
    fn read_fire_times(&mut self, file: &UnitFile) -> Result<(), UnitError> {
        let Some(table) = Table::new(file) else {
            return Err(file.refuse(None, "a header line", "none"));
        };
        let channels = self.elevation_rad.len();
        for (pair, (_, times)) in self.fire_times.iter_mut().enumerate() {
            let (key, value) = (2 * pair, 2 * pair + 1);
            if value < table.names.len() {
                *times = table.column(file, key, value, channels)?;
            }
        }
        Ok(())
    }
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
    } else if has("fire time") || has("firetime") {
        Some(Kind::FireTimes)
    } else if has("loop1") && has("lasernum") {
        Some(Kind::Channels)
    } else {
        None
    }
}

/// Number of channels that an angle file has; `None` for another file.
pub fn angle_channels(file: &UnitFile) -> Option<usize> {
    if kind(file)? != Kind::Angles {
        return None;
    }
    let table = Table::new(file)?;
    let numbers = table
        .rows
        .iter()
        .map(|(_, cells)| cells[0].parse::<usize>());
    Some(numbers.filter(Result::is_ok).count())
}

/// Cells of a text file by line.
struct Table {
    names: Vec<String>,
    rows: Vec<(usize, Vec<String>)>,
}

impl Table {
    /// `None` where no line has names of columns.
    fn new(file: &UnitFile) -> Option<Self> {
        let text = file.text()?;
        let cells = |line: &str| {
            line.split(',')
                .map(|cell| cell.trim().to_owned())
                .collect::<Vec<_>>()
        };
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(n, line)| (n + 1, cells(line)));
        let is_header = |cells: &[String]| {
            let first = cells[0].to_ascii_lowercase();
            ["channel", "laser id", "loop1"]
                .iter()
                .any(|name| first.starts_with(name))
        };
        let (_, names) = lines.find(|(_, cells)| is_header(cells))?;
        let is_row = |cells: &[String]| cells.len() > 1 && cells[0].parse::<f64>().is_ok();
        let rows = lines.filter(|(_, cells)| is_row(cells)).collect();
        Some(Self { names, rows })
    }

    /// Elevations and azimuths, radians.
    fn angles(&self, file: &UnitFile) -> Result<(Vec<f64>, Vec<f64>), UnitError> {
        let count = self.rows.len();
        let whole = |column: usize| {
            let values = self.column(file, 0, column, count)?;
            let angles = values
                .iter()
                .map(|value| value.map(|micros| (micros / 1000.0).to_radians()));
            let all: Option<Vec<f64>> = angles.collect();
            all.ok_or_else(|| {
                file.refuse(None, format!("channels 1 to {count}, each once"), "a gap")
            })
        };
        Ok((whole(1)?, whole(2)?))
    }

    /// Values of one column times 1000, by the 1-based numbers in another; 0 numbers nothing.
    fn column(
        &self,
        file: &UnitFile,
        key: usize,
        value: usize,
        channels: usize,
    ) -> Result<FireTimes, UnitError> {
        let mut values = vec![None; channels];
        for (line, cells) in &self.rows {
            let (Some(key), Some(cell)) = (cells.get(key), cells.get(value)) else {
                return Err(file.refuse(
                    Some(*line),
                    format!("{} cells", value + 1),
                    cells.len().to_string(),
                ));
            };
            if key == "0" || cell == "-" || cell.is_empty() {
                continue;
            }
            let number = cell.parse::<f64>().ok().filter(|number| number.is_finite());
            let number =
                number.ok_or_else(|| file.refuse(Some(*line), "a number", format!("{cell:?}")))?;
            let place = key
                .parse::<usize>()
                .ok()
                .and_then(|number| number.checked_sub(1));
            match place.and_then(|place| values.get_mut(place)) {
                Some(slot) => *slot = Some(number * 1000.0),
                None => {
                    let expected = format!("a channel from 1 to {channels}");
                    return Err(file.refuse(Some(*line), expected, format!("{key:?}")));
                }
            }
        }
        Ok(values)
    }
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
    fn loops_have_channels_of_their_own() {
        let table = "Channel,Elevation,Azimuth,loop1,loop2\n1,1,1,-,-\n2,2,2,-,-\n";
        let file = UnitFile::new(
            "t",
            "EEFF,1,1,\nHorizontal,1,LoopNum,2\nLoop1,Firetime1,Loop2,Firetime2\n2,0.6,1,1.5\n0,0,0,0\n",
        );
        assert_eq!(kind(&file), Some(Kind::FireTimes));
        let (unit, _) = Unit::built_in("q", table).with(&[file]).unwrap();
        assert_eq!(unit.fire("loop1").unwrap(), &[None, Some(600.0)]);
        assert_eq!(unit.fire("loop2").unwrap(), &[Some(1500.0), None]);
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
