//! Rows of Hesai.

use super::{Proof, Row, row};

const RETURNS: &str = "one; two in every combination";
const CSV: &str = "angle CSV, firing times CSV; else nominal";

/// The models.
pub static ROWS: &[Row] = &[
    row(
        "pandar40p",
        "1262 or 1266 bytes, `FF EE` every 124",
        RETURNS,
        CSV,
        Proof::RealPackets(
            "HesaiLidar_SDK_2.0, last return at 1200 rpm, within 0.1 mm + 2e-6 of the range",
        ),
    ),
    row(
        "pandar40ac",
        "1256 bytes, `FF EE` every 124",
        RETURNS,
        CSV,
        Proof::Sibling("pandar40p"),
    ),
    row(
        "pandar64",
        "1194 or 1198 bytes, `EE FF 40 06`; 1388 or 1392, `EE FF 40 07`",
        RETURNS,
        CSV,
        Proof::RealPackets("HesaiLidar_SDK_2.0, dual return, within 0.1 mm + 2e-6 of the range"),
    ),
    row(
        "xt16",
        "protocol 6.1, 8 blocks of 16",
        RETURNS,
        CSV,
        Proof::Sibling("xt32"),
    ),
    row(
        "xt32",
        "protocol 6.1, 8 blocks of 32",
        RETURNS,
        CSV,
        Proof::RealPackets("HesaiLidar_SDK_2.0, dual return, within 0.1 mm + 2e-6 of the range"),
    ),
    row(
        "xt32m2x",
        "protocol 6.1, 6 blocks of 32",
        "one, two, three",
        CSV,
        Proof::RoundTrip,
    ),
    row("qt64", "protocol 3.1", RETURNS, CSV, Proof::RoundTrip),
    row(
        "qt128",
        "protocol 3.2",
        RETURNS,
        "angle CSV, firing times CSV; else nominal; channel configuration CSV, without which blocks of fewer than 128 channels give no points",
        Proof::RealPackets(
            "HesaiLidar_SDK_2.0, dual return, within 0.1 mm + 2e-6 of the range; a choice of lasers round trip only",
        ),
    ),
    row(
        "pandar128",
        "protocol 1.4, 128 channels, status version below 128",
        RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "pandar90",
        "protocol 1.4, 90 channels",
        RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "ot128",
        "protocol 1.4, 128 channels, status version 128 to 136",
        RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "jt128",
        "protocol 1.4, 128 channels, status version from 137 on",
        RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "at128",
        "protocol 4.1 or 4.3",
        RETURNS,
        "binary file of the maker or angle CSV, firing times CSV; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "atx",
        "protocol 4.7, 100 channels",
        RETURNS,
        "binary file of the maker but for version 4.3, firing times CSV; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "ft120",
        "protocol 7.2",
        "one",
        "binary file of the maker; else a regular grid",
        Proof::RoundTrip,
    ),
    row(
        "jt16",
        "protocol 1.8",
        "one",
        "angle CSV; else nominal",
        Proof::RoundTrip,
    ),
];
