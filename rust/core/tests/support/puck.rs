//! A VLP-16 that fires on a timetable: every shot's time and azimuth are known.
#![allow(dead_code)] // each test crate uses a part of it

use std::net::SocketAddr;

use lidar_deflect_core::capture::Datagram;
use lidar_deflect_core::packet::ReturnMode;
use lidar_deflect_core::packet::velodyne::puck::{BLOCK_NS, FIRING_NS, LASER_NS, PRODUCT_VLP16};
use lidar_deflect_core::packet::velodyne::{BLOCKS, RawBlock, RawReturn, encode};
use lidar_deflect_core::stream::{Scan, ScanOptions, ScanReport, SweepOptions, SweepReader};
use lidar_deflect_core::sweep::Sweep;
use lidar_deflect_core::time::Timestamp;

pub const START_NS: i64 = 1_718_000_000_000_000_000;
const HOUR_US: i64 = 3_600_000_000;

/// How the sensor is set.
#[derive(Debug, Clone)]
pub struct Puck {
    pub source: SocketAddr,
    pub product: u8,
    pub mode: ReturnMode,
    pub turns_per_s: f64,
    /// Azimuths that it sends, degrees, start and width.
    pub view_deg: (f64, f64),
    /// UTC of its first shot.
    pub start_ns: i64,
    /// UTC minus device time at the start, and how it grows.
    pub offset_ns: i64,
    pub drift_ppm: i64,
    /// The device clock is set forward by so much after so many packets.
    pub jump: Option<(usize, i64)>,
}

impl Default for Puck {
    fn default() -> Self {
        Self {
            source: "192.168.1.201:2368".parse().unwrap(),
            product: PRODUCT_VLP16,
            mode: ReturnMode::Strongest,
            turns_per_s: 10.0,
            view_deg: (0.0, 360.0),
            start_ns: START_NS,
            offset_ns: 0,
            drift_ppm: 0,
            jump: None,
        }
    }
}

/// A datagram on its way.
#[derive(Debug, Clone, PartialEq)]
pub struct Sent {
    pub arrival_ns: i64,
    pub source: SocketAddr,
    pub port: u16,
    pub payload: Vec<u8>,
}

impl Puck {
    /// Encoder azimuth at a time since the start, degrees, counted on over the turns.
    pub fn azimuth_deg(&self, elapsed_ns: i64) -> f64 {
        37.0 + 360.0 * self.turns_per_s * elapsed_ns as f64 / 1e9
    }

    fn sees(&self, elapsed_ns: i64) -> bool {
        (self.azimuth_deg(elapsed_ns) - self.view_deg.0).rem_euclid(360.0) < self.view_deg.1
    }

    /// Range of every shot of a row of firings: it tells which one it was.
    pub fn range_units(row: i64) -> u16 {
        (1_000 + row % 60_000) as u16
    }

    /// Packets that the sensor fills with rows of firings until `seconds` are over.
    pub fn packets(&self, seconds: f64) -> Vec<Sent> {
        let rows = (seconds * 1e9 / BLOCK_NS as f64) as i64;
        let seen: Vec<i64> = (0..rows).filter(|row| self.sees(row * BLOCK_NS)).collect();
        let stride = if self.mode == ReturnMode::Dual { 2 } else { 1 };
        let packets = seen.chunks_exact(BLOCKS / stride);
        packets
            .enumerate()
            .map(|(number, rows)| self.packet(number, rows, stride))
            .collect()
    }

    fn packet(&self, number: usize, rows: &[i64], stride: usize) -> Sent {
        let mut blocks = [RawBlock::default(); BLOCKS];
        for (block, place) in blocks.iter_mut().zip(0..) {
            let row = rows[place / stride];
            let azimuth = self.azimuth_deg(row * BLOCK_NS) * 100.0;
            block.azimuth_centideg = azimuth.round().rem_euclid(36_000.0) as u16 % 36_000;
            block.returns = [RawReturn {
                range: Self::range_units(row),
                intensity: (row % 100) as u8,
            }; 32];
            if place % 2 == 1 && stride == 2 {
                // The second return differs on every fourth channel and is missing on another.
                for (channel, echo) in block.returns.iter_mut().enumerate() {
                    match channel % 4 {
                        1 => echo.range -= 100,
                        2 => *echo = RawReturn::default(),
                        _ => {}
                    }
                }
            }
        }
        let first_ns = rows[0] * BLOCK_NS;
        let device_us = self
            .device_ns(number, first_ns)
            .div_euclid(1000)
            .rem_euclid(HOUR_US);
        let end_ns = rows[rows.len() - 1] * BLOCK_NS + BLOCK_NS;
        let jitter_ns = (number as i64).wrapping_mul(7919) % 300_000;
        Sent {
            arrival_ns: self.start_ns + end_ns + 50_000 + jitter_ns.abs(),
            source: self.source,
            port: 2368,
            payload: encode(&blocks, device_us as u32, self.mode, self.product).to_vec(),
        }
    }

    fn device_ns(&self, number: usize, elapsed_ns: i64) -> i64 {
        let jump_ns = self
            .jump
            .filter(|(at, _)| number >= *at)
            .map_or(0, |(_, by)| by);
        let drift_ns = elapsed_ns / 1_000_000 * self.drift_ppm;
        self.start_ns + elapsed_ns - self.offset_ns - drift_ns + jump_ns
    }

    /// Time of a shot after the start, from its range, ring and firing within the row.
    pub fn shot_ns(row: i64, firing: i64, laser: i64) -> i64 {
        row * BLOCK_NS + firing * FIRING_NS + laser * LASER_NS
    }
}

pub fn datagram(sent: &Sent) -> Datagram<'_> {
    Datagram {
        time: Timestamp(sent.arrival_ns),
        source: sent.source,
        destination: SocketAddr::new("192.168.1.100".parse().unwrap(), sent.port),
        payload: &sent.payload,
        record: 0,
        offset: 0,
    }
}

/// Arrivals in the order of their time.
pub fn in_order(mut sent: Vec<Sent>) -> Vec<Sent> {
    sent.sort_by_key(|packet| packet.arrival_ns);
    sent
}

pub fn scan(sent: &[Sent], options: ScanOptions) -> ScanReport {
    let mut scan = Scan::new(options);
    sent.iter().for_each(|packet| scan.push(&datagram(packet)));
    scan.finish()
}

pub fn sweeps(sent: &[Sent], report: &ScanReport, options: &SweepOptions) -> Vec<Sweep> {
    let mut reader = SweepReader::new(report, options).unwrap();
    sent.iter()
        .for_each(|packet| reader.push(&datagram(packet)));
    reader.finish();
    std::iter::from_fn(|| reader.pop()).collect()
}

/// Scan and sweeps with nothing asked for.
pub fn read(sent: &[Sent]) -> (ScanReport, Vec<Sweep>) {
    let report = scan(sent, ScanOptions::default());
    let sweeps = sweeps(sent, &report, &SweepOptions::default());
    (report, sweeps)
}
