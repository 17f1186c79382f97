//! Cuts a stream of returns into sweeps, one per turn: a state machine without input or output.

mod kept;
mod turns;

use std::collections::VecDeque;
use std::f64::consts::TAU;

use crate::angle::Arc;
use crate::cloud::PointCloud;
use crate::frame::Sensor;
use crate::packet::part::Part;
use crate::packet::{Decoded, Head};
use crate::time::Timestamp;
pub use kept::{Gathered, Kept};
pub use turns::Turns;

/// One turn of one lidar.
#[derive(Debug, Clone)]
pub struct Sweep<K = PointCloud<Sensor>> {
    /// Number of the lidar among those of the capture.
    pub lidar: usize,
    /// Number of the turn since the lidar's first packet; turns of which nothing arrived are counted too.
    pub index: u32,
    /// Returns in the order of the shots.
    pub cloud: K,
    /// When the rotor passed the cut, or the first packet began.
    pub start: Timestamp,
    /// When the rotor passed the cut again, or the last packet ended.
    pub end: Timestamp,
    /// Share of the turn whose packets arrived; of what the sensor sends where its view is limited.
    pub coverage: f32,
    /// Packets that began in it.
    pub packets: u32,
    /// Packets of it that were lost.
    pub lost: u32,
    /// Stretches of time from which packets are lost.
    pub gaps: Vec<Gap>,
}

/// A stretch of time from which packets are lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// When the first lost packet began.
    pub from: Timestamp,
    /// When the next packet that arrived began.
    pub to: Timestamp,
}

impl<K> Sweep<K> {
    /// The same turn with something else in the place of its returns, and what was there.
    pub fn exchanged<L>(self, cloud: L) -> (Sweep<L>, K) {
        let sweep = Sweep {
            lidar: self.lidar,
            index: self.index,
            cloud,
            start: self.start,
            end: self.end,
            coverage: self.coverage,
            packets: self.packets,
            lost: self.lost,
            gaps: self.gaps,
        };
        (sweep, self.cloud)
    }
}

/// One packet in its place, for the cutter.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// UTC of its first shot.
    pub time: Timestamp,
    /// Its times and angles.
    pub head: Head,
    /// Frame that it belongs to, where the sensor counts them.
    pub frame_id: Option<u32>,
    /// Packets that are missing before it.
    pub lost: u64,
    /// The clock jumped before it: nothing is known of how far the rotor turned.
    pub is_jump: bool,
}

/// Cuts at one azimuth.
#[derive(Debug)]
pub struct SweepCutter<K = PointCloud<Sensor>> {
    lidar: usize,
    turns: Turns,
    visible_rad: f64,
    every: u32,
    bearings: Option<Arc>,
    open: Option<Open<K>>,
    spare: Vec<K>,
    usual: usize, // echoes of the last sweep: as much room is made for the next
}

/// The sweep that is being filled.
#[derive(Debug)]
struct Open<K> {
    turn: u32,
    cloud: K,
    start: Timestamp,
    seen_rad: f64,
    packets: u32,
    lost: u32,
    gaps: Vec<Gap>,
}

impl<K: Gathered> SweepCutter<K> {
    /// Cuts at encoder azimuth `cut_rad`; `visible_rad` is the angle of the turn that the sensor sends.
    /// Turns come out whose number is a multiple of `every`.
    pub fn new(lidar: usize, cut_rad: f64, visible_rad: f64, every: u32) -> Self {
        Self {
            lidar,
            turns: Turns::new(cut_rad),
            visible_rad: visible_rad.clamp(1e-3, TAU),
            every: every.max(1),
            bearings: None,
            open: None,
            spare: Vec::new(),
            usual: 0,
        }
    }

    /// Number of the lidar.
    pub fn lidar(&self) -> usize {
        self.lidar
    }

    /// The same where only returns within these bearings are wanted.
    pub fn within(mut self, bearings: Option<Arc>) -> Self {
        self.bearings = bearings;
        self
    }

    /// Whether a packet may have returns that are wanted; `meets` tells whether it may have some within bearings.
    pub fn is_wanted(&self, packet: &Placed, meets: &dyn Fn(Arc) -> bool) -> bool {
        self.is_in_turn(packet) && self.bearings.is_none_or(meets)
    }

    /// Whether a packet may have returns of a turn that comes out.
    pub fn is_in_turn(&self, packet: &Placed) -> bool {
        if self.every == 1 {
            return true;
        }
        let start_rad = self.turns.place(packet);
        let end_rad = start_rad + packet.head.turned_rad.max(0.0);
        // Jitter of the encoder may begin a packet before the turn that it is added to.
        let open = self.open.as_ref().map_or(0, |open| open.turn);
        let last = Turns::turn_of(end_rad).max(open);
        (Turns::turn_of(start_rad)..=last).any(|turn| turn.is_multiple_of(self.every))
    }

    /// Follows the rotor over a packet whose returns are not wanted.
    pub fn skip(&mut self, packet: &Placed) {
        self.turns.follow(packet, self.turns.place(packet));
    }

    /// Gives the memory of a sweep back for the next ones.
    pub fn recycle(&mut self, mut cloud: K) {
        cloud.empty();
        self.spare.push(cloud);
    }

