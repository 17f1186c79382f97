//! What a scan sums up of one lidar: counts, seconds, clock and field of view.

use std::f64::consts::PI;

use super::arrivals::{Arrival, Arrivals, Gap, Ordered, Ticket, mark};
use super::probe::Choice;
use super::report::{Pause, PositionFacts, Second, StreamInfo};
use super::{StreamKey, is_data};
use crate::angle::wrap_turn;
use crate::clock::ClockEstimator;
use crate::drops::Drops;
use crate::loss::Counts;
use crate::loss::view::FieldOfView;
use crate::packet::split::Split;
use crate::packet::unit::{Calibration, Gather, UnitFile};
use crate::packet::{ModelRef, Tally};
use crate::time::{NANOS_PER_SECOND, TimePair, Timestamp};

/// Gaps wait for the field of view to be known, but not more of them than this.
const MAX_PENDING: usize = 4096;
/// Turns after which the field of view is known.
const VIEW_TURNS: u32 = 5;
/// Packets within so many durations of each other tell the speed of the rotor.
const NEIGHBOUR: i64 = 4;
/// More packets than one sensor can send by this factor come from two.
const CROWDED: f64 = 1.3;

/// What all lidars of a capture have in common.
#[derive(Debug, Default)]
pub struct Shared {
    /// UTC of the first lidar packet as far as it can be told: where seconds are counted from.
    pub origin: Option<Timestamp>,
    pub pauses: Vec<Pause>,
}

/// What is kept of a packet until its turn has come.
#[derive(Debug, Clone, Default)]
struct Seen {
    tally: Tally,
    split: Split,
}

/// One lidar's stream on its way through the scan.
#[derive(Debug)]
pub struct Lidar {
    model: ModelRef,
    is_named: bool,
    candidates: Vec<&'static str>,
    left_out: Vec<&'static str>,
    doubt: Option<String>,
    is_early: bool,
    remarks: Vec<String>,
    gather: Option<Box<dyn Gather>>,
    arrivals: Arrivals<Seen>,
    /// Firings that the last packet shares with the next.
    split: Split,
    clock: ClockEstimator,
    view: FieldOfView,
    pending: Vec<Gap>,
    seconds: Vec<Second>,
    counts: Counts,
    tally: (u64, u64),
    turned_rad: f64,
    turned_ns: i64,
    first: Option<Ordered>,
    last: Option<Ordered>,
    clashing: u64,
    mode_changes: u64,
    broken: u64,
    source_ports: Vec<(u16, u64)>,
}

impl Lidar {
    pub fn new(choice: Choice, is_named: bool) -> Self {
        let model = choice.model;
        Self {
            model,
            is_named,
            candidates: choice.candidates,
            left_out: choice.left_out,
            doubt: choice.doubt,
            is_early: choice.is_early,
            remarks: Vec::new(),
            gather: model.gather(),
            arrivals: Arrivals::new(model),
            split: Split::default(),
            clock: ClockEstimator::default(),
            view: FieldOfView::default(),
            pending: Vec::new(),
            seconds: Vec::new(),
            counts: Counts::default(),
            tally: (0, 0),
            turned_rad: 0.0,
            turned_ns: 0,
            first: None,
            last: None,
            clashing: 0,
            mode_changes: 0,
            broken: 0,
            source_ports: Vec::new(),
        }
    }

    pub fn is_data(&self, payload: &[u8]) -> bool {
        is_data(self.model, self.is_named, payload)
    }

    /// What the data packets tell of the unit.
    pub fn gathered(&self) -> Option<UnitFile> {
        self.gather.as_ref()?.file()
    }

    pub fn count_port(&mut self, port: u16) {
        let ports = &mut self.source_ports;
        let place = ports.iter().position(|(known, _)| *known == port);
        match place {
            Some(place) => ports[place].1 += 1,
            None if ports.len() < 8 => ports.push((port, 1)),
            None => {}
        }
    }

    pub fn push(&mut self, arrival: Timestamp, payload: &[u8], shared: &mut Shared) {
        let Some(head) = self.model.head(payload) else {
            self.broken += 1;
            return;
        };
        if let Some(gather) = &mut self.gather {
            gather.take(payload);
        }
        if self.first.is_none() {
            self.remarks = self.model.remarks(payload);
        }
        let seen = Seen {
            tally: self.model.tally(payload),
            split: self.model.split(payload),
        };
        let keep = || seen.clone();
        let (ticket, what) = self.arrivals.offer(arrival, &head, mark(payload), keep);
        match what {
            Arrival::Next(ordered) => self.take(&ordered, seen, shared),
            Arrival::Held => {}
            Arrival::Duplicate => self.at(&ticket, shared, |counts| counts.duplicated += 1),
            Arrival::TooLate { was_lost } => self.at(&ticket, shared, |counts| {
                counts.late += 1;
                counts.too_late += 1;
                counts.lost -= u64::from(was_lost && counts.lost > 0);
            }),
            Arrival::Clash => self.clashing += 1,
        }
        self.drain(shared);
    }

