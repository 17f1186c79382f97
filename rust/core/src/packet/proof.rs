//! What is decoded of each model and how that was proven: the one table that the page of sensors is made of.

/// How well the points of a model are known to be right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// Points of real packets agree with an independent decoder's; says which packets and decoder.
    RealPackets(&'static str),
    /// Real packets of a sibling with the same layout and timing; only the angles are the model's own.
    Sibling(&'static str),
    /// Numbers that the manual works out for one point come out; the rest is round trip.
    WorkedExample(&'static str),
    /// What is written is read again; layout and tables come from manuals and the maker's programs.
    RoundTrip,
}

impl Proof {
    /// For the page.
    pub fn describe(self) -> String {
        match self {
            Self::RealPackets(what) => {
                format!("real packets against an independent decoder: {what}")
            }
            Self::Sibling(id) => format!(
                "round trip only; real packets of `{id}`, whose layout and timing it shares"
            ),
            Self::WorkedExample(what) => {
                format!("worked example of the manual: {what}; else round trip only")
            }
            Self::RoundTrip => "round trip only".into(),
        }
    }
}

/// One row.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Model.
    pub id: &'static str,
    /// How its packets are told from others.
    pub recognised: &'static str,
    /// Returns that are told apart.
    pub returns: &'static str,
    /// Files of a unit that are taken, and what happens without them.
    pub unit: &'static str,
    /// How it was proven.
    pub proof: Proof,
}

const VELODYNE_RETURNS: &str = "strongest, last, dual";
const HESAI_RETURNS: &str = "one; two in every combination";
const TABLE: &str = "YAML or XML; else the drawing's table";
const CSV: &str = "angle CSV, firing times CSV; else nominal";

const fn row(
    id: &'static str,
    recognised: &'static str,
    returns: &'static str,
    unit: &'static str,
    proof: Proof,
) -> Row {
    Row {
        id,
        recognised,
        returns,
        unit,
        proof,
    }
}

/// All models.
pub static ROWS: &[Row] = &[
    row(
        "vlp16",
        "product byte 22; or 21 with a packet period of 1327 or 664 us (firmware of 2014)",
        VELODYNE_RETURNS,
        TABLE,
        Proof::RealPackets(
            "velodyne-decoder 3.1.0, single and dual return, within 1 mm + 1.8e-4 of the range (it rounds azimuths to 0.01 degree)",
        ),
    ),
    row(
        "puck-lite",
        "cannot be told from `vlp16`: only when it is named",
        VELODYNE_RETURNS,
        TABLE,
        Proof::Sibling("vlp16"),
    ),
    row(
        "vlp16-hires",
        "product byte 24",
        VELODYNE_RETURNS,
        TABLE,
        Proof::Sibling("vlp16"),
    ),
    row(
        "hdl32e",
        "product byte 21, or none, with a packet period of 553 or 276 us",
        VELODYNE_RETURNS,
        TABLE,
        Proof::RealPackets(
            "velodyne-decoder 3.1.0, single return, within 1 mm + 1.8e-4 of the range",
        ),
    ),
    row(
        "vlp32c",
        "product byte 28",
        VELODYNE_RETURNS,
        TABLE,
        Proof::RealPackets(
            "velodyne-decoder 3.1.0, single return, limited field of view: range and height within 1 mm, azimuth within 0.15 degrees but for the five packets that span the gap, where that decoder takes the gap for rotation",
        ),
    ),
    row(
        "vlp32a",
        "product byte 23",
        VELODYNE_RETURNS,
        TABLE,
        Proof::RoundTrip,
    ),
    row(
        "vls128",
        "product byte A1",
        VELODYNE_RETURNS,
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
    row(
        "pandar40p",
        "1262 or 1266 bytes, `FF EE` every 124",
        HESAI_RETURNS,
        CSV,
        Proof::RealPackets(
            "HesaiLidar_SDK_2.0, last return at 1200 rpm, within 0.1 mm + 2e-6 of the range",
        ),
    ),
    row(
        "pandar40ac",
        "1256 bytes, `FF EE` every 124",
        HESAI_RETURNS,
        CSV,
        Proof::Sibling("pandar40p"),
    ),
    row(
        "pandar64",
        "1194 or 1198 bytes, `EE FF 40 06`",
        HESAI_RETURNS,
        CSV,
        Proof::RealPackets("HesaiLidar_SDK_2.0, dual return, within 0.1 mm + 2e-6 of the range"),
    ),
    row(
        "xt16",
        "protocol 6.1, 8 blocks of 16",
        HESAI_RETURNS,
        CSV,
        Proof::Sibling("xt32"),
    ),
    row(
        "xt32",
        "protocol 6.1, 8 blocks of 32",
        HESAI_RETURNS,
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
    row("qt64", "protocol 3.1", HESAI_RETURNS, CSV, Proof::RoundTrip),
    row(
        "qt128",
        "protocol 3.2",
        HESAI_RETURNS,
        CSV,
        Proof::RealPackets("HesaiLidar_SDK_2.0, dual return, within 0.1 mm + 2e-6 of the range"),
    ),
    row(
        "pandar128",
        "protocol 1.4, 128 channels, status version below 128",
        HESAI_RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "pandar90",
        "protocol 1.4, 90 channels",
        HESAI_RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "ot128",
        "protocol 1.4, 128 channels, status version 128 to 136",
        HESAI_RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "jt128",
        "protocol 1.4, 128 channels, status version from 137 on",
        HESAI_RETURNS,
        CSV,
        Proof::RoundTrip,
    ),
    row(
        "at128",
        "protocol 4.1 or 4.3",
        HESAI_RETURNS,
        "binary file of the maker; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "atx",
        "protocol 4.7, 100 channels",
        HESAI_RETURNS,
        "binary file of the maker but for version 4.3; else nominal",
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
    row(
        "ouster",
        "columns that follow each other in time and number; with its metadata by size, serial number and start number as well",
        "as the metadata say: one, two",
        "metadata JSON, flat or nested; without it no points",
        Proof::RealPackets(
            "ouster-sdk 1.0.1 on five captures (OS0, OS1, OS2; legacy, single, dual, low-data and safety profiles; two sensors on one port): every point within 0.01 mm + float32; RGB, zone and five-word profiles round trip only",
        ),
    ),
    row(
        "os0",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "os1",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "os2",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "osdome",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RoundTrip,
    ),
    row(
        "os0-32",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RealPackets("ouster-sdk 1.0.1, every point within 0.01 mm + float32"),
    ),
    row(
        "os0-64",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "os0-128",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RealPackets("ouster-sdk 1.0.1, every point within 0.01 mm + float32"),
    ),
    row(
        "os1-16",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "os1-32",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RealPackets("ouster-sdk 1.0.1, every point within 0.01 mm + float32"),
    ),
    row(
        "os1-64",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RealPackets("ouster-sdk 1.0.1, every point within 0.01 mm + float32"),
    ),
    row(
        "os1-128",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "os2-32",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "os2-64",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::Sibling("ouster"),
    ),
    row(
        "os2-128",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RealPackets("ouster-sdk 1.0.1, every point within 0.01 mm + float32"),
    ),
    row(
        "osdome-32",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RoundTrip,
    ),
    row(
        "osdome-64",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RoundTrip,
    ),
    row(
        "osdome-128",
        "as `ouster`, found through its metadata",
        "as `ouster`",
        "as `ouster`",
        Proof::RoundTrip,
    ),
    row(
        "helios32",
        "type 6, model 1; with no model (firmware of 2021) only when it is named",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "helios16p",
        "type 6, model 3; or no model (firmware of 2021): a `helios32` is a candidate then, unless the halves of blocks see the same",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RealPackets(
            "rs_driver 1.5.19, single return, within 1 mm + 1e-4 of the range; the header names no model, and the 32 angles that the unit describes speak for a Helios 32, for which the driver was not set",
        ),
    ),
    row(
        "helios32-31deg",
        "type 6, model 2",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "helios32-26deg",
        "type 6, model 4",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "rs16",
        "older header, type 1",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "rs32",
        "older header, type 2",
        "one, dual",
        "DIFOP packets; else those of a sample unit",
        Proof::RoundTrip,
    ),
    row(
        "bpearl",
        "older header, type 3",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "bpearl-v4",
        "older header, type 3, model 4",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "ruby-128",
        "type 4, 3 blocks of 128",
        "one, dual",
        "DIFOP packets; else no points",
        Proof::RoundTrip,
    ),
    row(
        "ruby-80",
        "type 4, 4 blocks of 80",
        "one, dual",
        "DIFOP packets; else no points",
        Proof::RoundTrip,
    ),
    row(
        "ruby-48",
        "type 4, 8 blocks of 48",
        "one, dual",
        "DIFOP packets; else no points",
        Proof::RoundTrip,
    ),
    row(
        "ruby-plus-128",
        "type 5, 3 blocks of 128",
        "one, dual",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "ruby-plus-80",
        "type 5, 4 blocks of 80; a Ruby Lite looks the same",
        "one, dual",
        "DIFOP packets; else no points",
        Proof::RoundTrip,
    ),
    row(
        "ruby-plus-48",
        "type 5, 8 blocks of 48; a Ruby Lite looks the same",
        "one, dual",
        "DIFOP packets; else no points",
        Proof::RoundTrip,
    ),
    row(
        "airy",
        "type 31 (hexadecimal)",
        "one, dual by equal azimuths",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "points",
        "clouds of a bag with a time per point; the project's own magic",
        "one",
        "none",
        Proof::RoundTrip,
    ),
    row(
        "fairy",
        "type 0A",
        "one, dual by equal azimuths",
        "DIFOP packets; else no points",
        Proof::RoundTrip,
    ),
    row(
        "c16",
        "1212 bytes, `FF EE` every 100, product byte 10",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c32",
        "1212 bytes, `FF EE` every 100, product byte 20",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c16-v3",
        "1206 bytes, `FF EE` every 100, product byte 10",
        VELODYNE_RETURNS,
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "c32-v3",
        "1206 bytes, `FF EE` every 100, product byte 20",
        VELODYNE_RETURNS,
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "c16-v5",
        "1212 bytes, `FF EE` every 100, product byte 65",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c32-v5",
        "1212 bytes, `FF EE` every 100, product byte 64",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "msc16",
        "1212 bytes, `FF EE` every 100, product byte 11",
        VELODYNE_RETURNS,
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "c16-domestic",
        "1212 bytes, `FF EE` every 100, product byte 12",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c32wp",
        "1212 bytes, `FF EE` every 100, product byte 45",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c32w",
        "1212 bytes, `FF EE` every 100, product byte 46",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c32wn",
        "1212 bytes, `FF EE` every 100, product byte 47",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c32wb",
        "1212 bytes, `FF EE` every 100, product byte 48",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "ch32r",
        "1212 bytes, `FF EE` every 100, product byte 5A",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "ch32rn",
        "1212 bytes, `FF EE` every 100, product byte 5D",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c8",
        "1212 bytes, `FF EE` every 100, product byte 08",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c8f",
        "1212 bytes, `FF EE` every 100, product byte 07",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "ckm8",
        "1212 bytes, `FF EE` every 100, product byte 09",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c1",
        "1212 bytes, `FF EE` every 100, product byte 01",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "c1-plus",
        "1212 bytes, `FF EE` every 100, product byte 03",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "n301",
        "1212 bytes, `FF EE` every 100, product byte 06",
        VELODYNE_RETURNS,
        "the maker's table; units are not measured one by one",
        Proof::RoundTrip,
    ),
    row(
        "ch128x1",
        "1206 bytes of 7 or 11 each, lines 64 to 127",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "cb64s1-a",
        "the same, lines up to 63",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "ch128s1",
        "1212 bytes of 7 or 11 each, lines 126 and 127",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "cx128s2",
        "cannot be told from `ch128s1`: only when it is named",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "cx126s3",
        "as `ch128s1`, lines 16 to 125",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "ch16x1",
        "as `ch128s1`, lines 6 to 15",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "cx6s3",
        "as `ch128s1`, lines up to 5",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "ch256",
        "as `ch128s1`, lines from 128 on",
        "one, two by distance",
        "DIFOP packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "rs-m1",
        "1210 bytes, `55 AA 5A A5`, type 10; an M1 Plus looks the same",
        "strongest, last, first; dual by the return number of a block",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "rs-m1-plus",
        "cannot be told from `rs-m1`: only when it is named",
        "as `rs-m1`",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "rs-m2",
        "1342 bytes, `55 AA 5A A5`",
        "strongest, last, first; dual by the return number of a block",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "rs-m3",
        "1448 bytes, `55 AA 5A A5`",
        "strongest, last, first",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "rs-mx",
        "1404 bytes, `55 AA 5A A5`",
        "strongest, last, first, dual",
        "done in the sensor",
        Proof::RoundTrip,
    ),
    row(
        "rs-e1",
        "1200 bytes, `55 AA 5A A5`, type 62",
        "strongest, last, first",
        "done in the sensor; DIFOP packets tell serial number and clock",
        Proof::RoundTrip,
    ),
    row(
        "rs-emx",
        "812 bytes, `55 AA 5A A5`, type 42",
        "strongest, last, first, dual (first, last)",
        "DIFOP2 packets; else nominal",
        Proof::RoundTrip,
    ),
    row(
        "rs-em4",
        "1084 bytes, `55 AA 5A A5`, type 70; packets of the compressed mode are not read",
        "strongest, last, first, dual (first, second)",
        "DIFOP2 packets; else no points",
        Proof::WorkedExample("yaw, pitch and time of one pixel of an EM4"),
    ),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::MODELS;

    #[test]
    fn every_model_has_one_row_and_every_row_a_model() {
        for model in MODELS {
            let rows = ROWS.iter().filter(|row| row.id == model.id());
            assert_eq!(rows.count(), 1, "{}", model.id());
        }
        assert_eq!(ROWS.len(), MODELS.len());
    }

    #[test]
    fn siblings_are_proven_on_real_packets() {
        for row in ROWS {
            if let Proof::Sibling(id) = row.proof {
                let sibling = ROWS.iter().find(|row| row.id == id).unwrap();
                assert!(matches!(sibling.proof, Proof::RealPackets(_)), "{id}");
            }
        }
    }
}
