//! What is kept of the returns of a turn: all of it, or the columns that somebody reads.

use std::ops::Range;

use crate::cloud::PointCloud;
use crate::frame::Sensor;

/// Columns that returns are taken into.
pub trait Kept: Default + Send {
    /// No other columns than places, instants, azimuths and beams are taken: see [`Decoded::is_slim`].
    ///
    /// [`Decoded::is_slim`]: crate::packet::Decoded::is_slim
    const IS_SLIM: bool;

    /// Takes the returns at these places, which the cloud has.
    fn take(&mut self, from: &PointCloud<Sensor>, places: Range<usize>);

    /// How many were taken.
    fn count(&self) -> usize;

    /// Makes room for so many more.
    fn make_room(&mut self, additional: usize);

    /// Forgets them and keeps the memory.
    fn empty(&mut self);
}

impl Kept for PointCloud<Sensor> {
    const IS_SLIM: bool = false;

    fn take(&mut self, from: &PointCloud<Sensor>, places: Range<usize>) {
        self.extend(from, places);
    }

    fn count(&self) -> usize {
        self.len()
    }

    fn make_room(&mut self, additional: usize) {
        self.reserve(additional);
    }

    fn empty(&mut self) {
        self.clear();
    }
}
