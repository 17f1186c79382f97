//! The second pass over a capture: sweeps of all lidars, merged, in constant memory.

use std::collections::VecDeque;

use super::intake::{Intakes, Ready};
use super::report::{ScanReport, StreamInfo};
use crate::angle::Arc;
use crate::capture::Datagram;
use crate::drops::Drops;
use crate::error::{ReadError, UnitError};
use crate::packet::{Decoded, Decoder};
use crate::sweep::{Gathered, Kept, Placed, Sweep, SweepCutter};
use crate::time::Timestamp;

/// Which sweeps to make.
#[derive(Debug, Clone, Default)]
pub struct SweepOptions {
    /// Numbers of the lidars in the report; `None`: all.
    pub lidars: Option<Vec<usize>>,
    /// Azimuths at which sweeps are cut, by number of the lidar; 0 where there is none.
    pub cut_azimuth_rad: Vec<f64>,
    /// Bearings in the sensor frame, by number of the lidar: returns outside may be left out, for speed.
    pub bearings: Vec<Option<Arc>>,
    /// One turn in so many is wanted, by number of the lidar, and 1 where there is none: sweeps come of those whose
    /// number is a multiple of it, and what others alone hold is not decoded.
    pub every: Vec<u32>,
    /// Packets before this are left out.
    pub start: Option<Timestamp>,
    /// Packets from this on are left out.
    pub stop: Option<Timestamp>,
    /// What else is wanted of the same packets: its cuts, bearings and turns, for [`super::Both`].
    pub beside: Option<Box<SweepOptions>>,
}

impl SweepOptions {
    /// Whole sweeps of some lidars, each cut at its own azimuth.
    pub fn of(lidars: &[usize], cuts_rad: &[f64]) -> Self {
        let mut by_number = vec![0.0; lidars.iter().max().map_or(0, |last| last + 1)];
        for (number, cut_rad) in lidars.iter().zip(cuts_rad) {
            by_number[*number] = *cut_rad;
        }
        Self {
            lidars: Some(lidars.to_vec()),
            cut_azimuth_rad: by_number,
            ..Self::default()
        }
    }

    /// The same where of each lidar one turn in so many is wanted.
    pub fn one_in(mut self, every: u32) -> Self {
        self.every = vec![every; self.cut_azimuth_rad.len()];
        self
    }

    /// The same where other sweeps of the same packets are wanted beside them.
    pub fn beside(mut self, other: Self) -> Self {
        self.beside = Some(Box::new(other));
        self
    }

    /// Azimuth at which the sweeps of a lidar are cut.
    pub fn cut_rad(&self, lidar: usize) -> f64 {
        self.cut_azimuth_rad.get(lidar).copied().unwrap_or(0.0)
    }

    /// The same where of each of these lidars only returns within its bearings are wanted.
    pub fn towards(
        mut self,
        lidars: &[usize],
        bearings: impl Iterator<Item = Option<Arc>>,
    ) -> Self {
        self.bearings = vec![None; lidars.iter().max().map_or(0, |last| last + 1)];
        for (number, bearings) in lidars.iter().zip(bearings) {
            self.bearings[*number] = bearings;
        }
        self
    }
}

/// Takes the returns of one lidar in order and makes something of them.
pub trait Sink {
    /// Where all lidars' results are gathered.
    type Out: Default;

    /// Whether it looks at no more than [`Decoded::is_slim`] says.
    const IS_SLIM: bool = false;

    /// For the lidar with this number; `visible_rad` is the angle of the turn that it sends.
    fn new(lidar: usize, visible_rad: f64, options: &SweepOptions) -> Self;

    /// Whether a packet may have returns that are wanted; `meets` tells whether it may have some within bearings.
    fn wants(&mut self, _packet: &Placed, _meets: &dyn Fn(Arc) -> bool) -> bool {
        true
    }

    /// A packet whose returns are not wanted.
    fn skip(&mut self, packet: &Placed);

    /// A packet and its returns.
    fn push(&mut self, packet: &Placed, decoded: &Decoded, out: &mut Self::Out);

    /// The stream has ended.
    fn finish(&mut self, out: &mut Self::Out);
}

/// Turns datagrams into sweeps.
pub type SweepReader = Reader<SweepCutter>;

/// Decodes the datagrams of a capture that was scanned; what becomes of the returns is up to `S`.
pub struct Reader<S: Sink> {
    intakes: Intakes,
    lanes: Vec<Lane<S>>,
    pub(super) out: S::Out,
    decoded: Decoded,
}

struct Lane<S> {
    number: usize,
    decoder: Box<dyn Decoder>,
    sink: S,
}

