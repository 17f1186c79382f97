//! One file of a set: waiting, open or done.

use std::path::{Path, PathBuf};

use lidar_deflect_core::capture::{CaptureFacts, Record, RecordReader};
use lidar_deflect_core::error::CaptureError;
use lidar_deflect_core::time::Timestamp;

use crate::error::FileError;
use crate::source::{Source, size};

/// What was read of one file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileFacts {
    /// The path as given.
    pub path: PathBuf,
    /// Size of the file as it lies there, compressed or not, bytes.
    pub size: u64,
    /// What was seen so far.
    pub facts: CaptureFacts,
}

enum State {
    Waiting,
    Open(Box<RecordReader<Source>>),
    Done(Box<CaptureFacts>),
}

/// One file of a set.
pub(crate) struct Member {
    path: PathBuf,
    size: u64,
    is_regular: bool,
    /// Stamp of the first record; `None` where there is none.
    first_time: Option<Timestamp>,
    state: State,
}

impl Member {
    /// Looks at the first record, so that files can be put in order.
    pub(crate) fn new(path: &Path) -> Result<Self, FileError> {
        let (size, is_regular) = size(path)?;
        let mut member = Self {
            path: path.into(),
            size,
            is_regular,
            first_time: None,
            state: State::Waiting,
        };
        member.open()?;
        Ok(member)
    }

    /// Opens the file where it is not open and stands on its first record. `false`: it has none.
    pub(crate) fn open(&mut self) -> Result<bool, FileError> {
        if let State::Waiting = self.state {
            let source = Source::open(&self.path)?;
            let reader = RecordReader::new(source).map_err(|error| self.blame(error))?;
            self.state = State::Open(Box::new(reader));
            if self.advance()? {
                self.first_time = self.record().map(|record| record.time);
            }
        }
        Ok(matches!(self.state, State::Open(_)))
    }

    /// Lets go of the file until its turn comes; a pipe, which cannot be opened twice, stays open.
    pub(crate) fn rest(&mut self) {
        if self.is_regular && matches!(self.state, State::Open(_)) {
            self.state = State::Waiting;
        }
    }

    /// Steps to the next record. `false`: the file is at its end and closed.
    pub(crate) fn advance(&mut self) -> Result<bool, FileError> {
        let State::Open(reader) = &mut self.state else {
            return Ok(false);
        };
        let step = reader.advance();
        if !matches!(step, Ok(true)) {
            self.state = State::Done(Box::new(reader.facts().clone()));
        }
        step.map_err(|error| self.blame(error))
    }

    fn blame(&self, error: CaptureError) -> FileError {
        FileError::Capture {
            path: self.path.clone(),
            error,
        }
    }

    /// The record that the file stands on.
    pub(crate) fn record(&self) -> Option<Record<'_>> {
        match &self.state {
            State::Open(reader) => Some(reader.record()),
            _ => None,
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn first_time(&self) -> Option<Timestamp> {
        self.first_time
    }

    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// Bytes of the file that were read, as it lies there.
    pub(crate) fn bytes_done(&self) -> u64 {
        match &self.state {
            State::Waiting => 0,
            State::Open(reader) => reader.get_ref().bytes_read(),
            State::Done(_) => self.size,
        }
    }

    pub(crate) fn facts(&self) -> FileFacts {
        let facts = match &self.state {
            State::Waiting => CaptureFacts::default(),
            State::Open(reader) => reader.facts().clone(),
            State::Done(facts) => (**facts).clone(),
        };
        FileFacts {
            path: self.path.clone(),
            size: self.size,
            facts,
        }
    }
}
