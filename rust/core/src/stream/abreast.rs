//! Sweeps decoded turn by turn on as many threads as there are, also those of one lidar.
//!
//! Packets are put in order and told apart by turns one after another, which is little work. Those of a turn are then
//! decoded wherever a thread is free, while the next ones are read. A packet over a cut is decoded for both turns.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};

use super::beside::Reading;
use super::intake::{Intakes, Ready};
use super::reader::SweepOptions;
use super::report::{ScanReport, StreamInfo};
use super::undecoded::Undecoded;
use super::workshop::{Done, Workshop};
use crate::angle;
use crate::capture::DatagramBatch;
use crate::error::{ReadError, UnitError};
use crate::packet::Decoder;
use crate::sweep::{Kept, Sweep, SweepCutter};

/// Turns that may be on their way, for each thread.
const AHEAD: usize = 3;

/// Sweeps of all lidars, in the order in which they complete; the same to the bit as those of
/// [`super::SweepReader`], whatever the number of threads.
pub struct Abreast<K: Kept> {
    intakes: Intakes,
    lanes: Vec<Lane<K>>,
    /// Complete turns that nobody has begun with.
    turns: VecDeque<Sweep<Undecoded>>,
    coming: VecDeque<Receiver<Done<K>>>,
    ready: VecDeque<Done<K>>,
    merged: u64,
}

struct Lane<K> {
    number: usize,
    cutter: SweepCutter<Undecoded>,
    /// For the look at bearings.
    decoder: Box<dyn Decoder>,
    workshop: Arc<Workshop<K>>,
}

impl<K: Kept + 'static> Abreast<K> {
    /// Prepares for the capture that `report` was made of; `None` where turns cannot be decoded apart.
    ///
    /// # Errors
    /// As [`super::Reader::new`].
    pub fn new(report: &ScanReport, options: &SweepOptions) -> Result<Option<Self>, ReadError> {
        let intakes = Intakes::new(report, options)?;
        let lane = |number: usize| Lane::new(number, &report.lidars[number], options);
        let lanes = intakes.numbers().map(lane).collect::<Result<Vec<_>, _>>()?;
        let is_apart = lanes.iter().all(|lane| !lane.decoder.is_following());
        Ok(is_apart.then(|| Self {
            intakes,
            lanes,
            turns: VecDeque::new(),
            coming: VecDeque::new(),
            ready: VecDeque::new(),
            merged: 0,
        }))
    }

    /// The next complete sweep that is decoded.
    pub fn pop(&mut self) -> Option<Sweep<K>> {
        self.collect();
        let (sweep, merged) = self.ready.pop_front()?;
        self.merged += merged;
        Some(sweep)
    }

    /// Gives the memory of a sweep back for the next ones of its lidar.
    pub fn recycle(&mut self, lidar: usize, kept: K) {
        let mut lanes = self.lanes.iter();
        if let Some(lane) = lanes.find(|lane| lane.number == lidar) {
            lane.workshop.recycle(kept);
        }
    }

    /// Second returns that were merged into the first in the sweeps that were taken.
    pub fn merged(&self) -> u64 {
        self.merged
    }

    /// Begins with all complete turns, and lets no more than `most` be on their way.
    fn begin(&mut self, most: usize) {
        while let Some(turn) = self.turns.pop_front() {
            let mut lanes = self.lanes.iter_mut();
            if let Some(lane) = lanes.find(|lane| lane.number == turn.lidar) {
                self.coming.push_back(lane.begin(turn));
            }
        }
        while self.coming.len() > most {
            self.help();
            self.collect();
        }
    }

    /// Takes what is done, as far as it is next.
    fn collect(&mut self) {
        while let Some(Ok(done)) = self.coming.front().map(Receiver::try_recv) {
            self.coming.pop_front();
            self.ready.push_back(done);
        }
    }

    /// Decodes a turn itself, for this thread may be the only one, or waits for the next to be done.
    fn help(&mut self) {
        if rayon::yield_now() != Some(rayon::Yield::Executed)
            && let Some(next) = self.coming.pop_front()
        {
            self.ready.extend(next.recv());
        }
    }
}

impl<K: Kept + 'static> Reading for Abreast<K> {
    fn push(&mut self, batch: &DatagramBatch) {
        for datagram in batch.iter() {
            let (lanes, turns) = (&mut self.lanes, &mut self.turns);
            self.intakes
                .push(&datagram, |place, packet| lanes[place].take(packet, turns));
            self.begin(AHEAD * rayon::current_num_threads());
        }
    }

    fn is_done(&self) -> bool {
        self.intakes.is_done()
    }

    fn finish(&mut self) {
        for place in self.intakes.places() {
            let (lane, turns) = (&mut self.lanes[place], &mut self.turns);
            self.intakes
                .finish(place, |packet| lane.take(packet, turns));
            lane.cutter.finish(turns);
        }
        self.begin(0);
    }
}

impl<K: Kept + 'static> Lane<K> {
    fn new(number: usize, info: &StreamInfo, options: &SweepOptions) -> Result<Self, UnitError> {
        Ok(Self {
            number,
            cutter: SweepCutter::of(number, info.visible_rad(), options),
            decoder: info.model.fit(&info.unit)?.decoder,
            workshop: Arc::new(Workshop::new(info)),
        })
    }

    fn take(&mut self, packet: &Ready<'_>, turns: &mut VecDeque<Sweep<Undecoded>>) {
        if packet.is_early {
            return self.cutter.skip(&packet.placed);
        }
        let meets = |bearings: angle::Arc| self.decoder.may_meet(packet.payload, bearings);
        let is_wanted = self.cutter.is_wanted(&packet.placed, &meets);
        let mut is_counted = is_wanted;
        self.cutter.cut(&packet.placed, turns, |undecoded, part| {
            if is_wanted {
                undecoded.push(packet, part, std::mem::take(&mut is_counted));
            }
        });
    }

    fn begin(&mut self, turn: Sweep<Undecoded>) -> Receiver<Done<K>> {
        for undecoded in self.workshop.take_undecoded() {
            self.cutter.recycle(undecoded);
        }
        let workshop = Arc::clone(&self.workshop);
        let (sender, receiver) = sync_channel(1);
        // Nobody listens any more where a reading was given up.
        rayon::spawn(move || _ = sender.send(workshop.decode(turn)));
        receiver
    }
}
