//! The 16-laser Pucks: VLP-16, Puck LITE and Puck Hi-Res.
//!
//! A block holds two firings of all 16 lasers, 55.296 us apart, the lasers 2.304 us apart.
//!
//! Source: VLP-16 manual 63-9243; elevations and offsets of the Hi-Res from its drawing.

use super::rows::Firing;
use super::table::Table;
use crate::error::InvalidValue;
use crate::packet::Decoder;
use crate::packet::beams::{Beam, Beams};

/// Lasers of one unit.
pub const LASERS: usize = 16;
/// Time from one firing of all lasers to the next.
pub const FIRING_NS: i64 = 55_296;
/// Time from one laser to the next.
pub const LASER_NS: i64 = 2_304;
/// Time from one block of single returns to the next.
pub const BLOCK_NS: i64 = 2 * FIRING_NS;
/// Metres of one unit of range.
pub const RANGE_UNIT_M: f64 = 0.002;
/// Product byte of VLP-16 and Puck LITE.
pub const PRODUCT_VLP16: u8 = 0x22;
/// Product byte of the Puck Hi-Res.
pub const PRODUCT_HIRES: u8 = 0x24;
/// Product byte of the HDL-32E, which VLP-16 firmware of 2014 writes as well.
pub const PRODUCT_HDL32E: u8 = 0x21;
/// Distance from the spin axis to where the beams cross.
const FOCAL_DISTANCE_M: f64 = 0.041_91;

static FIRING: Firing = Firing {
    lasers: LASERS,
    firing_ns: FIRING_NS,
    range_unit_m: RANGE_UNIT_M,
};

/// The VLP-16.
pub static VLP16: Puck = Puck {
    id: "vlp16",
    title: "Velodyne VLP-16",
    candidates: &["puck-lite"],
    products: &[PRODUCT_VLP16, PRODUCT_HDL32E],
    elevation_deg: ELEVATION_VLP16_DEG,
    vertical_offset_m: None,
};

/// The Puck LITE, whose packets are those of a VLP-16.
pub static PUCK_LITE: Puck = Puck {
    id: "puck-lite",
    title: "Velodyne Puck LITE",
    candidates: &["vlp16"],
    products: &[PRODUCT_VLP16],
    elevation_deg: ELEVATION_VLP16_DEG,
    vertical_offset_m: None,
};

/// The Puck Hi-Res.
pub static VLP16_HIRES: Puck = Puck {
    id: "vlp16-hires",
    title: "Velodyne Puck Hi-Res",
    candidates: &[],
    products: &[PRODUCT_HIRES],
    elevation_deg: [
        -10.0, 0.667, -8.667, 2.0, -7.333, 3.333, -6.0, 4.667, -4.667, 6.0, -3.333, 7.333, -2.0,
        8.667, -0.667, 10.0,
    ],
    vertical_offset_m: Some([
        7.4e-3, -0.9e-3, 6.5e-3, -1.8e-3, 5.5e-3, -2.7e-3, 4.6e-3, -3.7e-3, 3.7e-3, -4.6e-3,
        2.7e-3, -5.5e-3, 1.8e-3, -6.5e-3, 0.9e-3, -7.4e-3,
    ]),
};

const ELEVATION_VLP16_DEG: [f64; LASERS] = [
    -15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0, 15.0,
];

/// One model with 16 lasers.
#[derive(Debug)]
pub struct Puck {
    id: &'static str,
    title: &'static str,
    candidates: &'static [&'static str],
    products: &'static [u8],
    elevation_deg: [f64; LASERS],
    /// `None`: from the distance at which the beams cross.
    vertical_offset_m: Option<[f64; LASERS]>,
}

impl Puck {
    /// Beams of a unit without a calibration file: those of the drawing.
    pub fn beams(&self) -> Beams {
        let channels = (0..LASERS).map(|laser| self.beam(laser)).collect();
        Beams::new(channels).expect("the embedded tables are finite")
    }

    /// Turns data packets into returns with the beams of one unit.
    ///
    /// # Errors
    /// [`InvalidValue`] where `beams` has another number of channels.
    pub fn decoder(&self, beams: &Beams) -> Result<Box<dyn Decoder>, InvalidValue> {
        FIRING.decoder(beams)
    }

