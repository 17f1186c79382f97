//! Data packets of every Velodyne and Hesai model, made from numbers.
#![allow(dead_code)] // each test crate uses a part of it

use lidar_deflect_core::packet::echoes::RawEcho;
use lidar_deflect_core::packet::hesai::layout::{RawBlock, RawPacket};
use lidar_deflect_core::packet::hesai::rotating::{Family, Rotating};
use lidar_deflect_core::packet::hesai::{at128, atx, ft120, jt16, pandar, pandar128, qt128, xt};
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::velodyne::{self, BLOCKS, CHANNELS};
use lidar_deflect_core::packet::{ModelRef, ReturnMode, model};
use lidar_deflect_core::time::Timestamp;

/// Writes a packet.
pub type Encode = Box<dyn Fn(&RawPacket) -> Vec<u8>>;

/// A model with what writes its packets.
pub struct Writer {
    pub model: ModelRef,
    /// Blocks of a packet, and channels of a block.
    pub size: (usize, usize),
    /// Modes that the packets can tell.
    pub modes: &'static [ReturnMode],
    pub encode: Encode,
}

const SINGLE: &[ReturnMode] = &[ReturnMode::Strongest];
const VELODYNE: &[ReturnMode] = &[ReturnMode::Strongest, ReturnMode::Last, ReturnMode::Dual];
const HESAI: &[ReturnMode] = &[
    ReturnMode::Strongest,
    ReturnMode::Last,
    ReturnMode::First,
    ReturnMode::Second,
    ReturnMode::Dual,
    ReturnMode::FirstSecond,
    ReturnMode::FirstLast,
    ReturnMode::FirstStrongest,
    ReturnMode::StrongestSecond,
];
const XT32M: &[ReturnMode] = &[ReturnMode::Strongest, ReturnMode::Dual, ReturnMode::Triple];

fn hesai<F: Family>(
    rotating: &'static Rotating<F>,
    size: (usize, usize),
    modes: &'static [ReturnMode],
) -> Writer {
    Writer {
        model: rotating,
        size,
        modes,
        encode: Box::new(|packet| rotating.encode(packet)),
    }
}

fn velodyne(id: &str, product: u8, banks: &'static [u8], modes: &'static [ReturnMode]) -> Writer {
    Writer {
        model: model(id).unwrap(),
        size: (BLOCKS, CHANNELS),
        modes,
        encode: Box::new(move |packet| velodyne_packet(packet, product, banks).to_vec()),
    }
}

fn velodyne_packet(packet: &RawPacket, product: u8, banks: &[u8]) -> [u8; velodyne::LEN] {
    let blocks = std::array::from_fn(|number| {
        // In dual return a bank comes twice, on the VLS-128 in neighbouring blocks.
        let stride = if banks.len() == 4 {
            packet.return_mode.returns()
        } else {
            1
        };
        let block = &packet.blocks[number];
        velodyne::RawBlock {
            bank: banks[number / stride % banks.len()],
            azimuth_centideg: block.azimuth,
            returns: std::array::from_fn(|channel| block.echoes[channel]),
        }
    });
    let micros = (packet.time.0 / 1000).rem_euclid(3_600_000_000) as u32;
    velodyne::encode(&blocks, micros, packet.return_mode, product)
}

/// Every model of both families.
pub fn writers() -> Vec<Writer> {
    vec![
        velodyne("vlp16", 0x22, &[0], VELODYNE),
        velodyne("vlp16-hires", 0x24, &[0], VELODYNE),
        velodyne("hdl32e", 0x21, &[0], VELODYNE),
        velodyne("vlp32c", 0x28, &[0], VELODYNE),
        velodyne("vlp32a", 0x23, &[0], VELODYNE),
        velodyne("vls128", 0xA1, &[0, 1, 2, 3], VELODYNE),
        velodyne("hdl64e-s2", b'x', &[0, 1], SINGLE),
        velodyne("hdl64e", b'x', &[0, 1], SINGLE),
        hesai(&pandar::PANDAR40P, (10, 40), HESAI),
        hesai(&pandar::PANDAR40AC, (10, 40), HESAI),
        hesai(&pandar::PANDAR64, (6, 64), HESAI),
        hesai(&xt::XT16, (8, 16), HESAI),
        hesai(&xt::XT32, (8, 32), HESAI),
        hesai(&xt::XT32M2X, (6, 32), XT32M),
        hesai(&xt::QT64, (4, 64), HESAI),
        hesai(&qt128::QT128, (2, 128), HESAI),
        hesai(&pandar128::PANDAR128, (2, 128), HESAI),
        hesai(&pandar128::PANDAR90, (2, 90), HESAI),
        hesai(&pandar128::OT128, (2, 128), HESAI),
        hesai(&pandar128::JT128, (2, 128), HESAI),
        hesai(&at128::AT128, (2, 128), HESAI),
        hesai(&atx::ATX, (2, 100), HESAI),
        hesai(&jt16::JT16, (1, 16), SINGLE),
        Writer {
            model: &ft120::FT120,
            size: (1, 120),
            modes: SINGLE,
            encode: Box::new(ft120::encode),
        },
    ]
}

/// A calibration for the models that give no points without one: flat, lasers a degree apart.
pub fn unit_files(id: &str) -> Vec<UnitFile> {
    if !id.starts_with("hdl64e") {
        return Vec::new();
    }
    let laser = |number: usize| {
        let elevation_rad = (number as f64 - 32.0).to_radians();
        format!("- {{laser_id: {number}, vert_correction: {elevation_rad}, focal_distance: 0}}\n")
    };
    let lasers: String = (0..64).map(laser).collect();
    vec![UnitFile::new("unit.yaml", format!("lasers:\n{lasers}"))]
}

/// Blocks of one firing share an azimuth, `step` further than the firing before.
pub fn blocks(
    size: (usize, usize),
    mode: ReturnMode,
    azimuth: impl Fn(usize) -> u16,
    echo: impl Fn(usize, usize) -> RawEcho,
) -> Vec<RawBlock> {
    let block = |number: usize| RawBlock {
        azimuth: azimuth(number / mode.returns()),
        fine: 0,
        echoes: (0..size.1).map(|channel| echo(number, channel)).collect(),
    };
    (0..size.0).map(block).collect()
}

/// 2024-06-10 06:13:20.5 UTC.
pub const START: Timestamp = Timestamp(1_718_000_000_500_000_000);
/// Hundredths of a degree from one firing to the next.
const STEP: u16 = 20;

/// A packet with an echo wherever `echo` says so.
pub fn packet(
    writer: &Writer,
    mode: ReturnMode,
    number: u32,
    echo: impl Fn(usize, usize) -> RawEcho,
) -> RawPacket {
    let firings = (writer.size.0 / mode.returns()) as u32;
    let azimuth = |firing: usize| match writer.model.id() {
        "ft120" => (number % 160) as u16,
        _ => ((number * firings + firing as u32) * u32::from(STEP) % 36_000) as u16,
    };
    let period_ns = writer.model.period_ns(mode);
    RawPacket {
        time: START + i64::from(number) * period_ns / 1000 * 1000,
        sequence: number.wrapping_add(u32::MAX - 40),
        return_mode: mode,
        rpm: 600.0,
        operation: 0,
        azimuth_state: 0,
        blocks: blocks(writer.size, mode, azimuth, echo),
    }
}
