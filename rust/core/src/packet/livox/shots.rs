//! What the data packets of both protocols have in common: shots in equal steps of time.

use super::points::Form;
use crate::clock::SINCE_PULSE;
use crate::packet::ReturnMode;
use crate::time::NANOS_PER_SECOND;

/// What the sensor's clock follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sync {
    /// Nothing: it counts from the start of the sensor.
    Free,
    /// PTP.
    Ptp,
    /// A pulse per second and the date of a GNSS receiver.
    Gnss,
    /// A pulse per second without a date: it counts from the last pulse.
    Pulse,
}

impl Sync {
    /// For reports.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Free => "counts from the start of the sensor",
            Self::Ptp => "follows PTP",
            Self::Gnss => "follows GNSS",
            Self::Pulse => {
                "follows a pulse per second without a date, the second comes from the host"
            }
        }
    }

    /// Device time of nanoseconds that a packet tells.
    pub(super) fn device_ns(self, told_ns: i64) -> i64 {
        match self {
            Self::Pulse if told_ns < NANOS_PER_SECOND => SINCE_PULSE + told_ns,
            _ => told_ns,
        }
    }
}

/// Time from shot to shot: nanoseconds over a number of shots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// Nanoseconds.
    pub ns: i64,
    /// Shots in which they pass, at least 1.
    pub shots: i64,
}

impl Step {
    /// `ns` nanoseconds over `shots` shots.
    pub const fn new(ns: i64, shots: i64) -> Self {
        Self { ns, shots }
    }

    /// Time from the first shot to another one.
    #[inline]
    pub fn until(self, shot: usize) -> i64 {
        shot as i64 * self.ns / self.shots
    }
}

/// Times of shots after the first one, without a division for each.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    step: Step,
    whole_ns: i64,
    rest: i64,
    next: (i64, i64),
}

impl Step {
    /// Times of one shot after the other.
    pub fn times(self) -> Times {
        Times {
            step: self,
            whole_ns: self.ns / self.shots,
            rest: self.ns % self.shots,
            next: (0, 0),
        }
    }
}

impl Iterator for Times {
    type Item = i64;

    #[inline]
    fn next(&mut self) -> Option<i64> {
        let (now_ns, parts) = self.next;
        let parts = parts + self.rest;
        let carry = i64::from(parts >= self.step.shots);
        self.next = (
            now_ns + self.whole_ns + carry,
            parts - carry * self.step.shots,
        );
        Some(now_ns)
    }
}

/// Borrowed data packet: its lengths were checked.
#[derive(Debug, Clone, Copy)]
pub struct Packet<'a> {
    /// Layout of a shot.
    pub form: Form,
    /// Shots, one behind the other.
    pub body: &'a [u8],
    /// Device time of the first one.
    pub device_ns: i64,
    /// What the clock follows.
    pub sync: Sync,
    /// Number of the packet.
    pub sequence: Option<u32>,
    /// Time from shot to shot.
    pub step: Step,
}

impl<'a> Packet<'a> {
    /// Number of shots.
    pub fn count(&self) -> usize {
        self.body.len() / self.form.len()
    }

    /// Bytes of the shots.
    pub fn shots(&self) -> std::slice::ChunksExact<'a, u8> {
        self.body.chunks_exact(self.form.len())
    }

    /// Time from its first shot to that of the next packet.
    pub fn duration_ns(&self) -> i64 {
        self.step.until(self.count()).max(1)
    }

    /// Which returns it carries; which one a single return is the packets do not tell.
    pub fn return_mode(&self) -> ReturnMode {
        match self.form.echoes {
            1 => ReturnMode::Strongest,
            2 => ReturnMode::FirstSecond,
            _ => ReturnMode::Triple,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_shots_are_those_of_the_step() {
        for step in [
            Step::new(12_500, 3),
            Step::new(475_000, 95),
            Step::new(250_000, 113),
        ] {
            for (shot, time_ns) in step.times().take(200).enumerate() {
                assert_eq!(time_ns, step.until(shot), "{step:?}");
            }
        }
    }
}
