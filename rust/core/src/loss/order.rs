//! Puts packets back in order and finds those that are missing, repeated, late or astray.
//!
//! Packets are known by a key that grows by one step from packet to packet: the sequence number
//! where the sensor has one, else its unrolled clock. A packet that follows the one before passes
//! at once. Behind a gap packets wait until it closes, or until [`WAIT_NS`] of host time have passed.
//! A packet far off both in key and in host time is set aside: when more follow it, the clock has
//! jumped; when the others go on beside them, two sensors share the stream.

use std::collections::VecDeque;
use std::ops::Range;

use crate::time::Timestamp;

/// How long packets wait for one that is missing before them, nanoseconds of host time.
pub const WAIT_NS: i64 = 50_000_000;
/// Key and host time may disagree by this before a packet counts as astray.
const ASTRAY_NS: i64 = 500_000_000;
/// So many packets in a row that agree with each other make a new time.
const JUMP_PACKETS: usize = 8;
/// Packets of the old time that may come in between.
const JUMP_OTHERS: u32 = 4;
/// Stray packets are given up after so many others.
const PATIENCE: u32 = 64;
/// Bounds of what is remembered.
const MAX_HELD: usize = 2048;
const MAX_GAPS: usize = 256;
const MAX_RECENT: usize = 1024;

/// Place of a packet in its stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    /// Sequence number or unrolled device time.
    pub key: i64,
    /// What the next packet's key is ahead when nothing is lost.
    pub span: i64,
    /// Part of the content, to tell a repeated packet from another sensor's.
    pub mark: u64,
}

/// A packet in its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Passed<T> {
    /// The packet; `None` when it is the one just offered.
    pub item: T,
    /// Packets missing before it.
    pub lost: u64,
    /// It had arrived after its successors.
    pub is_late: bool,
    /// The clock jumped before it.
    pub is_jump: bool,
}

/// What becomes of an offered packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It is next: take it now, then ask [`Order::pop`].
    Next {
        /// It had arrived after its successors.
        is_late: bool,
    },
    /// It waits; ask [`Order::pop`].
    Held,
    /// It came a second time.
    Duplicate,
    /// It came too late to be put back; it had been counted as lost if `was_lost`.
    TooLate {
        /// Whether it fills a gap that was counted.
        was_lost: bool,
    },
    /// Another sensor sends at the same time from the same address.
    Clash,
}

/// What was given up while packets were set aside.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Strays {
    /// Single packets of another time, dropped.
    pub too_late: u64,
    /// Of those the ones that had been counted as lost.
    pub were_lost: u64,
    /// Repetitions of packets that were taken before.
    pub duplicated: u64,
    /// Packets of another sensor at the same address.
    pub clashing: u64,
}

/// The state machine; `T` is what the caller keeps of a packet that waits.
#[derive(Debug)]
pub struct Order<T> {
    step: i64,
    ns_per_key: f64,
    next: Option<Expected>,
    held: VecDeque<Held<T>>,
    passed: VecDeque<Passed<T>>,
    aside: VecDeque<Held<T>>,
    others: u32,
    gaps: VecDeque<Range<i64>>,
    recent: VecDeque<(i64, u64)>,
    now: Timestamp,
    jump: Option<Timestamp>,
    is_flushing: bool,
    strays: Strays,
}

#[derive(Debug, Clone, Copy)]
struct Expected {
    key: i64,
    arrival: Timestamp,
}

#[derive(Debug)]
struct Held<T> {
    arrival: Timestamp,
    /// When the gap before it was noticed.
    since: Timestamp,
    stamp: Stamp,
    is_late: bool,
    item: T,
}

impl<T> Order<T> {
    /// Keys grow by `step` a packet, which is sent every `period_ns`.
    pub fn new(step: i64, period_ns: i64) -> Self {
        let step = step.max(1);
        Self {
            step,
            ns_per_key: period_ns as f64 / step as f64,
            next: None,
            held: VecDeque::new(),
            passed: VecDeque::new(),
            aside: VecDeque::new(),
            others: 0,
            gaps: VecDeque::new(),
            recent: VecDeque::new(),
            now: Timestamp(i64::MIN),
            jump: None,
            is_flushing: false,
            strays: Strays::default(),
        }
    }

    /// The sensor now sends at another rate.
    pub fn set_step(&mut self, step: i64, period_ns: i64) {
        self.step = step.max(1);
        self.ns_per_key = period_ns as f64 / self.step as f64;
    }

