//! The second pass over a capture: sweeps of all lidars, merged, in constant memory.

use std::collections::VecDeque;

use super::arrivals::{Arrival, Arrivals, Ordered, mark};
use super::report::{Pause, ScanReport, StreamInfo};
use super::{ScanOptions, StreamKey, packets};
use crate::angle::Arc;
use crate::capture::Datagram;
use crate::clock::ClockModel;
use crate::drops::Drops;
use crate::error::{InvalidValue, ReadError, UnitError};
use crate::loss::view::FieldOfView;
use crate::packet::split::Following;
use crate::packet::{Decoded, Decoder, ModelRef, PacketKind, Place};
use crate::sweep::{Kept, Placed, Sweep, SweepCutter};
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
    options: ScanOptions,
    lanes: Vec<Lane<S>>, // few: looked through for every datagram
    pub(super) out: S::Out,
    decoded: Decoded,
    limits: Limits,
    pauses: Vec<Pause>,
}

#[derive(Clone, Copy)]
struct Limits {
    start: Option<Timestamp>,
    stop: Option<Timestamp>,
}

struct Lane<S> {
    key: StreamKey,
    number: usize,
    model: ModelRef,
    is_named: bool,
    arrivals: Arrivals<Vec<u8>>,
    decoder: Box<dyn Decoder>,
    clock: ClockModel,
    view: FieldOfView,
    sink: S,
    spare: Vec<Vec<u8>>,
    /// A packet whose last firing may go on in the next one.
    held: Option<(Ordered, Vec<u8>)>,
    is_done: bool,
}

impl<S: Sink> Reader<S> {
    /// Prepares for the capture that `report` was made of.
    ///
    /// # Errors
    /// [`ReadError`] for a lidar that the report does not have, or one that cannot be decoded with what
    /// is known of its unit.
    pub fn new(report: &ScanReport, options: &SweepOptions) -> Result<Self, ReadError> {
        let all: Vec<usize> = (0..report.lidars.len()).collect();
        let mut lanes: Vec<Lane<S>> = Vec::new();
        for number in options.lidars.as_ref().unwrap_or(&all) {
            let info = report.lidars.get(*number).ok_or_else(|| InvalidValue {
                name: "lidar",
                expected: format!("a number below {}", report.lidars.len()),
                found: number.to_string(),
            })?;
            if lanes.iter().all(|lane| lane.number != *number) {
                lanes.push(Lane::new(*number, info, options)?);
            }
        }
        Ok(Self {
            options: report.options.clone(),
            lanes,
            out: S::Out::default(),
            decoded: Decoded {
                is_slim: S::IS_SLIM,
                ..Decoded::default()
            },
            limits: Limits {
                start: options.start,
                stop: options.stop,
            },
            pauses: report.pauses.clone(),
        })
    }

    /// Takes the next datagram.
    pub fn push(&mut self, datagram: &Datagram<'_>) {
        let key = self.options.key(datagram);
        let Some(lane) = self.lanes.iter_mut().find(|lane| lane.key == key) else {
            return;
        };
        let mut step = Step {
            decoded: &mut self.decoded,
            out: &mut self.out,
            limits: self.limits,
            pauses: &self.pauses,
        };
        for packet in packets(datagram) {
            if !lane.is_done && lane.is_data(packet.payload) {
                lane.push(&packet, &mut step);
            }
        }
    }

    /// Whether all lidars have passed the end that was asked for, so that reading on is no use.
    pub fn is_done(&self) -> bool {
        self.lanes.iter().all(|lane| lane.is_done)
    }

