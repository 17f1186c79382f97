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
