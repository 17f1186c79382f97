//! Which lasers the channels of a block are, where a unit was told to send a choice of them.
//!
//! The maker's file has a line `LaserNum,80,BlockNum,2`, a header line that names the loops, then for each
//! channel of a block the number of its laser, counted from 1, in every loop; a digest may end it.
//!
//! Source: the maker's development kit.

use super::unit::{Kind, kind};
use crate::error::UnitError;
use crate::packet::unit::UnitFile;

/// Lasers of the channels of a block, 0-based, by loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channels(Vec<Vec<usize>>);

/// Cells of the lines from the one on whose first cell is `name`.
fn lines_from<'a>(text: &'a str, name: &str) -> impl Iterator<Item = (usize, Vec<&'a str>)> {
    let cells = |line: &'a str| line.split(',').map(str::trim).collect::<Vec<_>>();
    let lines = text.lines().enumerate();
    let lines = lines.map(move |(place, line)| (place + 1, cells(line)));
    let name = name.to_owned();
    lines.skip_while(move |(_, cells)| !cells[0].eq_ignore_ascii_case(&name))
}

impl Channels {
    /// The channels that `files` tell of a sensor with so many lasers; `None` where none does.
    ///
    /// # Errors
    /// [`UnitError`] for a file of channels with wrong content.
    pub fn find(files: &[UnitFile], lasers: usize) -> Result<Option<Self>, UnitError> {
        let file = files.iter().find(|file| kind(file) == Some(Kind::Channels));
        file.map(|file| Self::read(file, lasers)).transpose()
    }

    fn read(file: &UnitFile, lasers: usize) -> Result<Self, UnitError> {
        let text = file.text().unwrap_or_default();
        let count = Self::count(file, &text, lasers)?;
        let mut lines = lines_from(&text, "loop1");
        let loops = lines.next().map_or(0, |(_, names)| names.len());
        let mut channels = Self(vec![Vec::with_capacity(count); loops]);
        for (line, cells) in lines.take(count) {
            for (place, lasers_of) in channels.0.iter_mut().enumerate() {
                let cell = cells.get(place).copied().unwrap_or_default();
                lasers_of.push(Self::laser(file, line, cell, lasers)?);
            }
        }
        match channels.0.first().map(Vec::len) {
            Some(found) if found == count => Ok(channels),
            found => {
                let found = found.unwrap_or(0).to_string();
                Err(file.refuse(None, format!("{count} channels"), found))
            }
        }
    }

    /// Channels of a block.
    fn count(file: &UnitFile, text: &str, lasers: usize) -> Result<usize, UnitError> {
        let line = lines_from(text, "lasernum").next();
        let (line, cells) = line.unwrap_or_default();
        let cell = cells.get(1).copied().unwrap_or_default();
        let count = cell.parse::<usize>().ok();
        let count = count.filter(|count| (1..=lasers).contains(count));
        let expected = || format!("a number of channels from 1 to {lasers}");
        count.ok_or_else(|| file.refuse(Some(line), expected(), format!("{cell:?}")))
    }

    fn laser(file: &UnitFile, line: usize, cell: &str, lasers: usize) -> Result<usize, UnitError> {
        let number = cell.parse::<usize>().ok();
        let number = number.filter(|number| (1..=lasers).contains(number));
        let expected = || format!("a laser from 1 to {lasers}");
        number
            .map(|number| number - 1)
            .ok_or_else(|| file.refuse(Some(line), expected(), format!("{cell:?}")))
    }

    /// Lasers of a loop; `None` where a block has another number of channels.
    pub fn of(&self, number: usize, channels: usize) -> Option<&[usize]> {
        let lasers = self.0.get(number)?;
        (lasers.len() == channels).then_some(lasers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Channels, String> {
        let file = UnitFile::new("c", text);
        let found = Channels::find(&[file], 128).map_err(|error| error.to_string())?;
        found.ok_or_else(|| "no file of channels".into())
    }

    #[test]
    fn each_loop_has_its_lasers_and_a_digest_is_none() {
        let text = "\u{feff}EEFF,1,1\r\nLaserNum,2,BlockNum,2\r\nLoop1,Loop2\r\n49,17\r\n128,1\r\n3142432,,,\r\n";
        let channels = read(text).unwrap();
        assert_eq!(channels.of(0, 2), Some(&[48, 127][..]));
        assert_eq!(channels.of(1, 2), Some(&[16, 0][..]));
        assert_eq!(channels.of(1, 128), None);
        assert_eq!(channels.of(2, 2), None);
    }

    #[test]
    fn broken_files_are_refused_where_they_are_broken() {
        let refuse = |count: &str, rows: &str| {
            read(&format!(
                "EEFF,1,1\nLaserNum,{count},BlockNum,2\nLoop1,Loop2\n{rows}"
            ))
            .unwrap_err()
        };
        assert!(refuse("2", "1,2\n0,3\n").contains("line 5"));
        assert!(refuse("2", "1,2\n1\n").contains("line 5"));
        assert!(refuse("2", "1,2\n").contains("2 channels"));
        assert!(refuse("129", "1,2\n").contains("line 2"));
        assert!(refuse("", "1,2\n").contains("line 2"));
    }
}