impl<S: Sink> Reader<S> {
    /// Prepares for the capture that `report` was made of.
    ///
    /// # Errors
    /// [`ReadError`] for a lidar that the report does not have, or one that cannot be decoded with what
    /// is known of its unit.
    pub fn new(report: &ScanReport, options: &SweepOptions) -> Result<Self, ReadError> {
        let intakes = Intakes::new(report, options)?;
        let lane = |number: usize| Lane::new(number, &report.lidars[number], options);
        Ok(Self {
            lanes: intakes.numbers().map(lane).collect::<Result<_, _>>()?,
            intakes,
            out: S::Out::default(),
            decoded: Decoded::with_columns(S::IS_SLIM),
        })
    }

    /// Takes the next datagram.
    pub fn push(&mut self, datagram: &Datagram<'_>) {
        let (decoded, out) = (&mut self.decoded, &mut self.out);
        self.intakes.push(datagram, |place, packet| {
            self.lanes[place].read(packet, decoded, out);
        });
    }

    /// Whether all lidars have passed the end that was asked for, so that reading on is no use.
    pub fn is_done(&self) -> bool {
        self.intakes.is_done()
    }

    /// The capture has ended: what waits and the sweeps that are not complete come out.
    pub fn finish(&mut self) {
        for place in self.intakes.places() {
            let lane = &mut self.lanes[place];
            let (decoded, out) = (&mut self.decoded, &mut self.out);
            self.intakes
                .finish(place, |packet| lane.read(packet, decoded, out));
            lane.sink.finish(out);
        }
    }

    /// Second returns that were merged into the first so far.
    pub fn merged(&self) -> u64 {
        self.decoded.merged
    }

    /// Blocks that were left out so far, by reason.
    pub fn drops(&self) -> &Drops {
        &self.decoded.drops
    }
}

impl<S: Sink> Lane<S> {
    fn new(number: usize, info: &StreamInfo, options: &SweepOptions) -> Result<Self, UnitError> {
        Ok(Self {
            number,
            decoder: info.model.fit(&info.unit)?.decoder,
            sink: S::new(number, info.visible_rad(), options),
        })
    }

    fn read(&mut self, packet: &Ready<'_>, decoded: &mut Decoded, out: &mut S::Out) {
        if packet.is_early {
            return self.sink.skip(&packet.placed);
        }
        decoded.clear();
        let meets = |bearings: Arc| self.decoder.may_meet(packet.payload, bearings);
        if self.sink.wants(&packet.placed, &meets) {
            packet.decode(&mut *self.decoder, decoded);
        }
        self.sink.push(&packet.placed, decoded, out);
    }
}

impl<K: Kept> Reader<SweepCutter<K>> {
    /// The next complete sweep.
    pub fn pop(&mut self) -> Option<Sweep<K>> {
        self.out.pop_front()
    }

    /// Gives the memory of a sweep back for the next ones of its lidar.
    pub fn recycle(&mut self, lidar: usize, kept: K) {
        if let Some(sink) = self.sink_of(lidar) {
            sink.recycle(kept);
        }
    }
}

impl<S: Sink> Reader<S> {
    /// What takes the returns of a lidar.
    pub(super) fn sink_of(&mut self, lidar: usize) -> Option<&mut S> {
        let mut lanes = self.lanes.iter_mut();
        let own = lanes.find(|lane| lane.number == lidar);
        own.map(|lane| &mut lane.sink)
    }
}

impl<K: Gathered> SweepCutter<K> {
    /// Cuts the turns of a lidar that sends `visible_rad` of each as `options` ask for.
    pub(super) fn of(lidar: usize, visible_rad: f64, options: &SweepOptions) -> Self {
        let every = options.every.get(lidar).copied().unwrap_or(1);
        let bearings = options.bearings.get(lidar).copied().flatten();
        Self::new(lidar, options.cut_rad(lidar), visible_rad, every).within(bearings)
    }
}

impl<K: Kept> Sink for SweepCutter<K> {
    type Out = VecDeque<Sweep<K>>;

    const IS_SLIM: bool = K::IS_SLIM;

    fn new(lidar: usize, visible_rad: f64, options: &SweepOptions) -> Self {
        Self::of(lidar, visible_rad, options)
    }

    fn wants(&mut self, packet: &Placed, meets: &dyn Fn(Arc) -> bool) -> bool {
        SweepCutter::is_wanted(self, packet, meets)
    }

    fn skip(&mut self, packet: &Placed) {
        SweepCutter::skip(self, packet);
    }

    fn push(&mut self, packet: &Placed, decoded: &Decoded, out: &mut Self::Out) {
        SweepCutter::push(self, packet, decoded, out);
    }

    fn finish(&mut self, out: &mut Self::Out) {
        SweepCutter::finish(self, out);
    }
}
