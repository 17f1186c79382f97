//! Cells of the maker's text files: a header line that names the columns, then a line for each channel.
//!
//! Channels count from 1; rows may stand in any order; a byte order mark, empty cells, `EEFF` lines before the
//! header and a digest at the end do not matter.

use crate::error::UnitError;
use crate::packet::unit::UnitFile;

/// First cells of header lines.
const HEADERS: [&str; 6] = [
    "channel",
    "laser id",
    "laserid",
    "loop1",
    "angle state",
    "azimuth state",
];

/// Cells of a text file by line.
pub struct Table {
    /// Names of the columns, in lower case.
    pub names: Vec<String>,
    rows: Vec<(usize, Vec<String>)>,
}

impl Table {
    /// `None` where no line has names of columns.
    pub fn new(file: &UnitFile) -> Option<Self> {
        let text = file.text()?;
        let cells = |line: &str| -> Vec<String> {
            line.split(',').map(|cell| cell.trim().to_owned()).collect()
        };
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(number, line)| (number + 1, cells(line)));
        let is_header = |cells: &[String]| {
            let first = cells[0].to_ascii_lowercase();
            HEADERS.iter().any(|name| first.starts_with(name))
        };
        let (_, names) = lines.find(|(_, cells)| is_header(cells))?;
        let is_row = |cells: &[String]| cells.len() > 1 && cells[0].parse::<f64>().is_ok();
        Some(Self {
            names: names.iter().map(|name| name.to_ascii_lowercase()).collect(),
            rows: lines.filter(|(_, cells)| is_row(cells)).collect(),
        })
    }

    /// Rows of channels.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Rows that a channel's number begins.
    pub fn channels(&self) -> usize {
        let numbers = self.rows.iter().map(|(_, cells)| cells[0].parse::<usize>());
        numbers.filter(Result::is_ok).count()
    }

    /// Values of one column, by the 1-based numbers in another; 0 numbers nothing, and a dash is no value.
    pub fn column(
        &self,
        file: &UnitFile,
        key: usize,
        value: usize,
        channels: usize,
    ) -> Result<Vec<Option<f64>>, UnitError> {
        let mut values = vec![None; channels];
        for (line, cells) in &self.rows {
            let (Some(key), Some(cell)) = (cells.get(key), cells.get(value)) else {
                let (wanted, found) = (format!("{} cells", value + 1), cells.len().to_string());
                return Err(file.refuse(Some(*line), wanted, found));
            };
            if key == "0" || cell == "-" || cell.is_empty() {
                continue;
            }
            let number = cell.parse::<f64>().ok().filter(|number| number.is_finite());
            let refuse = || file.refuse(Some(*line), "a number", format!("{cell:?}"));
            let number = number.ok_or_else(refuse)?;
            let place = key.parse::<usize>().ok();
            let place = place.and_then(|number| number.checked_sub(1));
            match place.and_then(|place| values.get_mut(place)) {
                Some(slot) => *slot = Some(number),
                None => {
                    let expected = format!("a channel from 1 to {channels}");
                    return Err(file.refuse(Some(*line), expected, format!("{key:?}")));
                }
            }
        }
        Ok(values)
    }
}