    /// Judges a packet; `keep` is called when it has to wait.
    pub fn offer(&mut self, arrival: Timestamp, stamp: Stamp, keep: impl FnOnce() -> T) -> Verdict {
        self.now = self.now.max(arrival);
        let Some(next) = self.next else {
            return self.offer_first(arrival, stamp, keep);
        };
        let ahead = stamp.key.saturating_sub(next.key);
        if self.is_contiguous(ahead) {
            let is_late = !self.held.is_empty();
            self.advance(arrival, stamp);
            return Verdict::Next { is_late };
        }
        if self.is_astray(ahead, arrival - next.arrival) {
            return self.set_aside(arrival, stamp, keep);
        }
        if ahead > 0 {
            self.hold(arrival, stamp, keep)
        } else {
            self.behind(stamp)
        }
    }

    /// Before anything was passed: the packets that agree with the first one wait.
    fn offer_first(
        &mut self,
        arrival: Timestamp,
        stamp: Stamp,
        keep: impl FnOnce() -> T,
    ) -> Verdict {
        if let Some(held) = self.held.front() {
            let ahead = stamp.key.saturating_sub(held.stamp.key);
            if self.is_astray(ahead, arrival - held.arrival) {
                return self.set_aside(arrival, stamp, keep);
            }
        }
        self.others += 1;
        self.hold(arrival, stamp, keep)
    }

    /// The next packet whose turn has come.
    pub fn pop(&mut self) -> Option<Passed<T>> {
        if let Some(passed) = self.passed.pop_front() {
            return Some(passed);
        }
        let front = self.held.front()?;
        let ahead = self
            .next
            .map(|next| front.stamp.key.saturating_sub(next.key));
        let is_next = ahead.is_some_and(|ahead| self.is_contiguous(ahead));
        let waited_ns = self.now - front.since;
        let is_due = waited_ns > WAIT_NS || self.held.len() > MAX_HELD || self.is_flushing;
        if is_next || is_due {
            self.release()
        } else {
            None
        }
    }

    /// The stream has ended: [`Order::pop`] now gives all that waits.
    pub fn flush(&mut self) {
        self.is_flushing = true;
        self.give_up_aside();
    }

    /// What was given up since the last call.
    pub fn take_strays(&mut self) -> Strays {
        std::mem::take(&mut self.strays)
    }

    fn is_contiguous(&self, ahead: i64) -> bool {
        ahead.unsigned_abs() <= (self.step / 2) as u64
    }

    fn is_astray(&self, ahead: i64, elapsed_ns: i64) -> bool {
        let ahead_ns = ahead as f64 * self.ns_per_key;
        (ahead_ns - elapsed_ns as f64).abs() > ASTRAY_NS as f64
    }

    fn advance(&mut self, arrival: Timestamp, stamp: Stamp) {
        let before = self.next.map_or(arrival, |next| next.arrival);
        self.next = Some(Expected {
            key: stamp.key.saturating_add(stamp.span.max(self.step / 2)),
            arrival: arrival.max(before),
        });
        self.recent.push_back((stamp.key, stamp.mark));
        if self.recent.len() > MAX_RECENT {
            self.recent.pop_front();
        }
        if !self.aside.is_empty() {
            self.others += 1;
            if self.others > PATIENCE {
                self.give_up_aside();
            }
        }
    }

    fn hold(&mut self, arrival: Timestamp, stamp: Stamp, keep: impl FnOnce() -> T) -> Verdict {
        let place = self.held.partition_point(|held| held.stamp.key < stamp.key);
        let neighbours = [place.checked_sub(1), Some(place)];
        for held in neighbours
            .into_iter()
            .flatten()
            .filter_map(|n| self.held.get(n))
        {
            if held.stamp.key.abs_diff(stamp.key) < (self.step / 2).max(1) as u64 {
                return if held.stamp.key == stamp.key && held.stamp.mark == stamp.mark {
                    Verdict::Duplicate
                } else {
                    Verdict::Clash
                };
            }
        }
        let behind = self.held.get(place);
        let held = Held {
            arrival,
            since: behind.map_or(arrival, |held| held.since.min(arrival)),
            stamp,
            is_late: behind.is_some(),
            item: keep(),
        };
        self.held.insert(place, held);
        Verdict::Held
    }