    fn beam(&self, laser: usize) -> Beam {
        let elevation_rad = self.elevation_deg[laser].to_radians();
        let crossing_m = || -FOCAL_DISTANCE_M * elevation_rad.tan();
        Beam {
            // The lasers fire low, high, low, high; rings count from the lowest.
            ring: (laser / 2 + laser % 2 * (LASERS / 2)) as u16,
            elevation_rad,
            azimuth_offset_rad: 0.0,
            vertical_offset_m: self
                .vertical_offset_m
                .map_or_else(crossing_m, |offsets| offsets[laser]),
            range_offset_m: 0.0,
            delay_ns: laser as i64 * LASER_NS,
        }
    }
}

impl Table for Puck {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn candidates(&self) -> &'static [&'static str] {
        self.candidates
    }

    fn products(&self) -> &'static [u8] {
        self.products
    }

    fn is_sure(&self, product: u8) -> bool {
        product != PRODUCT_HDL32E
    }

    fn firing(&self) -> &'static Firing {
        &FIRING
    }

    fn beams(&self) -> Beams {
        self.beams()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::ReturnKind;
    use crate::packet::velodyne::{BLOCKS, RawBlock, RawReturn, encode};
    use crate::packet::{Decoded, Place, ReturnMode};
    use crate::time::Timestamp;

    #[test]
    fn embedded_tables_cross_at_the_focal_point_and_count_from_the_lowest() {
        let beams = VLP16.beams();
        let mut by_ring = beams.channels().to_vec();
        by_ring.sort_by_key(|beam| beam.ring);
        assert!(
            by_ring
                .windows(2)
                .all(|w| w[0].elevation_rad < w[1].elevation_rad)
        );
        // Table of the manual: 11.2 mm at -15 degrees, -0.7 mm at 1 degree.
        assert!((beams.channels()[0].vertical_offset_m - 0.0112).abs() < 1e-4);
        assert!((beams.channels()[1].vertical_offset_m + 0.0007).abs() < 1e-4);
        let hires = VLP16_HIRES.beams();
        assert_eq!(hires.channels()[15].vertical_offset_m, -7.4e-3);
        assert_eq!(hires.channels()[15].ring, 15);
    }

    #[test]
    fn one_echo_lands_where_the_geometry_says() {
        let mut blocks = [RawBlock::default(); BLOCKS];
        for (row, block) in (0..).zip(&mut blocks) {
            block.azimuth_centideg = (8_000 + row * 40) % 36_000; // 20 degrees in 5 ms: 10.05 turns a second
        }
        // Block 2, second firing of laser 3 (elevation 3 degrees).
        blocks[2].returns[19] = RawReturn {
            range: 5_000,
            intensity: 7,
        };
        let bytes = encode(&blocks, 1, ReturnMode::Last, PRODUCT_VLP16);
        let mut decoder = VLP16.decoder(&VLP16.beams()).unwrap();
        let mut out = Decoded::default();
        let place = Place {
            time: Timestamp(1_000_000),
            packet: 9,
            mean_rate_rad_per_ns: 0.0,
        };
        decoder.decode(&bytes, place, &mut out);
        assert_eq!(out.cloud.len(), 1);
        let echo = out.cloud.get(0);
        let delay_ns = FIRING_NS + 3 * LASER_NS;
        let azimuth = (80.8 + 0.4 * delay_ns as f64 / BLOCK_NS as f64).to_radians();
        let elevation = 3.0_f64.to_radians();
        let level = 10.0 * elevation.cos();
        let height = 10.0 * elevation.sin() - FOCAL_DISTANCE_M * elevation.tan();
        let expected = [level * azimuth.cos(), -level * azimuth.sin(), height];
        for (found, expected) in echo.xyz_m.iter().zip(expected) {
            assert!((f64::from(*found) - expected).abs() < 1e-6);
        }
        assert_eq!(echo.time, Timestamp(1_000_000 + 2 * BLOCK_NS + delay_ns));
        assert_eq!((echo.ring, echo.block, echo.packet), (9, 2, 9));
        assert_eq!(echo.return_kind, ReturnKind::Last);
    }
}