    fn drain(&mut self, shared: &mut Shared) {
        while let Some((ordered, seen)) = self.arrivals.pop() {
            self.take(&ordered, seen, shared);
        }
    }

    /// Changes the counts of the whole and of the second in which a packet was sent.
    fn at(&mut self, ticket: &Ticket, shared: &Shared, change: impl Fn(&mut Counts)) {
        change(&mut self.counts);
        let time = self.clock.estimate(ticket.device);
        change(&mut self.second(time, shared).counts);
    }

    fn take(&mut self, ordered: &Ordered, seen: Seen, shared: &mut Shared) {
        let mut tally = seen.tally;
        if ordered.follows() {
            self.split.correct(&seen.split, &mut tally);
        }
        self.split = seen.split;
        let Ticket {
            arrival,
            device,
            head,
            ..
        } = ordered.ticket;
        let pair = TimePair {
            host: arrival,
            device,
        };
        self.clock.add(ordered.segment, pair, head.duration_ns);
        let time = self.clock.estimate(device);
        shared.origin.get_or_insert(time);
        if let Some(gap) = ordered.gap {
            self.pending.push(gap);
        }
        head.arcs().for_each(|arc| self.view.observe(arc));
        let is_known = || self.view.turns() >= VIEW_TURNS;
        if !self.pending.is_empty() && (self.pending.len() > MAX_PENDING || is_known()) {
            self.settle(shared);
        }
        self.count(ordered, tally, time, shared);
        if let Some(last) = &self.last {
            let is_change = last.ticket.head.return_mode != head.return_mode;
            self.mode_changes += u64::from(is_change);
        }
        if self.first.is_none() {
            self.first = Some(*ordered);
        }
        self.last = Some(*ordered);
    }

    fn count(&mut self, ordered: &Ordered, tally: Tally, time: Timestamp, shared: &Shared) {
        let head = ordered.ticket.head;
        let behind_ns = ordered.ticket.arrival - ordered.ticket.device;
        let offset_ns = behind_ns.saturating_sub(head.duration_ns);
        let (turned_rad, turned_ns) = self.turned(ordered);
        let second = self.second(time, shared);
        second.points += u64::from(tally.points);
        second.turned_rad += turned_rad;
        second.turned_ns += turned_ns;
        second.offset_ns = Some(second.offset_ns.map_or(offset_ns, |o| o.min(offset_ns)));
        second.counts.packets += 1;
        second.counts.late += u64::from(ordered.is_late);
        self.counts.packets += 1;
        self.counts.late += u64::from(ordered.is_late);
        self.tally.0 += u64::from(tally.points);
        self.tally.1 += u64::from(tally.merged);
        self.turned_rad += turned_rad;
        self.turned_ns += turned_ns;
    }

    /// How far the rotor turned in what time since the packet before, where that one is a neighbour: so
    /// the speed does not hang on the model's own timing.
    fn turned(&self, ordered: &Ordered) -> (f64, i64) {
        let Ticket { device, head, .. } = ordered.ticket;
        if head.rate_rad_per_ns <= 0.0 {
            return (head.turned_rad, head.duration_ns);
        }
        let Some(last) = self.last.filter(|last| last.segment == ordered.segment) else {
            return (0.0, 0);
        };
        let elapsed_ns = device - last.ticket.device;
        let most_ns = NEIGHBOUR * last.ticket.head.duration_ns.max(1);
        let turned_rad = wrap_turn(head.azimuth_rad - last.ticket.head.azimuth_rad);
        let expected_rad = head.rate_rad_per_ns * elapsed_ns as f64;
        let is_neighbour = ordered.gap.is_none() && (1..most_ns).contains(&elapsed_ns);
        // Beyond half a turn nothing tells forth from back.
        if is_neighbour && expected_rad.max(turned_rad) < PI {
            (turned_rad, elapsed_ns)
        } else {
            (0.0, 0)
        }
    }

    /// Counts gaps as loss, as far as they lie in the field of view.
    fn settle(&mut self, shared: &Shared) {
        for gap in std::mem::take(&mut self.pending) {
            let lost = gap.lost_in(&self.view, &shared.pauses);
            self.counts.lost += lost;
            let mut rest = lost;
            // Packets of a long outage belong to many seconds, of a short gap to one or two.
            let mut from = gap.from;
            while rest > 0 {
                let time = self.clock.estimate(from);
                let second_end = second_number(time, shared.origin) + 1;
                let end = shared.origin.unwrap_or(time) + second_end as i64 * NANOS_PER_SECOND;
                let room = ((end - time) / gap.period_ns.max(1) + 1) as u64;
                let here = rest.min(room.max(1));
                self.second(time, shared).counts.lost += here;
                rest -= here;
                from = from + here as i64 * gap.period_ns;
            }
        }
    }

    pub fn second(&mut self, time: Timestamp, shared: &Shared) -> &mut Second {
        let number = second_number(time, shared.origin);
        if number >= self.seconds.len() {
            self.seconds.resize(number + 1, Second::default());
        }
        &mut self.seconds[number]
    }