    /// The capture has ended: what waits and the sweeps that are not complete come out.
    pub fn finish(&mut self) {
        let mut step = Step {
            decoded: &mut self.decoded,
            out: &mut self.out,
            limits: self.limits,
            pauses: &self.pauses,
        };
        let mut lanes: Vec<&mut Lane<S>> = self.lanes.iter_mut().collect();
        lanes.sort_by_key(|lane| lane.number);
        for lane in lanes {
            lane.finish(&mut step);
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

/// What a lane borrows of the reader.
struct Step<'a, Out> {
    decoded: &'a mut Decoded,
    out: &'a mut Out,
    limits: Limits,
    pauses: &'a [Pause],
}

impl<S: Sink> Lane<S> {
    fn new(number: usize, info: &StreamInfo, options: &SweepOptions) -> Result<Self, UnitError> {
        let visible_rad = std::f64::consts::TAU - info.view.blind_rad();
        Ok(Self {
            key: info.key,
            number,
            model: info.model,
            is_named: info.is_named,
            arrivals: Arrivals::new(info.model),
            decoder: info.model.fit(&info.unit)?.decoder,
            clock: info.clock.clone(),
            view: info.view.clone(),
            sink: S::new(number, visible_rad, options),
            spare: Vec::new(),
            held: None,
            is_done: false,
        })
    }

    fn is_data(&self, payload: &[u8]) -> bool {
        if self.is_named {
            self.model.fits(payload)
        } else {
            self.model.recognise(payload) == Some(PacketKind::Data)
        }
    }

    fn push(&mut self, datagram: &Datagram<'_>, step: &mut Step<'_, S::Out>) {
        let payload = datagram.payload;
        let Some(head) = self.model.head(payload) else {
            return;
        };
        let spare = &mut self.spare;
        let keep = || {
            let mut copy = spare.pop().unwrap_or_default();
            copy.clear();
            copy.extend_from_slice(payload);
            copy
        };
        let (_, what) = self
            .arrivals
            .offer(datagram.time, &head, mark(payload), keep);
        if let Arrival::Next(ordered) = what {
            self.take(&ordered, payload, step);
        }
        self.drain(step);
    }

    fn drain(&mut self, step: &mut Step<'_, S::Out>) {
        while let Some((ordered, payload)) = self.arrivals.pop() {
            self.take(&ordered, &payload, step);
            self.spare.push(payload);
        }
    }

    fn take(&mut self, ordered: &Ordered, payload: &[u8], step: &mut Step<'_, S::Out>) {
        if !self.model.is_splitting() {
            return self.read(ordered, payload, None, step);
        }
        let mut copy = self.spare.pop().unwrap_or_default();
        copy.clear();
        copy.extend_from_slice(payload);
        if let Some((before, earlier)) = self.held.replace((*ordered, copy)) {
            let packet = ordered.ticket.packet;
            let following = ordered.follows().then_some(Following { payload, packet });
            self.read(&before, &earlier, following, step);
            self.spare.push(earlier);
        }
    }

    fn read(
        &mut self,
        ordered: &Ordered,
        payload: &[u8],
        following: Option<Following<'_>>,
        step: &mut Step<'_, S::Out>,
    ) {
        let ticket = &ordered.ticket;
        let time = self.clock.utc(ordered.segment, ticket.device);
        if self.is_done || step.limits.stop.is_some_and(|stop| time >= stop) {
            // The clock only goes back at a jump; a packet behind it would be of another time.
            self.is_done = true;
            return;
        }
        let gap = ordered.gap.as_ref();
        let placed = Placed {
            time,
            head: ticket.head,
            frame_id: self.model.frame_id(payload),
            lost: gap.map_or(0, |gap| gap.lost_in(&self.view, step.pauses)),
            is_jump: ordered.is_jump,
        };
        if step.limits.start.is_some_and(|start| time < start) {
            return self.sink.skip(&placed);
        }
        step.decoded.clear();
        let place = Place {
            time,
            packet: ticket.packet,
            mean_rate_rad_per_ns: ticket.mean_rate_rad_per_ns,
        };
        let meets = |bearings: Arc| self.decoder.may_meet(payload, bearings);
        if self.sink.wants(&placed, &meets) {
            self.decoder
                .decode_before(payload, following, place, step.decoded);
        }
        self.sink.push(&placed, step.decoded, step.out);
    }

    fn finish(&mut self, step: &mut Step<'_, S::Out>) {
        self.arrivals.flush();
        self.drain(step);
        if let Some((last, payload)) = self.held.take() {
            self.read(&last, &payload, None, step);
        }
        self.sink.finish(step.out);
    }
}

impl<K: Kept> Reader<SweepCutter<K>> {
    /// The next complete sweep.
    pub fn pop(&mut self) -> Option<Sweep<K>> {
        self.out.pop_front()
    }

    /// Whether [`Reader::pop`] would give a sweep.
    pub fn has_ready(&self) -> bool {
        !self.out.is_empty()
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

impl<K: Kept> Sink for SweepCutter<K> {
    type Out = VecDeque<Sweep<K>>;

    const IS_SLIM: bool = K::IS_SLIM;

    fn new(lidar: usize, visible_rad: f64, options: &SweepOptions) -> Self {
        let every = options.every.get(lidar).copied().unwrap_or(1);
        let bearings = options.bearings.get(lidar).copied().flatten();
        SweepCutter::new(lidar, options.cut_rad(lidar), visible_rad, every).within(bearings)
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
