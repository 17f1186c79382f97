//! What is known of one unit beyond its model: calibration files, given by the user, found beside
//! the capture, or gathered from the packets themselves.

use super::Decoder;
use crate::capture::DatagramReader;
use crate::error::UnitError;

/// A file that describes one unit. What it is, its content tells.
#[derive(Clone, PartialEq, Eq)]
pub struct UnitFile {
    /// Its name, for messages; packets that describe the unit have one as well.
    pub name: String,
    /// Its bytes.
    pub content: Vec<u8>,
}

impl std::fmt::Debug for UnitFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({} bytes)", self.name, self.content.len())
    }
}

impl UnitFile {
    /// A file's name and bytes.
    pub fn new(name: impl Into<String>, content: impl Into<Vec<u8>>) -> Self {
        Self {
            name: name.into(),
            content: content.into(),
        }
    }

    /// Its text without a byte order mark; `None` where it is none. A line of garbage at the end, such
    /// as the digest that vendors append, does not matter.
    pub fn text(&self) -> Option<String> {
        let is_binary = self.content.iter().take(256).any(|byte| *byte == 0);
        let text = String::from_utf8_lossy(&self.content);
        (!is_binary).then(|| text.trim_start_matches('\u{feff}').to_owned())
    }

    /// What it looks like, for messages.
    pub fn first_line(&self) -> String {
        let Some(text) = self.text() else {
            return format!(
                "{} bytes that begin with {:02x?}",
                self.content.len(),
                &self.content[..self.content.len().min(8)]
            );
        };
        let line: String = text
            .lines()
            .next()
            .unwrap_or_default()
            .chars()
            .take(60)
            .collect();
        format!("text that begins with {line:?}")
    }

    /// An error about this file.
    pub fn refuse(
        &self,
        line: Option<usize>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> UnitError {
        UnitError::Malformed {
            file: self.name.clone(),
            place: line.map_or_else(String::new, |line| format!(", line {line}")),
            expected: expected.into(),
            found: found.into(),
        }
    }
}

/// What `take` takes of a file: of the file itself, or of the first datagram of a capture that it takes.
pub fn find<T>(file: &UnitFile, take: impl Fn(&[u8]) -> Option<T>) -> Option<T> {
    /// A capture has one a second.
    const MOST_DATAGRAMS: usize = 1_000_000;
    if let Some(taken) = take(&file.content) {
        return Some(taken);
    }
    let mut reader = DatagramReader::new(&file.content[..]).ok()?;
    for _ in 0..MOST_DATAGRAMS {
        let datagram = reader.next().ok()??;
        if let Some(taken) = take(datagram.payload) {
            return Some(taken);
        }
    }
    None
}

/// Where the angles of a decoder come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Calibration {
    /// The maker's table of the model, from which single units do not differ.
    Factory,
    /// The maker's example or drawing, from which single units differ; says how to get the unit's own.
    Nominal {
        /// How to get the unit's own.
        obtain: &'static str,
    },
    /// Files or packets of this unit.
    Unit {
        /// Their names.
        names: Vec<String>,
    },
}

impl Calibration {
    /// Of `files` where there are any, else `otherwise`.
    pub fn of(files: &[&UnitFile], otherwise: Self) -> Self {
        if files.is_empty() {
            return otherwise;
        }
        let names = files.iter().map(|file| file.name.clone()).collect();
        Self::Unit { names }
    }

    /// For reports.
    pub fn describe(&self) -> String {
        match self {
            Self::Factory => "factory table".into(),
            Self::Nominal { obtain } => {
                format!("nominal table, unit calibration missing: {obtain}")
            }
            Self::Unit { names } => names.join(", "),
        }
    }
}

/// What files or packets of a unit tell beside its angles.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct UnitFacts {
    /// Word for its return mode, where data packets do not tell it.
    pub return_mode: Option<&'static str>,
    /// What else a user should know.
    pub notes: Vec<String>,
}

/// A decoder for one unit.
pub struct Fitted {
    /// It.
    pub decoder: Box<dyn Decoder>,
    /// Where its angles come from.
    pub calibration: Calibration,
}

/// Gathers what the data packets tell of their unit, piece by piece.
pub trait Gather: Send + Sync + std::fmt::Debug {
    /// Takes a data packet.
    fn take(&mut self, payload: &[u8]);

    /// What has been gathered, once it is complete.
    fn file(&self) -> Option<UnitFile>;
}
