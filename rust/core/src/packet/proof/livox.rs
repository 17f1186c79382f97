//! Rows of Livox.

use super::{Proof, Row, row};

/// The models.
pub static ROWS: &[Row] = &[
    row(
        "mid40",
        "first protocol, types 0 and 1, 1000 us between packets; one head of a Mid-100 is one",
        "one (which, the packets do not tell)",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "mid70",
        "first protocol, types 2 to 8, 960 us between packets (480 us with two returns)",
        "one; first, second; first, second, last",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "avia",
        "first protocol, types 2 to 8, 400 us between packets (200 us, 125 us with two, three returns); a Horizon or Tele-15 looks the same",
        "one; first, second; first, second, last",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "horizon",
        "cannot be told from `avia`: only when it is named",
        "as `avia`",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "tele15",
        "cannot be told from `avia`: only when it is named",
        "as `avia`",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "mid360",
        "second protocol, 5 us between points",
        "one (which, the packets do not tell); two",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "hap",
        "second protocol, 2.2 us between points",
        "one (which, the packets do not tell); two",
        "done in the sensor",
        Proof::RoundTrip,
    ),
];
