//! The six bytes and the microseconds that tell when a packet was made.

use crate::time::{NANOS_PER_SECOND, Timestamp};

/// Seconds of a day.
const DAY_S: i64 = 86_400;

/// UTC of six date bytes and microseconds.
///
/// A first byte of 0 marks a time from PTP: big-endian seconds since 1970 follow. Else it is the year:
/// below 70 since 2000, from there on since 1900. Values that no calendar has are taken as they are.
pub fn utc(bytes: [u8; 6], micros: u32) -> Timestamp {
    let [year, rest @ ..] = bytes;
    let seconds = if year == 0 {
        rest.iter().fold(0, |sum, byte| sum << 8 | i64::from(*byte))
    } else {
        let [month, day, hour, minute, second] = rest.map(i64::from);
        let year = i64::from(year) + if year < 70 { 2000 } else { 1900 };
        days(year, month, day) * DAY_S + hour * 3600 + minute * 60 + second
    };
    Timestamp(
        seconds
            .saturating_mul(NANOS_PER_SECOND)
            .saturating_add(i64::from(micros) * 1000),
    )
}

/// Date bytes and microseconds of an instant: the inverse of [`utc`], in the calendar form.
pub fn bytes(time: Timestamp) -> ([u8; 6], u32) {
    let micros = time.0.div_euclid(1000);
    let seconds = micros.div_euclid(1_000_000);
    let (year, month, day) = civil(seconds.div_euclid(DAY_S));
    let of_day = seconds.rem_euclid(DAY_S);
    let numbers = [
        year - 1900,
        month,
        day,
        of_day / 3600,
        of_day / 60 % 60,
        of_day % 60,
    ];
    (
        numbers.map(|number| number.clamp(0, 255) as u8),
        micros.rem_euclid(1_000_000) as u32,
    )
}

/// Nanoseconds since 1970 of a year and month, day, hour, minute, second; missing ones count as 0.
pub fn calendar_ns(year: i64, rest: &[u8]) -> i64 {
    let number = |place: usize| rest.get(place).map_or(0, |byte| i64::from(*byte));
    let seconds =
        days(year, number(0), number(1)) * DAY_S + number(2) * 3600 + number(3) * 60 + number(4);
    seconds.saturating_mul(NANOS_PER_SECOND)
}

/// Days since 1970 of a date of the Gregorian calendar; March is the first month of its year.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let year = year - i64::from(month <= 2);
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * (month + if month > 2 { -3 } else { 9 }) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// Year, month and day of a day since 1970.
fn civil(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let of_era = days.rem_euclid(146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (year + era * 400 + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_forms_of_the_date_are_told_apart() {
        // 2017-09-06 14:33:38, as a Pandar40P writes it.
        assert_eq!(
            utc([17, 9, 6, 14, 33, 38], 898_262).0,
            1_504_708_418_898_262_000
        );
        // 2020-01-16, as a Pandar64 does.
        assert_eq!(utc([120, 1, 16, 0, 0, 0], 0).0, 1_579_132_800_000_000_000);
        assert_eq!(
            utc([0, 0, 0x65, 0x92, 0, 0x80], 1).0,
            1_704_067_200_000_001_000
        );
    }

    #[test]
    fn what_is_written_is_read_over_leap_days_and_ends_of_years() {
        for days in [
            0, 59, 10_956, 11_016, 18_321, 19_723, 20_088, 20_089, 47_540,
        ] {
            let time = Timestamp((days * DAY_S + 86_399) * NANOS_PER_SECOND + 999_999_000);
            let (date, micros) = bytes(time);
            assert_eq!(utc(date, micros), time, "day {days}: {date:?}");
        }
    }

    #[test]
    fn no_bytes_overflow() {
        utc([255; 6], u32::MAX);
        utc([0, 255, 255, 255, 255, 255], u32::MAX);
        utc([1, 0, 0, 255, 255, 255], 0);
    }
}
