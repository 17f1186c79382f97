//! Time stamps of one interface: a resolution in powers of ten or two, and an offset.

use crate::time::{NANOS_PER_SECOND, Timestamp};

/// How the 64-bit stamps of an interface become nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Clock {
    unit: Unit,
    offset_ns: i64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    /// Whole nanoseconds per tick.
    Nanos(u64),
    /// Ticks per nanosecond.
    PerNano(u128),
    /// Ticks of 2^-n seconds.
    Binary(u32),
}

impl Clock {
    /// From the options `if_tsresol` (default 6: microseconds) and `if_tsoffset` in seconds.
    pub(super) fn new(tsresol: u8, offset_s: i64) -> Self {
        let exponent = u32::from(tsresol & 0x7F);
        let unit = match tsresol & 0x80 {
            0 if exponent <= 9 => Unit::Nanos(10u64.pow(9 - exponent)),
            // 10^38 still fits; finer units give nanosecond 0 from 64-bit stamps either way.
            0 => Unit::PerNano(10u128.pow((exponent - 9).min(38))),
            _ => Unit::Binary(exponent),
        };
        let offset_ns = offset_s.saturating_mul(NANOS_PER_SECOND);
        Self { unit, offset_ns }
    }

    /// The instant of a stamp; saturates at the ends of the range.
    #[inline]
    pub(super) fn time(&self, high: u32, low: u32) -> Timestamp {
        let ticks = u128::from(u64::from(high) << 32 | u64::from(low));
        let nanos = match self.unit {
            Unit::Nanos(nanos) => ticks * u128::from(nanos),
            Unit::PerNano(ticks_per_nano) => ticks / ticks_per_nano,
            Unit::Binary(exponent) => (ticks * NANOS_PER_SECOND as u128) >> exponent,
        };
        Timestamp(i64::try_from(nanos).unwrap_or(i64::MAX)) + self.offset_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(tsresol: u8, offset_s: i64, ticks: u64) -> i64 {
        let clock = Clock::new(tsresol, offset_s);
        clock.time((ticks >> 32) as u32, ticks as u32).0
    }

    #[test]
    fn resolutions_of_base_ten_and_two() {
        assert_eq!(time(6, 0, 1_700_000_000_123_456), 1_700_000_000_123_456_000);
        assert_eq!(
            time(9, 0, 1_700_000_000_123_456_789),
            1_700_000_000_123_456_789
        );
        assert_eq!(time(0, 0, 1_700_000_000), 1_700_000_000 * NANOS_PER_SECOND);
        assert_eq!(time(12, 0, 5_123_999), 5_123);
        // Half a second in units of 2^-20 s.
        assert_eq!(time(0x80 | 20, 0, 1 << 19), 500_000_000);
    }

    #[test]
    fn offsets_are_added_in_seconds() {
        assert_eq!(time(6, -3, 5_000_000), 2 * NANOS_PER_SECOND);
    }

    #[test]
    fn absurd_resolutions_saturate() {
        for tsresol in 0..=255 {
            for offset_s in [i64::MIN, 0, i64::MAX] {
                time(tsresol, offset_s, u64::MAX);
            }
        }
        assert_eq!(time(0, i64::MAX, u64::MAX), i64::MAX);
        assert_eq!(time(127, 0, u64::MAX), 0);
    }
}
