//! The sensor's clock against the host's: unrolling it, telling UTC from a free-running clock, and
//! the offset and drift of the latter.
//!
//! Packets are delayed on their way to the recorder, never hastened; so the true offset runs along
//! the lower envelope of arrival minus device time, less the time that a packet takes to fill.

mod envelope;

use crate::time::{NANOS_PER_SECOND, TimePair, Timestamp};
use envelope::Envelope;

/// A device clock within this of the host's arrival times counts as UTC.
pub const UTC_WITHIN_NS: i64 = 20_000_000;
/// So many bins of the envelope must be near the host's time; the rest may have met a stalled host.
const UTC_SHARE: f64 = 0.95;
/// A stamp of this and so many nanoseconds counts from the last pulse of a second: of clocks that follow a
/// pulse per second and know no date.
pub const SINCE_PULSE: i64 = -(1 << 61);
/// Jumps beyond so many join the segment before: such a clock is broken anyway.
const MAX_SEGMENTS: usize = 1000;
/// So many jumps are told one by one.
const MAX_TOLD: usize = 3;

/// Unrolls a device clock that starts again, with the host's time as guide.
#[derive(Debug, Clone)]
pub struct Unroller {
    wrap_ns: Option<i64>,
    anchor: Option<TimePair>,
}

impl Unroller {
    /// A clock that starts again after `wrap_ns`, or never.
    pub fn new(wrap_ns: Option<i64>) -> Self {
        Self {
            wrap_ns,
            anchor: None,
        }
    }

    /// Device time without roll-over: the turn of the clock that is nearest to what the time passed
    /// on the host since the last followed packet suggests, or to the host's time itself at first.
    pub fn unroll(&self, host: Timestamp, stamp_ns: i64) -> Timestamp {
        let expected = self
            .anchor
            .map_or(host, |anchor| anchor.device + (host - anchor.host));
        let is_pulsed = (SINCE_PULSE..SINCE_PULSE + NANOS_PER_SECOND).contains(&stamp_ns);
        let (wrap_ns, stamp_ns) = match self.wrap_ns {
            None if is_pulsed => (NANOS_PER_SECOND, stamp_ns - SINCE_PULSE),
            None => return Timestamp(stamp_ns),
            Some(wrap_ns) => (wrap_ns, stamp_ns),
        };
        let ahead_ns = match stamp_ns.checked_sub(expected.0) {
            Some(ahead_ns) => ahead_ns.rem_euclid(wrap_ns),
            None => remainder(stamp_ns, expected.0, wrap_ns),
        };
        let nearest_ns = if ahead_ns > wrap_ns / 2 {
            ahead_ns - wrap_ns
        } else {
            ahead_ns
        };
        expected + nearest_ns
    }

    /// Takes a packet that came in order as the guide for the next ones.
    pub fn follow(&mut self, host: Timestamp, device: Timestamp) {
        self.anchor = Some(TimePair { host, device });
    }
}

/// A difference that needs more than 64 bits, brought into [0, `wrap_ns`).
fn remainder(stamp_ns: i64, expected_ns: i64, wrap_ns: i64) -> i64 {
    (i128::from(stamp_ns) - i128::from(expected_ns)).rem_euclid(wrap_ns.into()) as i64
}

/// How device times become UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockKind {
    /// The sensor says that its clock is locked to UTC.
    Locked,
    /// The device clock stays within 20 ms of the host's, so it is UTC.
    Utc,
    /// The device clock runs freely; offset and drift come from the host's arrival times.
    FreeRunning,
}

impl ClockKind {
    /// Word for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Locked => "locked",
            Self::Utc => "utc",
            Self::FreeRunning => "free_running",
        }
    }
}

/// Line from device time to UTC over one stretch without a jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockSegment {
    /// How it came about.
    pub kind: ClockKind,
    /// Device time at which `offset_ns` holds.
    pub reference: Timestamp,
    /// Host minus device at the reference, along the lower envelope, nanoseconds.
    pub offset_ns: i64,
    /// Growth of the offset, as a share of device time.
    pub drift: f64,
    /// Packets it rests on.
    pub packets: u64,
    /// Device time of its first packet.
    pub from: Timestamp,
}

/// A jump of the device clock against the host's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockJump {
    /// UTC of the first packet behind it.
    pub at: Timestamp,
    /// How far the device clock went ahead; negative where it was set back.
    pub by_ns: i64,
}

