//! Instants as integer nanoseconds, and the pair of clocks that every packet carries.

use std::ops::{Add, Sub};

/// Nanoseconds in one second.
pub const NANOS_PER_SECOND: i64 = 1_000_000_000;
/// Nanoseconds in one hour, after which a top-of-hour clock starts again.
pub const NANOS_PER_HOUR: i64 = 3600 * NANOS_PER_SECOND;

/// An instant: nanoseconds since 1970-01-01 00:00:00 UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Timestamp(pub i64);

impl Timestamp {
    /// Seconds from `earlier` to `self`.
    pub fn seconds_since(self, earlier: Timestamp) -> f64 {
        (self.0.saturating_sub(earlier.0)) as f64 / NANOS_PER_SECOND as f64
    }
}

/// Adds nanoseconds; saturates at the ends of the range, so that no stamp of a broken capture panics.
impl Add<i64> for Timestamp {
    type Output = Timestamp;
    fn add(self, nanos: i64) -> Timestamp {
        Timestamp(self.0.saturating_add(nanos))
    }
}

/// Nanoseconds between two instants; saturates like the addition.
impl Sub for Timestamp {
    type Output = i64;
    fn sub(self, other: Timestamp) -> i64 {
        self.0.saturating_sub(other.0)
    }
}

/// When a packet was made and when it was received: the sensor's clock and the host's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimePair {
    /// Arrival at the recording host.
    pub host: Timestamp,
    /// The sensor's own stamp, in the scale of its clock.
    pub device: Timestamp,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_exact_to_the_nanosecond() {
        let start = Timestamp(1_718_000_000_000_000_001);
        assert_eq!((start + 5) - start, 5);
        assert_eq!((start + NANOS_PER_HOUR).seconds_since(start), 3600.0);
    }

    #[test]
    fn the_ends_of_the_range_saturate() {
        assert_eq!(Timestamp(i64::MAX) + 1, Timestamp(i64::MAX));
        assert_eq!(Timestamp(i64::MIN) - Timestamp(1), i64::MIN);
    }
}
