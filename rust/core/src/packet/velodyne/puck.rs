//! The 16-laser Pucks: VLP-16, Puck LITE and Puck Hi-Res.
//!
//! A block holds two firings of all 16 lasers, 55.296 us apart, the lasers 2.304 us apart. In dual
//! return two blocks hold the same firings: the first the last returns, the second the strongest
//! (or the second strongest where the last is the strongest).
//!
//! Source: VLP-16 manual 63-9243; elevations and offsets of the Hi-Res from its drawing.

use std::f64::consts::TAU;

use super::rotation::Rotation;
use super::{BLOCKS, CHANNELS, Packet, RawReturn, position};
use crate::cloud::{Return, ReturnKind};
use crate::error::InvalidValue;
use crate::packet::beams::{Beam, Beams};
use crate::packet::{Decoded, Decoder, Head, Misfit, Model, PacketKind, Place, ReturnMode, Tally};

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
/// Up to here sine and cosine of a small angle come from their series, to 3e-11.
const SMALL_RAD: f64 = 0.02;

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

impl Model for Puck {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn candidates(&self) -> &'static [&'static str] {
        self.candidates
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        if position::Position::new(payload).is_some() {
            return Some(PacketKind::Position);
        }
        let packet = Packet::new(payload)?;
        let is_mode = matches!(packet.return_mode_byte(), 0x37..=0x39);
        let is_product = self.products.contains(&packet.product());
        (is_mode && is_product && packet.is_lower(0)).then_some(PacketKind::Data)
    }

    fn is_sure(&self, payload: &[u8]) -> bool {
        Packet::new(payload).is_some_and(|packet| packet.product() != PRODUCT_HDL32E)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        Packet::new(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        super::misfit(payload, self.id)
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let packet = Packet::new(payload)?;
        let rotation = rotation(&packet, 0.0);
        rotation.is_valid(0).then(|| Head {
            device_ns: i64::from(packet.timestamp_us()) * 1000,
            sequence: None,
            azimuth_rad: rotation.azimuth_rad(0),
            turned_rad: rotation.turned_rad(),
            rate_rad_per_ns: rotation.rate_rad_per_ns(),
            duration_ns: rotation.duration_ns(),
            left_out: rotation.left_out(),
            return_mode: packet.return_mode(),
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let Some(packet) = Packet::new(payload) else {
            return Tally::default();
        };
        let mut tally = Tally::default();
        let stride = stride(packet.return_mode());
        for block in usable_rows(&packet).map(|row| row * stride) {
            if stride == 1 {
                let hits = packet.returns(block).filter(|echo| echo.range != 0);
                tally.points += hits.count() as u32;
                continue;
            }
            for (last, strongest) in packet.returns(block).zip(packet.returns(block + 1)) {
                let is_merged = last.range == strongest.range && last.range != 0;
                let echoes = u32::from(last.range != 0) + u32::from(strongest.range != 0);
                tally.points += echoes - u32::from(is_merged);
                tally.merged += u32::from(is_merged);
            }
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        (BLOCKS / stride(mode)) as i64 * BLOCK_NS
    }

    fn beams(&self) -> Beams {
        let channels = (0..LASERS).map(|laser| self.beam(laser)).collect();
        Beams::new(channels).expect("the embedded tables are finite")
    }

    fn decoder(&self, beams: &Beams) -> Result<Box<dyn Decoder>, InvalidValue> {
        PuckDecoder::new(beams).map(|decoder| Box::new(decoder) as Box<dyn Decoder>)
    }
}

/// Blocks that one row of firings takes.
fn stride(mode: ReturnMode) -> usize {
    if mode == ReturnMode::Dual { 2 } else { 1 }
}

fn rotation(packet: &Packet<'_>, mean_rate_rad_per_ns: f64) -> Rotation {
    let rows = (0..BLOCKS).step_by(stride(packet.return_mode()));
    let azimuths = rows.map(|block| packet.azimuth_centideg(block));
    Rotation::new(azimuths, BLOCK_NS, mean_rate_rad_per_ns)
}

/// Rows whose blocks have the flag and an azimuth within one turn.
fn usable_rows(packet: &Packet<'_>) -> impl Iterator<Item = usize> {
    let stride = stride(packet.return_mode());
    (0..BLOCKS / stride).filter(move |row| is_usable(packet, *row, stride))
}

fn is_usable(packet: &Packet<'_>, row: usize, stride: usize) -> bool {
    let mut blocks = row * stride..(row + 1) * stride;
    blocks.all(|block| packet.is_lower(block))
        && packet.azimuth_centideg(row * stride) < super::TURN_CENTIDEG
}

/// What decoding needs of one shot of a block.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    delay_ns: i64,
    azimuth_offset_rad: f64,
    cos_elevation: f64,
    sin_elevation: f64,
    vertical_offset_m: f64,
    range_offset_m: f64,
    ring: u16,
}

struct PuckDecoder {
    channels: [Channel; CHANNELS],
}

impl PuckDecoder {
    fn new(beams: &Beams) -> Result<Self, InvalidValue> {
        let lasers: &[Beam; LASERS] = beams.channels().try_into().map_err(|_| InvalidValue {
            name: "beams",
            expected: format!("{LASERS} channels"),
            found: beams.channels().len().to_string(),
        })?;
        let channel = |place: usize| {
            let beam = &lasers[place % LASERS];
            Channel {
                delay_ns: (place / LASERS) as i64 * FIRING_NS + beam.delay_ns,
                azimuth_offset_rad: beam.azimuth_offset_rad,
                cos_elevation: beam.elevation_rad.cos(),
                sin_elevation: beam.elevation_rad.sin(),
                vertical_offset_m: beam.vertical_offset_m,
                range_offset_m: beam.range_offset_m,
                ring: beam.ring,
            }
        };
        Ok(Self {
            channels: std::array::from_fn(channel),
        })
    }
}

impl Decoder for PuckDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = Packet::new(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let rotation = rotation(&packet, place.mean_rate_rad_per_ns);
        let stride = stride(packet.return_mode());
        for row in 0..BLOCKS / stride {
            if !is_usable(&packet, row, stride) {
                out.drops.add("block_invalid", stride as u64);
                continue;
            }
            let mut shots = Shots::new(&rotation, row, place, (row * stride) as u16);
            let first = packet.returns(row * stride);
            match packet.return_mode() {
                ReturnMode::Dual => {
                    let pairs = first.zip(packet.returns(row * stride + 1));
                    for (channel, (last, strongest)) in self.channels.iter().zip(pairs) {
                        shots.pair(channel, last, strongest, out);
                    }
                }
                mode => {
                    let kind = match mode {
                        ReturnMode::Last => ReturnKind::Last,
                        _ => ReturnKind::Strongest,
                    };
                    for (channel, echo) in self.channels.iter().zip(first) {
                        shots.aim(channel);
                        shots.echo(channel, echo, 0, kind, out);
                    }
                }
            }
        }
    }
}

/// The shots of one row: where the head points at each of them.
struct Shots {
    row_azimuth_rad: f64,
    row_sin_cos: (f64, f64),
    rate_rad_per_ns: f64,
    row_time_ns: i64,
    packet: u32,
    block: u16,
    // Of the shot that was aimed last.
    encoder_rad: f64,
    azimuth_rad: f64,
    sin_cos: (f64, f64),
    time_ns: i64,
}

impl Shots {
    fn new(rotation: &Rotation, row: usize, place: Place, block: u16) -> Self {
        let row_azimuth_rad = rotation.azimuth_rad(row);
        Self {
            row_azimuth_rad,
            row_sin_cos: row_azimuth_rad.sin_cos(),
            rate_rad_per_ns: rotation.rate_rad_per_ns(),
            row_time_ns: (place.time + rotation.start_ns(row)).0,
            packet: place.packet,
            block,
            encoder_rad: 0.0,
            azimuth_rad: 0.0,
            sin_cos: (0.0, 0.0),
            time_ns: 0,
        }
    }

    #[inline]
    fn aim(&mut self, channel: &Channel) {
        let turned_rad = self.rate_rad_per_ns * channel.delay_ns as f64;
        self.encoder_rad = self.row_azimuth_rad + turned_rad;
        self.azimuth_rad = self.encoder_rad + channel.azimuth_offset_rad;
        self.sin_cos = turn(self.row_sin_cos, turned_rad + channel.azimuth_offset_rad);
        self.time_ns = self.row_time_ns.saturating_add(channel.delay_ns);
    }

    #[inline]
    fn echo(
        &self,
        channel: &Channel,
        echo: RawReturn,
        return_index: u8,
        return_kind: ReturnKind,
        out: &mut Decoded,
    ) {
        if echo.range == 0 {
            return;
        }
        let range_m = f64::from(echo.range) * RANGE_UNIT_M + channel.range_offset_m;
        let level_m = range_m * channel.cos_elevation;
        let (sin, cos) = self.sin_cos;
        let height_m = range_m * channel.sin_elevation + channel.vertical_offset_m;
        out.encoder_rad.push(wrapped(self.encoder_rad));
        out.returns.push(Return {
            xyz_m: [
                (level_m * cos) as f32,
                (-level_m * sin) as f32,
                height_m as f32,
            ],
            time: crate::time::Timestamp(self.time_ns),
            range_m: range_m as f32,
            azimuth_rad: wrapped(self.azimuth_rad),
            ring: channel.ring,
            intensity: u16::from(echo.intensity),
            return_index,
            return_kind,
            packet: self.packet,
            block: self.block + u16::from(return_index),
        });
    }

    fn pair(
        &mut self,
        channel: &Channel,
        last: RawReturn,
        strongest: RawReturn,
        out: &mut Decoded,
    ) {
        self.aim(channel);
        if last.range == strongest.range && last.range != 0 {
            out.merged += 1;
            return self.echo(channel, last, 0, ReturnKind::Merged, out);
        }
        // Which of the two is the brighter cannot be read from the intensity, which is corrected for
        // range; so the second is called strongest even where the manual makes it the second strongest.
        self.echo(channel, last, 0, ReturnKind::Last, out);
        self.echo(channel, strongest, 1, ReturnKind::Strongest, out);
    }
}

/// Sine and cosine of an angle turned on by a mostly small one.
#[inline]
fn turn((sin, cos): (f64, f64), by_rad: f64) -> (f64, f64) {
    let (sin_by, cos_by) = if by_rad.abs() < SMALL_RAD {
        let square = by_rad * by_rad;
        let sin_by = by_rad * (1.0 - square / 6.0);
        (sin_by, 1.0 - square * (0.5 - square / 24.0))
    } else {
        by_rad.sin_cos()
    };
    (sin * cos_by + cos * sin_by, cos * cos_by - sin * sin_by)
}

/// An angle not far outside of one turn brought into [0, 2 pi) of `f32`.
#[inline]
fn wrapped(angle_rad: f64) -> f32 {
    let once = if angle_rad >= TAU {
        angle_rad - TAU
    } else if angle_rad < 0.0 {
        angle_rad + TAU
    } else {
        angle_rad
    };
    let narrow = once as f32;
    // Just below a full turn rounds up to it.
    if narrow >= TAU as f32 { 0.0 } else { narrow }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::velodyne::{RawBlock, encode};
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
        let [echo] = out.returns[..] else {
            panic!("{:?}", out.returns)
        };
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

    #[test]
    fn small_turns_keep_the_accuracy() {
        for by in [-0.0199, -1e-4, 0.0, 0.0113, 0.0199, 0.021, 1.0] {
            let (sin, cos) = turn(2.0_f64.sin_cos(), by);
            assert!((sin - (2.0 + by).sin()).abs() < 5e-11);
            assert!((cos - (2.0 + by).cos()).abs() < 5e-11);
        }
        assert_eq!(wrapped(TAU - 1e-9), 0.0);
        assert_eq!(wrapped(TAU + 0.5), 0.5);
    }
}