impl ClockSegment {
    /// Host minus device at a device time of this stretch.
    fn offset_at(&self, device: Timestamp) -> i64 {
        let drifted_ns = (device - self.reference) as f64 * self.drift;
        self.offset_ns.saturating_add(drifted_ns.round() as i64)
    }

    /// UTC of a device time.
    pub fn utc(&self, device: Timestamp) -> Timestamp {
        match self.kind {
            ClockKind::Locked | ClockKind::Utc => device,
            ClockKind::FreeRunning => device + self.offset_at(device),
        }
    }
}

/// From device time to UTC over a whole capture: one segment more than the clock jumped.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClockModel {
    segments: Vec<ClockSegment>,
}

impl ClockModel {
    /// Segments in the order of arrival.
    pub fn segments(&self) -> &[ClockSegment] {
        &self.segments
    }

    /// UTC of a device time in a segment; device time itself where nothing is known.
    pub fn utc(&self, segment: usize, device: Timestamp) -> Timestamp {
        let last = self.segments.len().saturating_sub(1);
        self.segments
            .get(segment.min(last))
            .map_or(device, |line| line.utc(device))
    }

    /// Where the clock jumped, in the order of arrival.
    pub fn jumps(&self) -> impl Iterator<Item = ClockJump> + '_ {
        self.segments.windows(2).map(|pair| {
            let (before, after) = (&pair[0], &pair[1]);
            let offset_ns = after.offset_at(after.from);
            // The time before the jump goes on to its place on the host's clock.
            let known_as = after.from + offset_ns + before.offset_ns.saturating_neg();
            ClockJump {
                at: after.utc(after.from),
                by_ns: before.offset_at(known_as).saturating_sub(offset_ns),
            }
        })
    }

    /// What to tell of the jumps, counting from the stream's first packet; `None` where there are none.
    pub fn jumps_in_words(&self, first: Timestamp) -> Option<String> {
        let count = self.segments.len().saturating_sub(1);
        let told = self.jumps().take(MAX_TOLD).map(|jump| {
            let by_s = jump.by_ns as f64 / NANOS_PER_SECOND as f64;
            let after_s = jump.at.seconds_since(first);
            format!("by {by_s:+.3} s, {after_s:.1} s after its first packet")
        });
        let told = told.collect::<Vec<_>>().join("; ");
        let more = if count > MAX_TOLD { "; ..." } else { "" };
        let times = if count == 1 { "time" } else { "times" };
        (count > 0).then(|| format!("the device clock jumped {count} {times}: {told}{more}"))
    }

    /// The segment that most packets rest on.
    pub fn main(&self) -> Option<&ClockSegment> {
        self.segments.iter().max_by_key(|segment| segment.packets)
    }
}

/// Gathers pairs of host and device time, and judges them in the end.
#[derive(Debug, Clone, Default)]
pub struct ClockEstimator {
    segments: Vec<Envelope>,
}

impl ClockEstimator {
    /// Takes one packet: when it arrived, its unrolled stamp, and how long it took to fill.
    pub fn add(&mut self, segment: usize, pair: TimePair, fill_ns: i64) {
        let segment = segment.min(MAX_SEGMENTS - 1);
        while self.segments.len() <= segment {
            self.segments.push(Envelope::default());
        }
        self.segments[segment].add(
            pair.device,
            (pair.host - pair.device).saturating_sub(fill_ns),
        );
    }

    /// UTC of a recent device time as far as it can be told already; good to about a millisecond.
    pub fn estimate(&self, device: Timestamp) -> Timestamp {
        match self.segments.last().and_then(Envelope::recent_ns) {
            Some(offset_ns) if offset_ns.abs() > UTC_WITHIN_NS => device + offset_ns,
            _ => device,
        }
    }

