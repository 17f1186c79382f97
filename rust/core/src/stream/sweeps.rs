//! Sweeps of a capture in the order in which they complete, by the fastest way there is.

use super::abreast::Abreast;
use super::beside::Reading;
use super::reader::{Reader, SweepOptions};
use super::report::ScanReport;
use crate::capture::DatagramBatch;
use crate::error::ReadError;
use crate::sweep::{Kept, Sweep, SweepCutter};

/// A reading that gives sweeps.
pub trait Sweeps<K: Kept>: Reading {
    /// The next complete sweep that is decoded.
    fn pop(&mut self) -> Option<Sweep<K>>;

    /// Second returns so far that were merged into the first.
    fn merged(&self) -> u64;
}

/// Sweeps of the capture that `report` was made of: turn by turn on all threads, or packet by packet on one where what
/// a decoder makes of a packet depends on those before.
///
/// # Errors
/// As [`Reader::new`].
pub fn sweeps<K: Kept + 'static>(
    report: &ScanReport,
    options: &SweepOptions,
) -> Result<Box<dyn Sweeps<K>>, ReadError> {
    match Abreast::new(report, options)? {
        Some(abreast) => Ok(Box::new(abreast)),
        None => Ok(Box::new(Reader::<SweepCutter<K>>::new(report, options)?)),
    }
}

impl<K: Kept + 'static> Sweeps<K> for Abreast<K> {
    fn pop(&mut self) -> Option<Sweep<K>> {
        Abreast::pop(self)
    }

    fn merged(&self) -> u64 {
        Abreast::merged(self)
    }
}

impl<K: Kept> Sweeps<K> for Reader<SweepCutter<K>> {
    fn pop(&mut self) -> Option<Sweep<K>> {
        Reader::pop(self)
    }

    fn merged(&self) -> u64 {
        Reader::merged(self)
    }
}

impl<K: Kept> Reading for Reader<SweepCutter<K>> {
    fn push(&mut self, batch: &DatagramBatch) {
        batch
            .iter()
            .for_each(|datagram| Reader::push(self, &datagram));
    }

    fn is_done(&self) -> bool {
        Reader::is_done(self)
    }

    fn finish(&mut self) {
        Reader::finish(self);
    }
}

impl<K: Kept> Reading for Box<dyn Sweeps<K>> {
    fn push(&mut self, batch: &DatagramBatch) {
        (**self).push(batch);
    }

    fn is_done(&self) -> bool {
        (**self).is_done()
    }

    fn finish(&mut self) {
        (**self).finish();
    }
}