    fn release(&mut self) -> Option<Passed<T>> {
        let held = self.held.pop_front()?;
        let jump = self.jump.take();
        let lost = match self.next {
            Some(next) => self.open_gap(next.key, held.stamp.key),
            None => jump.map_or(0, |before| self.lost_in(held.arrival - before)),
        };
        self.advance(held.arrival, held.stamp);
        Some(Passed {
            item: held.item,
            lost,
            is_late: held.is_late,
            is_jump: jump.is_some(),
        })
    }

    /// Packets that host time has room for where keys cannot tell.
    fn lost_in(&self, pause_ns: i64) -> u64 {
        if pause_ns <= WAIT_NS {
            return 0; // within what arrival times scatter by
        }
        let packets = pause_ns as f64 / (self.ns_per_key * self.step as f64);
        (packets.round() as u64).saturating_sub(1)
    }

    fn open_gap(&mut self, from: i64, to: i64) -> u64 {
        let width = to.saturating_sub(from);
        let lost = width.saturating_add(self.step / 2) / self.step;
        if lost <= 0 {
            return 0;
        }
        self.gaps.push_back(from..to);
        if self.gaps.len() > MAX_GAPS {
            self.gaps.pop_front();
        }
        lost as u64
    }

    /// A packet from before the last one that was passed on.
    fn behind(&mut self, stamp: Stamp) -> Verdict {
        if self.close_gap(stamp.key) {
            return Verdict::TooLate { was_lost: true };
        }
        let mut recent = self.recent.iter().rev();
        match recent.find(|(key, _)| *key == stamp.key) {
            Some((_, mark)) if *mark == stamp.mark => Verdict::Duplicate,
            _ if self.oldest_recent() > stamp.key => Verdict::TooLate { was_lost: false },
            _ => Verdict::Clash,
        }
    }

    fn oldest_recent(&self) -> i64 {
        self.recent.front().map_or(i64::MIN, |(key, _)| *key)
    }

    /// Takes `key` out of the gaps that were counted as lost.
    fn close_gap(&mut self, key: i64) -> bool {
        let (half, step) = (self.step / 2, self.step);
        let holds = |gap: &Range<i64>| {
            let end = gap.end.max(gap.start.saturating_add(step));
            key >= gap.start.saturating_sub(half) && key.saturating_add(half) < end
        };
        let Some(place) = self.gaps.iter().position(holds) else {
            return false;
        };
        let gap = self.gaps[place].clone();
        let rest = [gap.start..key, key.saturating_add(step)..gap.end];
        self.gaps.remove(place);
        for part in rest
            .into_iter()
            .filter(|part| part.end.saturating_sub(part.start) >= step - half)
        {
            self.gaps.push_back(part);
        }
        true
    }

    fn set_aside(&mut self, arrival: Timestamp, stamp: Stamp, keep: impl FnOnce() -> T) -> Verdict {
        if let Some(last) = self.aside.back() {
            if last.stamp == stamp {
                return Verdict::Duplicate;
            }
            let ahead = stamp.key.saturating_sub(last.stamp.key);
            if self.is_astray(ahead, arrival - last.arrival) {
                self.give_up_aside();
            }
        }
        if self.aside.is_empty() {
            self.others = 0;
        }
        let held = Held {
            arrival,
            since: arrival,
            stamp,
            is_late: false,
            item: keep(),
        };
        self.aside.push_back(held);
        if self.aside.len() >= JUMP_PACKETS {
            if self.others < JUMP_OTHERS {
                self.start_anew();
            } else {
                self.strays.clashing += self.aside.len() as u64;
                self.aside.clear();
            }
        }
        Verdict::Held
    }

    /// The clock has jumped: passes on what waits, then goes on from what was set aside.
    fn start_anew(&mut self) {
        while let Some(passed) = self.release() {
            self.passed.push_back(passed);
        }
        self.jump = self.next.map(|next| next.arrival);
        self.next = None;
        self.gaps.clear();
        self.recent.clear();
        self.held = std::mem::take(&mut self.aside);
        self.held
            .make_contiguous()
            .sort_by_key(|held| held.stamp.key);
    }

    fn give_up_aside(&mut self) {
        while let Some(stray) = self.aside.pop_front() {
            if self.close_gap(stray.stamp.key) {
                self.strays.were_lost += 1;
                self.strays.too_late += 1;
            } else if self.recent.contains(&(stray.stamp.key, stray.stamp.mark)) {
                self.strays.duplicated += 1;
            } else {
                self.strays.too_late += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests;
