//! Rows of Velodyne.

use super::{Proof, Row, row};

const RETURNS: &str = "strongest, last, dual";
const TABLE: &str = "YAML or XML; else the drawing's table";

/// The models.
pub static ROWS: &[Row] = &[
    row(
        "vlp16",
        "product byte 22; or 21 with a packet period of 1327 or 664 us (firmware of 2014)",
        RETURNS,
        TABLE,
        Proof::RealPackets(
            "velodyne-decoder 3.1.0, single and dual return, within 1 mm + 1.8e-4 of the range (it rounds azimuths to 0.01 degree)",
        ),
    ),
    row(
        "puck-lite",
        "cannot be told from `vlp16`: only when it is named",
        RETURNS,
        TABLE,
        Proof::Sibling("vlp16"),
    ),
    row(
        "vlp16-hires",
        "product byte 24",
        RETURNS,
        TABLE,
        Proof::Sibling("vlp16"),
    ),
    row(
        "hdl32e",
        "product byte 21, or none, with a packet period of 553 or 276 us",
        RETURNS,
        TABLE,
        Proof::RealPackets(
            "velodyne-decoder 3.1.0, single return, within 1 mm + 1.8e-4 of the range",
        ),
    ),
    row(
        "vlp32c",
        "product byte 28",
        RETURNS,
        TABLE,
        Proof::RealPackets(
            "velodyne-decoder 3.1.0, single return, limited field of view: range and height within 1 mm, azimuth within 0.15 degrees but for the five packets that span the gap, where that decoder takes the gap for rotation",
        ),
    ),
    row(
        "vlp32a",
        "product byte 23",
        RETURNS,
        TABLE,
        Proof::RoundTrip,
    ),
    row(
        "vls128",
        "product byte A1",
        RETURNS,
        TABLE,
        Proof::RealPackets(
            "velodyne-decoder 3.1.0, single return: range and height within 1 mm, azimuth within 0.15 degrees but for the first packet, whose rate that decoder does not know",
        ),
    ),
    row(
        "hdl64e",
        "flags `FF EE`, `FF DD` in turn, packet period 346 or 173 us",
        "strongest, dual by equal azimuths",
        "YAML, XML or the calibration in the packets; else refused",
        Proof::RoundTrip,
    ),
    row(
        "hdl64e-s2",
        "the same, packet period 288 us",
        "strongest",
        "as `hdl64e`",
        Proof::RoundTrip,
    ),
];
