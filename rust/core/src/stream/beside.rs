//! Sweeps of several lidars in one reading, each lidar's packets on a thread of their own.

use rayon::prelude::*;

use super::reader::{Reader, Sink};
use super::{ScanReport, SweepOptions};
use crate::capture::DatagramBatch;
use crate::error::ReadError;
use crate::sweep::{Kept, Sweep, SweepCutter};

/// What becomes of one lidar's sweeps.
pub trait Taker: Send {
    /// The columns that it looks at.
    type Kept: Kept;

    /// Takes the next sweep, in order of time.
    fn take(&mut self, sweep: &Sweep<Self::Kept>);
}

/// What becomes of all that a reader of one lidar gives.
pub trait Taking: Send {
    /// What it is that the reader gives.
    type Sink: Sink<Out: Send> + Send;

    /// Takes what is ready.
    fn take_from(&mut self, reader: &mut Reader<Self::Sink>);
}

impl<T: Taker> Taking for T {
    type Sink = SweepCutter<T::Kept>;

    fn take_from(&mut self, reader: &mut Reader<Self::Sink>) {
        while let Some(sweep) = reader.pop() {
            self.take(&sweep);
            reader.recycle(sweep.lidar, sweep.cloud);
        }
    }
}

/// What batches of datagrams are read into.
pub trait Reading: Send {
    /// Takes the next datagrams.
    fn push(&mut self, batch: &DatagramBatch);

    /// Whether nothing that follows is of use.
    fn is_done(&self) -> bool;

    /// The capture has ended: what is not complete comes out.
    fn finish(&mut self);
}

/// Lidars side by side, each with its taker; what they take does not depend on the number of threads.
pub struct Beside<T: Taking> {
    lanes: Vec<Lane<T>>,
}

struct Lane<T: Taking> {
    reader: Reader<T::Sink>,
    taker: T,
}

impl<T: Taking> Beside<T> {
    /// Prepares for the capture that `report` was made of: options and taker of each lidar.
    ///
    /// # Errors
    /// [`ReadError`] where a lidar cannot be decoded.
    pub fn new(
        report: &ScanReport,
        lidars: impl IntoIterator<Item = (SweepOptions, T)>,
    ) -> Result<Self, ReadError> {
        let lane = |(options, taker): (SweepOptions, T)| {
            let reader = Reader::new(report, &options)?;
            Ok(Lane { reader, taker })
        };
        let lanes = lidars.into_iter().map(lane);
        Ok(Self {
            lanes: lanes.collect::<Result<_, ReadError>>()?,
        })
    }

    /// The takers, in the order in which they were given.
    pub fn takers(&mut self) -> impl Iterator<Item = &mut T> {
        self.lanes.iter_mut().map(|lane| &mut lane.taker)
    }

    /// The takers with all that they took.
    pub fn into_takers(self) -> impl Iterator<Item = T> {
        self.lanes.into_iter().map(|lane| lane.taker)
    }
}

impl<T: Taking> Reading for Beside<T> {
    fn push(&mut self, batch: &DatagramBatch) {
        self.lanes.par_iter_mut().for_each(|lane| {
            for datagram in batch.iter() {
                lane.reader.push(&datagram);
                lane.taker.take_from(&mut lane.reader);
            }
        });
    }

    fn is_done(&self) -> bool {
        self.lanes.iter().all(|lane| lane.reader.is_done())
    }

    fn finish(&mut self) {
        self.lanes.par_iter_mut().for_each(|lane| {
            lane.reader.finish();
            lane.taker.take_from(&mut lane.reader);
        });
    }
}
