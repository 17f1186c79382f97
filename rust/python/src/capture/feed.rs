//! Datagrams in blocks: the interpreter lock is free within a block; between blocks progress is told
//! and Ctrl-C comes through.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lidar_deflect_core::capture::{Datagram, DatagramBatch, FragmentFacts};
use lidar_deflect_core::drops::Drops;
use lidar_deflect_core::stream::{Scan, ScanOptions};
use lidar_deflect_files::{CaptureSet, FileError, FileFacts, tail};
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::error::BorderResult;

/// A block ends after so long, so that Ctrl-C is felt at once.
const BLOCK: Duration = Duration::from_millis(100);
/// The time is looked at after so many datagrams.
const STRIDE: u32 = 256;
/// Bytes of a batch: they stay in the cache of a core.
const BATCH_BYTES: usize = 1 << 19;

/// Whether the taker of datagrams wants another one in this block.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Want {
    /// Go on.
    More,
    /// There is something to hand over.
    Pause,
    /// Nothing that follows is of use.
    Stop,
}

/// The files of a capture, being read.
pub struct Feed {
    set: CaptureSet,
    has_ended: bool,
}

/// What was seen in the files.
#[derive(Clone)]
pub struct FilesReport {
    /// Facts of each file.
    pub files: Vec<FileFacts>,
    /// Records that gave no datagram, by reason.
    pub drops: Drops,
    /// IP fragments.
    pub fragments: FragmentFacts,
}

impl Feed {
    /// Opens all files.
    pub fn open(py: Python<'_>, paths: &[PathBuf]) -> BorderResult<Self> {
        let set = py.detach(|| CaptureSet::open(paths))?;
        Ok(Self {
            set,
            has_ended: false,
        })
    }

    /// Hands datagrams to `take` until the block ends; `false` when there are no more.
    pub fn block(
        &mut self,
        py: Python<'_>,
        progress: Option<&Py<PyAny>>,
        take: impl FnMut(&Datagram<'_>) -> Want + Send,
    ) -> BorderResult<bool> {
        if !self.has_ended {
            py.detach(|| self.run(take))?;
        }
        py.check_signals()?;
        if let Some(progress) = progress {
            progress.call1(py, (self.set.bytes_done(), self.set.bytes_total()))?;
        }
        Ok(!self.has_ended)
    }

    /// Reads the next datagrams into `room`, empty behind the last one, while `work` is done beside it.
    pub fn batch(
        &mut self,
        py: Python<'_>,
        pool: &ThreadPool,
        progress: Option<&Py<PyAny>>,
        room: &mut DatagramBatch,
        work: impl FnOnce() + Send,
    ) -> BorderResult<()> {
        room.clear();
        let fill = || match self.has_ended {
            true => Ok(()),
            false => self.run(|datagram| {
                room.push(datagram);
                if room.bytes() < BATCH_BYTES {
                    Want::More
                } else {
                    Want::Pause
                }
            }),
        };
        py.detach(|| pool.install(|| rayon::join(fill, work))).0?;
        py.check_signals()?;
        if let Some(progress) = progress {
            progress.call1(py, (self.set.bytes_done(), self.set.bytes_total()))?;
        }
        Ok(())
    }

    /// Reads no more.
    pub fn stop(&mut self) {
        self.has_ended = true;
    }

    fn run(&mut self, mut take: impl FnMut(&Datagram<'_>) -> Want) -> Result<(), FileError> {
        let start = Instant::now();
        for number in 1_u32.. {
            let Some(datagram) = self.set.next()? else {
                self.has_ended = true;
                break;
            };
            match take(&datagram) {
                Want::More if number % STRIDE == 0 && start.elapsed() > BLOCK => break,
                Want::More => {}
                Want::Pause => break,
                Want::Stop => {
                    self.has_ended = true;
                    break;
                }
            }
        }
        Ok(())
    }

    /// What was seen so far.
    pub fn report(&self) -> FilesReport {
        FilesReport {
            files: self.set.facts(),
            drops: self.set.drops().clone(),
            fragments: self.set.fragments(),
        }
    }
}

/// End of the last packet of each lidar in the last records of the files, by name.
pub fn ends(paths: &[PathBuf], options: &ScanOptions) -> Vec<(String, i64)> {
    let lidars = paths.iter().flat_map(|path| end_of(path, options));
    lidars.collect()
}

fn end_of(path: &Path, options: &ScanOptions) -> Vec<(String, i64)> {
    let mut scan = Scan::new(options.clone());
    if let Some(mut reader) = tail(path) {
        // Damage in the tail only shortens what can be told of it.
        while let Ok(Some(datagram)) = reader.next() {
            scan.push(&datagram);
        }
    }
    let lidars = scan.finish().lidars;
    lidars
        .iter()
        .map(|lidar| (lidar.key.to_string(), lidar.last.0))
        .collect()
}
