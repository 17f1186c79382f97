//! Several files as one recording: rotated sets, and files of one lidar each, merged by time.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use lidar_deflect_core::capture::{Assembler, Datagram, Found, FragmentFacts, Record};
use lidar_deflect_core::drops::Drops;
use lidar_deflect_core::time::Timestamp;

use crate::error::FileError;
use crate::member::{FileFacts, Member};

/// The files of one recording as a stream of UDP datagrams in the order of their arrival.
///
/// Files are plain, gzip or zstd by their first bytes. They are merged by the time of their records;
/// within a file the order stays. A file is opened when its first record is due and closed at its
/// end, so that a rotated set of any length takes the memory of one file. IP fragments of one
/// datagram may lie in two files.
pub struct CaptureSet {
    /// In order of their first records.
    members: Vec<Member>,
    /// Members that stand on a record.
    active: Vec<usize>,
    /// First member whose turn has not come.
    next_member: usize,
    /// The member whose record was handed out last.
    current: Option<usize>,
    assembler: Assembler,
}

impl CaptureSet {
    /// Looks at all files and puts them in order.
    ///
    /// # Errors
    /// [`FileError`] names the file and what it is; nothing is left out in silence.
    pub fn open(paths: &[PathBuf]) -> Result<Self, FileError> {
        refuse_repeats(paths)?;
        let mut members = Vec::with_capacity(paths.len());
        for path in paths {
            let mut member = Member::new(path)?;
            if paths.len() > 1 {
                member.rest();
            }
            members.push(member);
        }
        members.sort_by_key(Member::first_time); // stable: equal ones stay as given
        Ok(Self {
            members,
            active: Vec::new(),
            next_member: 0,
            current: None,
            assembler: Assembler::default(),
        })
    }

    /// The next datagram, valid until the next call; `None` at the end of all files.
    ///
    /// # Errors
    /// [`FileError::Capture`] where garbage stands in a file, [`FileError`] where one cannot be
    /// opened any more. Both are told once; the calls after it go on with the other files.
    // Not an Iterator: the datagram borrows from the set.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> Result<Option<Datagram<'_>>, FileError> {
        let found = loop {
            let Some(index) = self.select()? else {
                self.assembler.finish();
                return Ok(None);
            };
            let Some(record) = self.members[index].record() else {
                continue; // not reached: active members stand on a record
            };
            if let Some(found) = self.assembler.push(&record) {
                break found;
            }
        };
        Ok(self.datagram(&found))
    }

    fn datagram(&self, found: &Found) -> Option<Datagram<'_>> {
        let record = self
            .current
            .and_then(|index| self.members[index].record())?;
        Some(self.assembler.datagram(found, &record))
    }

    /// Steps on: the member that stands on the earliest record, or `None` at the end of all.
    fn select(&mut self) -> Result<Option<usize>, FileError> {
        self.step_current()?;
        let mut earliest = self.earliest();
        while self.is_due(earliest) {
            self.open_next()?;
            earliest = self.earliest();
        }
        self.current = earliest.map(|(index, _)| index);
        Ok(self.current)
    }

    /// Steps the member behind the record that was handed out last.
    fn step_current(&mut self) -> Result<(), FileError> {
        let Some(index) = self.current.take() else {
            return Ok(());
        };
        let step = self.members[index].advance();
        if !matches!(step, Ok(true)) {
            self.active.retain(|active| *active != index);
        }
        step.map(|_| ())
    }

    fn earliest(&self) -> Option<(usize, Timestamp)> {
        let time = |index: usize| {
            self.members[index]
                .record()
                .map_or(Timestamp(0), |r: Record| r.time)
        };
        let candidates = self.active.iter().map(|&index| (index, time(index)));
        candidates.min_by_key(|&(index, time)| (time, index))
    }

    /// Whether the next waiting file begins before or with the record that is next without it.
    fn is_due(&self, earliest: Option<(usize, Timestamp)>) -> bool {
        let Some(next) = self.members.get(self.next_member) else {
            return false;
        };
        earliest.is_none_or(|(_, time)| next.first_time() <= Some(time))
    }

    fn open_next(&mut self) -> Result<(), FileError> {
        let index = self.next_member;
        self.next_member += 1;
        if self.members[index].open()? {
            self.active.push(index);
        }
        Ok(())
    }

    /// What was left out so far in all files, by reason; see [`Assembler`].
    pub fn drops(&self) -> &Drops {
        self.assembler.drops()
    }

    /// What became of IP fragments so far.
    pub fn fragments(&self) -> FragmentFacts {
        self.assembler.fragments()
    }

    /// What was read of each file so far, in the order of their first records.
    pub fn facts(&self) -> Vec<FileFacts> {
        self.members.iter().map(Member::facts).collect()
    }

    /// The file that the last datagram came from; its record and offset count in that file.
    pub fn current_file(&self) -> Option<&Path> {
        self.current.map(|index| self.members[index].path())
    }

    /// Bytes of the files that were read, as they lie there; for progress.
    pub fn bytes_done(&self) -> u64 {
        self.members.iter().map(Member::bytes_done).sum()
    }

    /// Bytes of all files, as they lie there.
    pub fn bytes_total(&self) -> u64 {
        self.members.iter().map(Member::size).sum()
    }
}

fn refuse_repeats(paths: &[PathBuf]) -> Result<(), FileError> {
    if paths.is_empty() {
        return Err(FileError::NoneGiven);
    }
    let mut seen = HashSet::new();
    for path in paths {
        let canonical = path.canonicalize().unwrap_or_else(|_| path.clone());
        if !seen.insert(canonical) {
            return Err(FileError::Twice { path: path.clone() });
        }
    }
    Ok(())
}
