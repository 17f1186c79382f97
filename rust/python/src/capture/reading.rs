//! A capture on its way through a reading: batch by batch, the next one read meanwhile.

use std::path::PathBuf;

use lidar_deflect_core::capture::DatagramBatch;
use lidar_deflect_core::stream::Reading;
use pyo3::prelude::*;
use rayon::ThreadPool;

use super::feed::Feed;
use crate::compute::pool_of;
use crate::error::BorderResult;

/// Files of a capture and what they are read into.
pub struct ReadingFeed<R> {
    feed: Feed,
    /// What the files are read into.
    pub reading: R,
    /// What is looked at, and what is read meanwhile.
    batch: DatagramBatch,
    ahead: DatagramBatch,
    /// Begun with the first batch.
    pool: Option<ThreadPool>,
    has_ended: bool,
}

impl<R: Reading> ReadingFeed<R> {
    /// Opens the files.
    pub fn open(py: Python<'_>, paths: &[PathBuf], reading: R) -> BorderResult<Self> {
        Ok(Self {
            feed: Feed::open(py, paths)?,
            reading,
            batch: DatagramBatch::default(),
            ahead: DatagramBatch::default(),
            pool: None,
            has_ended: false,
        })
    }

    /// Whether all was read.
    pub fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// Takes the next batch.
    pub fn read_on(
        &mut self,
        py: Python<'_>,
        threads: Option<usize>,
        progress: Option<&Py<PyAny>>,
    ) -> BorderResult<()> {
        let Self {
            feed,
            reading,
            batch,
            ahead,
            pool,
            ..
        } = self;
        let own = match pool.take() {
            Some(own) => own,
            None => pool_of(threads)?,
        };
        let own = pool.insert(own);
        let read = feed.batch(py, own, progress, ahead, || reading.push(batch));
        // Also where Ctrl-C came: who goes on all the same misses nothing.
        std::mem::swap(batch, ahead);
        read?;
        let is_done = reading.is_done();
        if is_done {
            feed.stop();
        }
        if batch.is_empty() || is_done {
            py.detach(|| own.install(|| reading.finish()));
            self.has_ended = true;
        }
        Ok(())
    }
}
