//! HDL-32E: 32 lasers that fire one after the other, 1.152 us apart, every 46.08 us.
//!
//! Source: HDL-32E manual 63-9113 and application note 63-9277; offsets from the drawing.

use super::rows::Firing;
use super::table::Table;
use super::{CHANNELS, Packet, puck};
use crate::packet::beams::{Beam, Beams};

/// Time from one laser to the next.
pub const LASER_NS: i64 = 1_152;
/// The factory bytes of firmware before 2.2.20.
const NO_FACTORY_BYTES: [u8; 2] = [0, 0];

static FIRING: Firing = Firing {
    lasers: CHANNELS,
    firing_ns: 46_080,
    range_unit_m: 0.002,
};

const ELEVATION_DEG: [f64; CHANNELS] = [
    -30.67, -9.33, -29.33, -8.0, -28.0, -6.67, -26.67, -5.33, -25.33, -4.0, -24.0, -2.67, -22.67,
    -1.33, -21.33, 0.0, -20.0, 1.33, -18.67, 2.67, -17.33, 4.0, -16.0, 5.33, -14.67, 6.67, -13.33,
    8.0, -12.0, 9.33, -10.67, 10.67,
];
const VERTICAL_OFFSET_MM: [f64; CHANNELS] = [
    17.17, 4.76, 16.27, 4.07, 15.4, 3.38, 14.54, 2.7, 13.71, 2.02, 12.89, 1.35, 12.09, 0.67, 11.31,
    0.0, 10.54, -0.67, 9.78, -1.35, 9.04, -2.02, 8.3, -2.7, 7.58, -3.38, 6.86, -4.07, 6.15, -4.76,
    5.45, -5.45,
];

/// The HDL-32E.
pub static HDL32E: Hdl32e = Hdl32e;

/// The model.
#[derive(Debug)]
pub struct Hdl32e;

impl Hdl32e {
    /// Beams of the drawing.
    pub fn beams() -> Beams {
        let beam = |laser: usize| Beam {
            // The lasers fire low, high, low, high; rings count from the lowest.
            ring: (laser / 2 + laser % 2 * (CHANNELS / 2)) as u16,
            elevation_rad: ELEVATION_DEG[laser].to_radians(),
            azimuth_offset_rad: 0.0,
            vertical_offset_m: VERTICAL_OFFSET_MM[laser] * 1e-3,
            range_offset_m: 0.0,
            delay_ns: laser as i64 * LASER_NS,
        };
        Beams::new((0..CHANNELS).map(beam).collect()).expect("the embedded tables are finite")
    }
}

impl Table for Hdl32e {
    fn id(&self) -> &'static str {
        "hdl32e"
    }

    fn title(&self) -> &'static str {
        "Velodyne HDL-32E"
    }

    fn products(&self) -> &'static [u8] {
        &[puck::PRODUCT_HDL32E]
    }

    fn sends(&self, packet: &Packet<'_>) -> bool {
        [packet.return_mode_byte(), packet.product()] == NO_FACTORY_BYTES && packet.has_banks(&[0])
    }

    /// Firmware of 2014 of the VLP-16 writes this model's byte as well.
    fn is_sure(&self, _product: u8) -> bool {
        false
    }

    fn firing(&self) -> &'static Firing {
        &FIRING
    }

    fn beams(&self) -> Beams {
        Self::beams()
    }
}