    pub fn finish(&mut self, shared: &mut Shared) {
        self.arrivals.flush();
        self.drain(shared);
        self.settle(shared);
        let strays = self.arrivals.take_strays();
        self.clashing += strays.clashing;
        self.counts.duplicated += strays.duplicated;
        self.counts.late += strays.too_late;
        self.counts.too_late += strays.too_late;
        self.counts.lost = self.counts.lost.saturating_sub(strays.were_lost);
    }

    pub fn add_drops(&self, drops: &mut Drops) {
        drops.add("duplicated", self.counts.duplicated);
        drops.add("too_late", self.counts.too_late);
        drops.add("other_sensor", self.clashing);
        drops.add("packet_broken", self.broken);
    }

    /// `None` where not a single packet came through.
    pub fn describe(
        &self,
        key: StreamKey,
        foreign: u64,
        position: Option<PositionFacts>,
    ) -> Option<StreamInfo> {
        let (first, last) = (self.first?, self.last?);
        let is_locked = position.as_ref().is_some_and(PositionFacts::is_locked);
        let clock = self.clock.finish(is_locked);
        let end = last.ticket.device + last.ticket.head.duration_ns;
        let head = last.ticket.head;
        let (turned_rad, turned_ns) = match self.turned_ns {
            0 => (head.turned_rad, head.duration_ns),
            turned_ns => (self.turned_rad, turned_ns),
        };
        let minutes = turned_ns as f64 / 60e9;
        let mut info = StreamInfo {
            key,
            model: self.model,
            is_named: self.is_named,
            candidates: self.candidates.clone(),
            unit: Vec::new(),
            calibration: Ok(Calibration::Factory),
            return_mode: last.ticket.head.return_mode.name(),
            rpm: turned_rad / std::f64::consts::TAU / minutes.max(f64::MIN_POSITIVE),
            counts: self.counts,
            points: self.tally.0,
            merged: self.tally.1,
            foreign,
            first: clock.utc(first.segment, first.ticket.device),
            last: clock.utc(last.segment, end),
            clock,
            position,
            view: self.view.clone(),
            conflict: self.conflict(&key, first.ticket.device, end),
            notes: Vec::new(),
            seconds: self.seconds.clone(),
            source_ports: self.source_ports.clone(),
        };
        info.notes = self.notes(&info);
        Some(info)
    }

    /// Whether two sensors send under one name.
    fn conflict(&self, key: &StreamKey, from: Timestamp, to: Timestamp) -> Option<String> {
        let head = self.last?.ticket.head;
        let period_ns = self.model.period_ns(head.return_mode) as f64;
        let room = ((to - from) as f64 / period_ns).max(1.0);
        let arrived = self.counts.packets + self.clashing;
        let is_crowded = self.clashing >= 16 && self.clashing * 20 > arrived
            // Numbers that follow each other are one sensor's, whatever its model makes of the time.
            || head.sequence.is_none()
                && self.counts.packets >= 32
                && self.counts.packets as f64 > CROWDED * room;
        let is_jump_free = self.last?.segment == 0;
        (is_crowded && (is_jump_free || self.clashing > 0)).then(|| {
            format!(
                "two sensors send from {} to port {}: {} of {arrived} packets do not fit one clock",
                key.address, key.port, self.clashing
            )
        })
    }

    fn notes(&self, info: &StreamInfo) -> Vec<String> {
        let mut notes = Vec::new();
        let blind_deg = self.view.blind_rad().to_degrees();
        if blind_deg > 1.0 {
            notes.push(format!(
                "field of view limited to {:.0} degrees",
                360.0 - blind_deg
            ));
        }
        if let Some(facts) = &info.position {
            let sentence = facts.sentence.as_deref().unwrap_or("no NMEA sentence");
            let (packets, port, pps) = (facts.packets, facts.port, facts.pps.name());
            notes.push(format!(
                "{packets} position packets to port {port}, pulse per second {pps}, {sentence}"
            ));
        }
        notes.extend(self.remarks.iter().cloned());
        if !self.left_out.is_empty() && self.doubt.is_none() {
            let (model, others) = (self.model.id(), self.left_out.join(", "));
            notes.push(format!(
                "told from {others} by the ranges, not by the header: name another model than {model} with --sensor"
            ));
        }
        notes.extend(self.doubt.clone());
        if self.is_early {
            let (model, others) = (self.model.id(), self.candidates.join(", "));
            notes.push(format!(
                "too few packets to tell {model} from {others}: name the model with --sensor"
            ));
        }
        notes.extend(info.clock.jumps_in_words(info.first));
        if self.mode_changes > 0 {
            let changes = self.mode_changes;
            notes.push(format!("the return mode changed {changes} times"));
        }
        notes.extend(info.conflict.clone());
        notes
    }
}

fn second_number(time: Timestamp, origin: Option<Timestamp>) -> usize {
    let elapsed_ns = time - origin.unwrap_or(time);
    // A broken stamp must not ask for memory without end: ten years of seconds at most would be
    // far too many, a month is plenty.
    const MOST: i64 = 31 * 86_400;
    (elapsed_ns / NANOS_PER_SECOND).clamp(0, MOST) as usize
}
