//! Packets of the Leishen models, made from numbers, and what is read of them.
#![allow(dead_code)] // each test crate uses a part of it

use lidar_deflect_core::capture::Datagram;
use lidar_deflect_core::cloud::Return;
use lidar_deflect_core::packet::leishen::ch::{Ch, RawPacket as ChPacket, Record};
use lidar_deflect_core::packet::leishen::cx::{Cx, RawPacket};
use lidar_deflect_core::packet::leishen::products::PRODUCTS;
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::velodyne::{BLOCKS, RawBlock, RawReturn};
use lidar_deflect_core::packet::{Decoded, Model, Place, ReturnMode};
use lidar_deflect_core::stream::{Scan, ScanOptions, ScanReport};
use lidar_deflect_core::time::Timestamp;

/// 2024-06-10 06:13:59.9 UTC: the second, the minute and, for a short CH packet, the clock turn over soon.
pub const START_NS: i64 = 1_718_000_039_900_000_000;
pub const MODES: [ReturnMode; 3] = [ReturnMode::Strongest, ReturnMode::Last, ReturnMode::Dual];

pub fn lasers(model: &Cx) -> usize {
    let product = PRODUCTS.iter().find(|product| product.id == model.id());
    product.unwrap().elevation_deg.len()
}

/// Blocks 0.36 degree apart from an azimuth on; blocks of a pair share theirs.
pub fn blocks(
    first: u32,
    mode: ReturnMode,
    echo: impl Fn(usize, usize) -> RawReturn,
) -> [RawBlock; BLOCKS] {
    std::array::from_fn(|block| {
        let row = block / mode.returns();
        RawBlock {
            bank: 0,
            azimuth_centideg: ((first + 36 * row as u32) % 36_000) as u16,
            returns: std::array::from_fn(|channel| echo(block, channel)),
        }
    })
}

pub fn steady(block: usize, channel: usize) -> RawReturn {
    RawReturn {
        range: (2_000 + 40 * block + 7 * channel) as u16,
        intensity: channel as u8,
    }
}

/// The packet with a number: ten turns a second at 0.36 degree and 100 us a block, for every model.
pub fn cx_packet(model: &Cx, mode: ReturnMode, number: i64, period_ns: i64) -> Vec<u8> {
    let rows = (BLOCKS / mode.returns()) as i64;
    model.encode(&RawPacket {
        time_ns: START_NS + (number + 1) * period_ns,
        is_ptp: false,
        mode,
        blocks: blocks((number * rows * 36 % 36_000) as u32, mode, steady),
    })
}

pub fn ch_packet(model: &Ch, lines: usize, is_double: bool, number: usize) -> Vec<u8> {
    let count = if is_double { 109 } else { 171 };
    let record = |place: usize| {
        let shot = number * count + place;
        // A frame of 12 000 shots from 30 to 150 degrees.
        let azimuth = 3_000 + shot % 12_000;
        (!shot.is_multiple_of(12_000)).then(|| Record {
            line: ((lines - 1 + shot) % lines) as u8,
            azimuth: azimuth as u16,
            echoes: [
                (256_000 + shot as u32 % 7_000, shot as u8),
                (
                    if is_double { 300_000 } else { 0 },
                    if is_double { 9 } else { 0 },
                ),
            ],
        })
    };
    model.encode(&ChPacket {
        time_ns: START_NS + (number as i64 + 1) * 225_000,
        is_double,
        is_ptp: false,
        records: (0..count).map(record).collect(),
    })
}

/// Points of a packet, and how many were merged.
pub struct Points {
    pub returns: Vec<Return>,
    pub merged: u64,
}

pub fn decode(model: &dyn Model, files: &[UnitFile], payload: &[u8]) -> Points {
    let mut out = Decoded::default();
    let place = Place {
        time: Timestamp(model.head(payload).unwrap().device_ns),
        packet: 7,
        mean_rate_rad_per_ns: 0.0,
    };
    model
        .fit(files)
        .unwrap()
        .decoder
        .decode(payload, place, &mut out);
    Points {
        returns: out.cloud.iter().collect(),
        merged: out.merged,
    }
}

pub fn scan(sent: &[(i64, Vec<u8>)], other: &[(i64, Vec<u8>)]) -> ScanReport {
    let mut scan = Scan::new(ScanOptions::default());
    let mut all: Vec<(i64, u16, &[u8])> =
        sent.iter().map(|(t, p)| (*t, 2368, p.as_slice())).collect();
    all.extend(other.iter().map(|(t, p)| (*t, 2369, p.as_slice())));
    all.sort_by_key(|(time_ns, ..)| *time_ns);
    for (time_ns, port, payload) in all {
        scan.push(&Datagram {
            time: Timestamp(time_ns),
            source: "192.168.1.200:2368".parse().unwrap(),
            destination: format!("192.168.1.102:{port}").parse().unwrap(),
            payload,
            record: 0,
            offset: 0,
        });
    }
    scan.finish()
}
