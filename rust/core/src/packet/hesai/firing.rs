//! Files of firing times, as the maker issues them for its models.
//!
//! | model | columns | unit |
//! |---|---|---|
//! | most | channel, time | microseconds |
//! | QT128 | channel and time of each loop | microseconds |
//! | ATX | channel, time in even frames, time in odd ones | nanoseconds |
//! | OT128 | channel, a time for each mode and state of the azimuth | microseconds |
//! | Pandar128E3X, Pandar90E3X | the same for far and for near targets | nanoseconds |
//!
//! A file has to have a column for each way in which the model fires: one that has fewer is another model's.

use super::text::Table;
use super::unit::FireTimes;
use crate::error::UnitError;
use crate::packet::unit::UnitFile;

/// What a file of firing times tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Firing {
    /// Times of each way to fire, ns.
    pub times: Vec<FireTimes>,
    /// Targets nearer than this have the times for near ones.
    pub near_m: Option<f64>,
}

/// Whether these first lines of a file, in lower case, are of firing times.
pub fn is_head(head: &[String]) -> bool {
    let words = [
        "fire time",
        "fire_time",
        "firetime",
        "distance>=",
        "operational state",
    ];
    let has = |word: &&str| head.iter().any(|line| line.contains(*word));
    words.iter().any(has)
}

/// Reads the firing times of a model with so many channels and ways to fire.
///
/// # Errors
/// [`UnitError`] for a file of another shape, or with wrong content.
pub fn read(file: &UnitFile, channels: usize, ways: usize) -> Result<Firing, UnitError> {
    let refuse = || file.refuse(None, "a header line", "none");
    let table = Table::new(file).ok_or_else(refuse)?;
    let columns = columns(&table);
    if columns.len() != ways {
        let (wanted, found) = (
            format!("{ways} columns of firing times"),
            columns.len().to_string(),
        );
        return Err(file.refuse(None, wanted, found));
    }
    // Channels that do not fire in a loop have no row.
    if !is_loops(&table) && table.count() < channels {
        let (wanted, found) = (format!("{channels} channels"), table.count().to_string());
        return Err(file.refuse(None, wanted, found));
    }
    let near_m = near_m(file);
    let is_nanos = near_m.is_some() || table.names.iter().any(|name| name.contains("(ns)"));
    let scale = if is_nanos { 1.0 } else { 1000.0 };
    let time = |value: Option<f64>| value.map(|value| value * scale);
    let times = columns.into_iter().map(|(key, value)| {
        let values = table.column(file, key, value, channels)?;
        Ok(values.into_iter().map(time).collect())
    });
    let times = times.collect::<Result<_, UnitError>>()?;
    Ok(Firing { times, near_m })
}

fn is_loops(table: &Table) -> bool {
    table.names[0].starts_with("loop")
}

/// Places of channel and time of each way to fire.
fn columns(table: &Table) -> Vec<(usize, usize)> {
    let count = table.names.iter().rposition(|name| !name.is_empty());
    let count = count.map_or(0, |last| last + 1);
    if is_loops(table) {
        return (0..count / 2)
            .map(|pair| (2 * pair, 2 * pair + 1))
            .collect();
    }
    (1..count).map(|value| (0, value)).collect()
}

/// The first cell of a file that tells far from near targets.
fn near_m(file: &UnitFile) -> Option<f64> {
    let text = file.text()?;
    let first = text
        .lines()
        .next()
        .filter(|line| line.contains("distance>="))?;
    let digits = first.split(',').next()?;
    let digits: String = digits
        .chars()
        .filter(|c| c.is_ascii_digit() || *c == '.')
        .collect();
    digits
        .parse()
        .ok()
        .filter(|metres| (0.0..100.0).contains(metres))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, ways: usize) -> Result<Firing, String> {
        let file = UnitFile::new("times", text);
        let head: Vec<String> = text.lines().take(4).map(str::to_ascii_lowercase).collect();
        assert!(is_head(&head), "{text}");
        read(&file, 2, ways).map_err(|error| error.to_string())
    }

    #[test]
    fn one_column_is_in_microseconds() {
        let firing = of(
            "\u{feff}Channel,fire time(\u{3bc}s)\r\n2,-4.5\r\n1,3\r\n",
            1,
        )
        .unwrap();
        assert_eq!(firing.times, [[Some(3000.0), Some(-4500.0)]]);
        assert_eq!(
            of("channel,firetime/us\n1,95.18\n2,23.24\n", 1)
                .unwrap()
                .times[0][0],
            Some(95_180.0)
        );
    }

    #[test]
    fn loops_have_channels_of_their_own() {
        let text = "EEFF,1,1,\nHorizontal,1,LoopNum,2\nLoop1,Firetime1,Loop2,Firetime2\n2,0.6,1,1.5\n0,0,0,0\n";
        let firing = of(text, 2).unwrap();
        assert_eq!(firing.times, [[None, Some(600.0)], [Some(1500.0), None]]);
    }

    #[test]
    fn even_and_odd_frames_are_in_nanoseconds() {
        let text = "Channel,Even_fire time(ns),Odd_fire time(ns)\r\n1,4960,4970\r\n2,5480,0\r\n";
        let firing = of(text, 2).unwrap();
        assert_eq!(
            firing.times,
            [[Some(4960.0), Some(5480.0)], [Some(4970.0), Some(0.0)]]
        );
    }

    #[test]
    fn modes_and_states_have_a_column_each() {
        let text = "Operational State,0,2\r\nAzimuth State,0,1\r\n1,-,18.867\r\n2,6.289,0\r\n";
        assert_eq!(
            of(text, 2).unwrap().times,
            [[None, Some(6289.0)], [Some(18_867.0), Some(0.0)]]
        );
    }

    #[test]
    fn far_and_near_targets_have_a_column_each() {
        let text = "\u{feff}2.85,distance>=A1,distance<A1\r\noperation mode,0,0\r\nangle state,0,0\r\n1,4436,5201\r\n2,0,0\r\n";
        let firing = of(text, 2).unwrap();
        assert_eq!(
            firing.times,
            [[Some(4436.0), Some(0.0)], [Some(5201.0), Some(0.0)]]
        );
        assert_eq!(firing.near_m, Some(2.85));
    }

    #[test]
    fn a_file_of_another_shape_is_refused() {
        let one = "Channel,fire time(us)\n1,3\n2,4\n";
        assert!(
            of(one, 2)
                .unwrap_err()
                .contains("2 columns of firing times")
        );
        assert!(
            of("Channel,fire time(us)\n1,3\n", 1)
                .unwrap_err()
                .contains("2 channels")
        );
        assert!(
            of("Channel,fire time(us)\n1,3\n3,4\n", 1)
                .unwrap_err()
                .contains("from 1 to 2")
        );
    }
}
