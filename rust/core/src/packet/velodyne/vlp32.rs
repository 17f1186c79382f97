//! VLP-32C and the early VLP-32A and B: 32 lasers that fire in pairs, 2.304 us apart, every 55.296 us.
//!
//! Source: VLP-32C manual 63-9325. The timing of the early units is taken to be the same.

use super::CHANNELS;
use super::rows::Firing;
use super::table::Table;
use crate::packet::beams::{Beam, Beams};

/// Time from one pair of lasers to the next.
pub const PAIR_NS: i64 = 2_304;
/// Metres of one unit of range.
pub const RANGE_UNIT_M: f64 = 0.004;
/// Product byte of the VLP-32C.
pub const PRODUCT_VLP32C: u8 = 0x28;
/// Distance from the spin axis to where the beams cross.
const FOCAL_DISTANCE_M: f64 = 0.0424;

static FIRING: Firing = Firing {
    lasers: CHANNELS,
    firing_ns: 55_296,
    range_unit_m: RANGE_UNIT_M,
};

/// The VLP-32C.
pub static VLP32C: Vlp32 = Vlp32 {
    id: "vlp32c",
    title: "Velodyne VLP-32C",
    products: &[PRODUCT_VLP32C],
    elevation_deg: [
        -25.0, -1.0, -1.667, -15.639, -11.31, 0.0, -0.667, -8.843, -7.254, 0.333, -0.333, -6.148,
        -5.333, 1.333, 0.667, -4.0, -4.667, 1.667, 1.0, -3.667, -3.333, 3.333, 2.333, -2.667, -3.0,
        7.0, 4.667, -2.333, -2.0, 15.0, 10.333, -1.333,
    ],
    rotation_deg: [
        -1.4, 4.2, -1.4, 1.4, -1.4, 1.4, -4.2, 1.4, -1.4, 4.2, -1.4, 1.4, -4.2, 1.4, -4.2, 1.4,
        -1.4, 4.2, -1.4, 4.2, -4.2, 1.4, -1.4, 1.4, -1.4, 1.4, -1.4, 4.2, -4.2, 1.4, -1.4, 1.4,
    ],
};

/// The VLP-32A, an early unit.
pub static VLP32A: Vlp32 = Vlp32 {
    id: "vlp32a",
    title: "Velodyne VLP-32A",
    products: &[0x23],
    elevation_deg: [
        -14.3, 0.8337, 12.5, -0.5, -10.7, 2.167, 8.9, -1.834, -7.0, 1.167, 6.0, -0.167, -4.9, 2.5,
        3.8, -1.5, -2.167, 10.7, 1.834, -8.9, -2.5, 4.9, 1.5, -3.8, -0.834, 14.3, 0.5, -12.5,
        -1.167, 7.0, 0.167, -6.0,
    ],
    rotation_deg: [
        -1.2, 1.2, -1.2, 1.2, -1.2, 1.2, -1.2, 1.2, -1.2, 3.6, -1.2, 3.6, -1.2, 3.6, -1.2, 3.6,
        -1.2, 1.2, -1.2, 1.2, -3.6, 1.2, -3.6, 1.2, -1.2, 1.2, -1.2, 1.2, -3.6, 1.2, -3.6, 1.2,
    ],
};

/// One model with 32 lasers.
#[derive(Debug)]
pub struct Vlp32 {
    id: &'static str,
    title: &'static str,
    products: &'static [u8],
    elevation_deg: [f64; CHANNELS],
    /// Taken from the encoder azimuth.
    rotation_deg: [f64; CHANNELS],
}

impl Vlp32 {
    /// Beams of the manual.
    pub fn beams(&self) -> Beams {
        let beam = |laser: usize| {
            let elevation_deg = self.elevation_deg[laser];
            let elevation_rad = elevation_deg.to_radians();
            let lower = self
                .elevation_deg
                .iter()
                .filter(|other| **other < elevation_deg);
            Beam {
                ring: lower.count() as u16,
                elevation_rad,
                azimuth_offset_rad: -self.rotation_deg[laser].to_radians(),
                vertical_offset_m: -FOCAL_DISTANCE_M * elevation_rad.tan(),
                range_offset_m: 0.0,
                delay_ns: (laser / 2) as i64 * PAIR_NS,
            }
        };
        Beams::new((0..CHANNELS).map(beam).collect()).expect("the embedded tables are finite")
    }
}

impl Table for Vlp32 {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn products(&self) -> &'static [u8] {
        self.products
    }

    fn firing(&self) -> &'static Firing {
        &FIRING
    }

    fn beams(&self) -> Beams {
        self.beams()
    }
}