    /// Judges the whole capture; `is_locked` when the sensor said that its clock follows UTC.
    pub fn finish(&self, is_locked: bool) -> ClockModel {
        let judge = |envelope: &Envelope| {
            let kind = if is_locked {
                ClockKind::Locked
            } else if envelope.share_within(UTC_WITHIN_NS) >= UTC_SHARE {
                ClockKind::Utc
            } else {
                ClockKind::FreeRunning
            };
            let line = envelope.line();
            ClockSegment {
                kind,
                reference: line.reference,
                offset_ns: line.offset_ns,
                drift: line.slope,
                packets: envelope.packets(),
                from: envelope.from(),
            }
        };
        ClockModel {
            segments: self.segments.iter().map(judge).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::{NANOS_PER_HOUR, NANOS_PER_SECOND};

    const START: Timestamp = Timestamp(1_718_000_000 * NANOS_PER_SECOND);

    #[test]
    fn the_hour_comes_from_the_host() {
        let unroller = Unroller::new(Some(NANOS_PER_HOUR));
        let past_hour = START.0 % NANOS_PER_HOUR;
        assert_eq!(unroller.unroll(START + 1_500_000, past_hour), START);
        // A stamp from just before the hour that arrives just after it.
        let hour = Timestamp(START.0 - past_hour);
        let stamp = NANOS_PER_HOUR - 1_000;
        assert_eq!(unroller.unroll(hour + 2_000, stamp), hour + -1_000);
    }

    #[test]
    fn a_stamp_since_the_last_pulse_gets_its_second_from_the_host() {
        let mut unroller = Unroller::new(None);
        let second = |stamp_ns: i64| SINCE_PULSE + stamp_ns;
        let first = unroller.unroll(START + 999_900_000, second(999_000_000));
        assert_eq!(first, START + 999_000_000);
        unroller.follow(START + 999_900_000, first);
        // The host was busy for 0.3 s.
        let next = unroller.unroll(START + 1_300_000_000, second(500_000));
        assert_eq!(next, START + 1_000_500_000);
        assert_eq!(unroller.unroll(START, 77), Timestamp(77));
    }

    #[test]
    fn roll_over_and_long_pauses_keep_counting() {
        let mut unroller = Unroller::new(Some(NANOS_PER_HOUR));
        let first = unroller.unroll(START, NANOS_PER_HOUR - 7);
        unroller.follow(START, first);
        assert_eq!(unroller.unroll(START + 7, 0) - first, 7);
        let pause = 5 * NANOS_PER_HOUR + 1_000_000;
        assert_eq!(unroller.unroll(START + pause, 999_993) - first, pause);
    }

    /// Arrival times of a clock with an offset and drift, late by up to 3 ms, now and then by 0.4 s.
    fn estimator(offset_ns: i64, drift_ppm: i64, seconds: i64) -> ClockEstimator {
        let mut clock = ClockEstimator::default();
        for packet in 0..seconds * 750 {
            let elapsed_ns = packet * 1_333_333;
            let utc = START + elapsed_ns;
            let device = utc + -offset_ns + -(elapsed_ns / 1_000_000 * drift_ppm);
            let hashed = (packet as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
            let stall_ns = if packet % 5_000 > 4_700 {
                400_000_000
            } else {
                0
            };
            let host = utc + 1_327_104 + (hashed as i64 % 3_000_000) + stall_ns;
            clock.add(0, TimePair { host, device }, 1_327_104);
        }
        clock
    }

    #[test]
    fn a_clock_near_the_host_is_utc() {
        let model = estimator(0, 0, 60).finish(false);
        let main = model.main().unwrap();
        assert_eq!(main.kind, ClockKind::Utc);
        assert!(main.offset_ns.abs() < 50_000, "{main:?}");
        assert_eq!(model.utc(0, START), START);
    }

    #[test]
    fn offset_and_drift_of_a_free_clock_come_back() {
        for (offset_ns, drift_ppm) in [(1_234_567_890, 40), (-700_000_000, -25), (30_000_000, 0)] {
            let clock = estimator(offset_ns, drift_ppm, 120);
            let model = clock.finish(false);
            let main = model.main().unwrap();
            assert_eq!(main.kind, ClockKind::FreeRunning);
            assert!(
                (main.drift * 1e6 - drift_ppm as f64).abs() < 0.5,
                "{main:?}"
            );
            for second in [0, 60, 119] {
                let elapsed_ns = second * NANOS_PER_SECOND;
                let utc = START + elapsed_ns;
                let device = utc + -offset_ns + -(elapsed_ns / 1_000_000 * drift_ppm);
                // The earliest of 750 packets a second, each late by 0 to 3 ms: within some 10 us.
                let error_ns = model.utc(0, device) - utc;
                assert!(error_ns.abs() < 60_000, "{second} s: {error_ns} ns");
            }
            let last = START + 119 * NANOS_PER_SECOND;
            let device = last + -offset_ns + -(119_000 * drift_ppm);
            assert!((clock.estimate(device) - last).abs() < 5_000_000);
        }
    }

    #[test]
    fn a_locked_clock_is_believed_whatever_the_host_says() {
        let model = estimator(3_000_000_000, 0, 10).finish(true);
        assert_eq!(model.utc(0, START), START);
        assert_eq!(model.main().unwrap().kind, ClockKind::Locked);
    }
}