    /// Adds one packet: `put` adds each of its parts to the turn that it belongs to, but for turns that nobody
    /// wants; finished sweeps are appended to `out`.
    pub fn cut(
        &mut self,
        packet: &Placed,
        out: &mut VecDeque<Sweep<K>>,
        put: impl FnMut(&mut K, Part),
    ) {
        let start_rad = self.turns.place(packet);
        let end_rad = start_rad + packet.head.turned_rad.max(0.0);
        let lost_behind_cut = self.add_lost(packet, start_rad);
        let first_turn = Turns::turn_of(start_rad);
        let gap = self.turns.end().filter(|_| packet.lost > 0);
        let gap = gap.map(|end| Gap {
            from: end.time,
            to: packet.time,
        });
        if self.open.as_ref().is_none_or(|open| open.turn < first_turn) {
            // A gap over the cut belongs to the sweeps on both sides.
            self.add_gap(gap);
            let end = self.turns.end().map_or(packet.time, |end| end.time);
            self.close(end, out);
            self.open(first_turn, packet.time);
        }
        self.add_gap(gap);
        if let Some(open) = &mut self.open {
            open.packets += 1;
            open.lost = open.lost.saturating_add(lost_behind_cut);
        }
        self.fill(packet, [start_rad, end_rad], out, put);
        self.turns.follow(packet, start_rad);
    }

    /// Adds one packet and its returns.
    pub fn push(&mut self, packet: &Placed, decoded: &Decoded, out: &mut VecDeque<Sweep<K>>)
    where
        K: Kept,
    {
        self.cut(packet, out, |kept, part| {
            kept.take(&decoded.cloud, decoded.places(&packet.head, part));
        });
    }

    /// The sweep that is not complete yet, at the end of the stream.
    pub fn finish(&mut self, out: &mut VecDeque<Sweep<K>>) {
        if let Some(end) = self.turns.end() {
            self.close(end.time, out);
        }
    }

    /// Counts missing packets before the cut to the open sweep; gives those of the turn that the
    /// packet begins in. Turns of which nothing arrived keep theirs.
    fn add_lost(&mut self, packet: &Placed, start_rad: f64) -> u32 {
        if packet.lost == 0 {
            return 0;
        }
        let (Some(open), Some(end)) = (&mut self.open, self.turns.end()) else {
            return 0;
        };
        let gap_rad = (start_rad - end.turned_rad).max(1e-9);
        let until = |turn: u32| {
            let share = (f64::from(turn) * TAU - end.turned_rad) / gap_rad;
            (packet.lost as f64 * share.clamp(0.0, 1.0)).round() as u32
        };
        let here = until(open.turn.saturating_add(1));
        open.lost = open.lost.saturating_add(here);
        let whole = until(Turns::turn_of(start_rad)).max(here);
        u32::try_from(packet.lost)
            .unwrap_or(u32::MAX)
            .saturating_sub(whole)
    }

    fn add_gap(&mut self, gap: Option<Gap>) {
        if let Some(open) = &mut self.open {
            open.gaps.extend(gap);
        }
    }

    fn open(&mut self, turn: u32, start: Timestamp) {
        let mut cloud = self.spare.pop().unwrap_or_default();
        cloud.make_room(self.usual + self.usual / 16);
        self.open = Some(Open {
            turn,
            cloud,
            start,
            seen_rad: 0.0,
            packets: 0,
            lost: 0,
            gaps: Vec::new(),
        });
    }

    fn close(&mut self, end: Timestamp, out: &mut VecDeque<Sweep<K>>) {
        let Some(open) = self.open.take() else { return };
        if !open.turn.is_multiple_of(self.every) {
            return self.recycle(open.cloud);
        }
        self.usual = open.cloud.count();
        out.push_back(Sweep {
            lidar: self.lidar,
            index: open.turn,
            cloud: open.cloud,
            start: open.start,
            end,
            coverage: (open.seen_rad / self.visible_rad).min(1.0) as f32,
            packets: open.packets,
            lost: open.lost,
            gaps: open.gaps,
        });
    }

    /// Adds the packet's parts, cutting where it passes the cut.
    fn fill(
        &mut self,
        packet: &Placed,
        [start_rad, end_rad]: [f64; 2],
        out: &mut VecDeque<Sweep<K>>,
        mut put: impl FnMut(&mut K, Part),
    ) {
        let mut since_rad = None;
        while let Some(open) = &mut self.open {
            let cut_rad = Turns::cut_after(open.turn);
            let until_rad = (end_rad >= cut_rad).then_some(cut_rad - start_rad);
            if open.turn.is_multiple_of(self.every) {
                let part = Part {
                    since_rad,
                    until_rad,
                };
                put(&mut open.cloud, part);
            }
            open.seen_rad += packet.head.seen_rad(
                since_rad.unwrap_or(0.0),
                until_rad.unwrap_or(end_rad - start_rad),
            );
            let Some(turned_rad) = until_rad else { break };
            let time = packet.head.time_at(packet.time, turned_rad);
            let turn = open.turn + 1;
            self.close(time, out);
            self.open(turn, time);
            since_rad = until_rad;
        }
    }
}
