//! What is kept of the returns of a turn: all of it, or the columns that somebody reads.

use std::ops::Range;

use crate::cloud::PointCloud;
use crate::frame::Sensor;

/// What is gathered of a turn.
pub trait Gathered: Default + Send {
    /// How much was gathered.
    fn count(&self) -> usize;

    /// Makes room for so much more.
    fn make_room(&mut self, additional: usize);

    /// Forgets it and keeps the memory.
    fn empty(&mut self);
}

/// Columns that returns are taken into.
pub trait Kept: Gathered {
    /// No other columns than places, instants, azimuths and beams are taken: see [`Decoded::is_slim`].
    ///
    /// [`Decoded::is_slim`]: crate::packet::Decoded::is_slim
    const IS_SLIM: bool;

    /// Takes the returns at these places, which the cloud has.
    fn take(&mut self, from: &PointCloud<Sensor>, places: Range<usize>);

    /// All columns, where nothing less is kept, for who can fill them itself.
    fn cloud(&mut self) -> Option<&mut PointCloud<Sensor>> {
        None
    }
}

impl Kept for PointCloud<Sensor> {
    const IS_SLIM: bool = false;

    fn take(&mut self, from: &PointCloud<Sensor>, places: Range<usize>) {
        self.extend(from, places);
    }

    fn cloud(&mut self) -> Option<&mut PointCloud<Sensor>> {
        Some(self)
    }
}

impl Gathered for PointCloud<Sensor> {
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
