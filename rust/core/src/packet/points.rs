//! Points that some other program decoded, carried as packets of the project's own, little endian.
//!
//! Bags often hold clouds instead of the sensor's packets. Their points travel in this layout from the
//! reader of the bag to the streams, where they are treated as any sensor's: ordered, timed, cut into turns.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | [`MAGIC`] |
//! | 8..16 | UTC of the first point by the driver's stamp, i64 ns |
//! | 16..20 | number of the packet, u32 |
//! | 20..24 | time from the first point to the next packet, u32 ns |
//! | 24..28 | encoder azimuth of the first point, f32 rad |
//! | 28..32 | angle turned until the next packet, f32 rad |
//! | 32..34 | number of points, u16 |
//! | 34 | 1: the rotor turns clockwise seen from above, 0: counterclockwise |
//! | 35 | 0 |
//! | 36.. | per point, 20 bytes: time since the first one u32 ns, x y z f32 m, intensity u16, ring u16 |

use std::f64::consts::TAU;

use super::aim::wrapped;
use super::unit::{Calibration, Fitted, UnitFile};
use super::{
    Counting, Decoded, Decoder, Head, Misfit, Model, PacketKind, Place, ReturnMode, Tally,
};
use crate::cloud::{Return, ReturnKind};
use crate::error::UnitError;

/// First bytes of a packet.
pub const MAGIC: &[u8; 8] = b"LDPOINTS";
const HEAD_LEN: usize = 36;
const POINT_LEN: usize = 20;
/// Packets are made of at most so much time; 1 s.
const MOST_NS: u32 = 1_000_000_000;
/// Stamps are UTC between 1970 and 2116.
const LAST_NS: i64 = 1 << 62;
const PERIOD_NS: i64 = 1_000_000;

/// Points decoded elsewhere.
pub static POINTS: Points = Points;

/// The model.
#[derive(Debug)]
pub struct Points;

struct View<'a> {
    bytes: &'a [u8],
}

/// One point of a packet.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    offset_ns: u32,
    xyz_m: [f32; 3],
    intensity: u16,
    ring: u16,
}

impl<'a> View<'a> {
    fn new(bytes: &'a [u8]) -> Option<Self> {
        let view = Self { bytes };
        let is_own = bytes.len() > HEAD_LEN && bytes.starts_with(MAGIC);
        let is_whole = is_own && bytes.len() == HEAD_LEN + POINT_LEN * view.count();
        (is_whole && view.is_sound()).then_some(view)
    }

    fn is_sound(&self) -> bool {
        let angles = [self.azimuth_rad(), self.turned_rad()];
        let are_turns = angles.iter().all(|angle| (0.0..=TAU).contains(angle));
        are_turns && (0..LAST_NS).contains(&self.time_ns()) && self.duration_ns() <= MOST_NS
    }

    fn count(&self) -> usize {
        usize::from(u16::from_le_bytes(field(self.bytes, 32)))
    }

    fn time_ns(&self) -> i64 {
        i64::from_le_bytes(field(self.bytes, 8))
    }

    fn sequence(&self) -> u32 {
        u32::from_le_bytes(field(self.bytes, 16))
    }

    fn duration_ns(&self) -> u32 {
        u32::from_le_bytes(field(self.bytes, 20))
    }

    fn azimuth_rad(&self) -> f64 {
        f64::from(f32::from_le_bytes(field(self.bytes, 24)))
    }

    fn turned_rad(&self) -> f64 {
        f64::from(f32::from_le_bytes(field(self.bytes, 28)))
    }

    fn rate_rad_per_ns(&self) -> f64 {
        self.turned_rad() / f64::from(self.duration_ns().max(1))
    }

    fn is_clockwise(&self) -> bool {
        self.bytes[34] == 1
    }

    fn points(&self) -> impl Iterator<Item = Point> {
        self.bytes[HEAD_LEN..]
            .chunks_exact(POINT_LEN)
            .map(|bytes| Point {
                offset_ns: u32::from_le_bytes(field(bytes, 0)),
                xyz_m: [4, 8, 12].map(|place| f32::from_le_bytes(field(bytes, place))),
                intensity: u16::from_le_bytes(field(bytes, 16)),
                ring: u16::from_le_bytes(field(bytes, 18)),
            })
    }
}

impl Point {
    fn range_m(&self) -> f64 {
        let squares = self.xyz_m.iter().map(|value| f64::from(*value).powi(2));
        squares.sum::<f64>().sqrt()
    }

    fn is_valid(&self) -> bool {
        let range_m = self.range_m();
        range_m.is_finite() && range_m > 0.0 && self.offset_ns <= MOST_NS
    }

    /// Azimuth in the rotor's own sense.
    fn azimuth_rad(&self, is_clockwise: bool) -> f32 {
        let angle_rad = f64::from(self.xyz_m[1]).atan2(f64::from(self.xyz_m[0]));
        wrapped(if is_clockwise { -angle_rad } else { angle_rad })
    }
}

/// Bytes of a view were counted when it was made.
fn field<const N: usize>(bytes: &[u8], place: usize) -> [u8; N] {
    let mut value = [0; N];
    value.copy_from_slice(&bytes[place..place + N]);
    value
}

impl Model for Points {
    fn id(&self) -> &'static str {
        "points"
    }

    fn title(&self) -> &'static str {
        "points decoded by a driver"
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        View::new(payload).map(|_| PacketKind::Data)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        View::new(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let why = format!("{} bytes are no packet of points", payload.len());
        Misfit { why, may_be: None }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let view = View::new(payload)?;
        Some(Head {
            device_ns: view.time_ns(),
            sequence: Some(view.sequence()),
            azimuth_rad: f64::from(wrapped(view.azimuth_rad())),
            turned_rad: view.turned_rad(),
            rate_rad_per_ns: view.rate_rad_per_ns(),
            duration_ns: i64::from(view.duration_ns()),
            left_out: None,
            return_mode: ReturnMode::Strongest,
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let count = |view: View<'_>| view.points().filter(Point::is_valid).count();
        Tally {
            points: View::new(payload).map_or(0, count) as u32,
            merged: 0,
        }
    }

    fn period_ns(&self, _mode: ReturnMode) -> i64 {
        PERIOD_NS
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: Some(32),
        }
    }

    fn fit(&self, _files: &[UnitFile]) -> Result<Fitted, UnitError> {
        Ok(Fitted {
            decoder: Box::new(PointsDecoder),
            calibration: Calibration::Factory,
        })
    }
}

struct PointsDecoder;

impl Decoder for PointsDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(view) = View::new(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let (start_rad, rate) = (view.azimuth_rad(), view.rate_rad_per_ns());
        for point in view.points() {
            if !point.is_valid() {
                out.drops.add("point_invalid", 1);
                continue;
            }
            let encoder_rad = start_rad + f64::from(point.offset_ns) * rate;
            out.encoder_rad.push(wrapped(encoder_rad.rem_euclid(TAU)));
            out.cloud.push(&Return {
                xyz_m: point.xyz_m,
                time: place.time + i64::from(point.offset_ns),
                range_m: point.range_m() as f32,
                azimuth_rad: point.azimuth_rad(view.is_clockwise()),
                ring: point.ring,
                intensity: point.intensity,
                return_index: 0,
                return_kind: ReturnKind::Strongest,
                packet: place.packet,
                block: 0,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Timestamp;

    fn packet(points: &[Point]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(1_700_000_000_000_000_123_i64.to_le_bytes());
        bytes.extend(7_u32.to_le_bytes());
        bytes.extend(1_000_000_u32.to_le_bytes());
        bytes.extend(6.25_f32.to_le_bytes());
        bytes.extend(0.1_f32.to_le_bytes());
        bytes.extend((points.len() as u16).to_le_bytes());
        bytes.extend([1, 0]);
        for point in points {
            bytes.extend(point.offset_ns.to_le_bytes());
            point
                .xyz_m
                .iter()
                .for_each(|v| bytes.extend(v.to_le_bytes()));
            bytes.extend(point.intensity.to_le_bytes());
            bytes.extend(point.ring.to_le_bytes());
        }
        bytes
    }

    fn point(offset_ns: u32, xyz_m: [f32; 3]) -> Point {
        Point {
            offset_ns,
            xyz_m,
            intensity: 300,
            ring: 5,
        }
    }

    fn decode(bytes: &[u8]) -> Decoded {
        let mut out = Decoded::default();
        let place = Place {
            time: Timestamp(1000),
            packet: 3,
            mean_rate_rad_per_ns: 0.0,
        };
        let mut decoder = POINTS.fit(&[]).unwrap().decoder;
        decoder.decode(bytes, place, &mut out);
        out
    }

    #[test]
    fn points_keep_place_time_and_brightness() {
        let bytes = packet(&[
            point(0, [3.0, 4.0, 0.0]),
            point(500_000, [0.0, -2.0, 0.0]),
            point(600_000, [f32::NAN, 0.0, 0.0]),
            point(700_000, [0.0; 3]),
        ]);
        let found = decode(&bytes);
        assert_eq!(POINTS.tally(&bytes).points, 2);
        assert_eq!(
            found.drops.iter().collect::<Vec<_>>(),
            [("point_invalid", 2)]
        );
        let (one, other) = (found.cloud.get(0), found.cloud.get(1));
        assert_eq!((one.range_m, one.ring, one.intensity), (5.0, 5, 300));
        assert_eq!((one.time.0, other.time.0), (1000, 501_000));
        // Clockwise from x: 4 to the left of 3 is a turn less 53 degrees, the right a quarter.
        assert!((f64::from(one.azimuth_rad) - (TAU - 4.0_f64.atan2(3.0))).abs() < 1e-6);
        assert!((f64::from(other.azimuth_rad) - TAU / 4.0).abs() < 1e-6);
        // Half of the packet's 0.1 on 6.25, past the turn.
        assert!((f64::from(found.encoder_rad[1]) - (6.3 - TAU)).abs() < 1e-6);
    }

    #[test]
    fn the_head_is_the_packet_s() {
        let head = POINTS.head(&packet(&[point(0, [1.0; 3])])).unwrap();
        assert_eq!(head.device_ns, 1_700_000_000_000_000_123);
        assert_eq!((head.sequence, head.duration_ns), (Some(7), 1_000_000));
        assert!((head.rate_rad_per_ns - 0.1e-6).abs() < 1e-12);
    }

    #[test]
    fn what_is_cut_or_out_of_range_is_refused() {
        let bytes = packet(&[point(0, [1.0; 3])]);
        assert!((0..bytes.len()).all(|len| POINTS.recognise(&bytes[..len]).is_none()));
        for (place, value) in [(15, 0x7F), (15, 0xFF), (23, 0xFF), (27, 0x7F), (31, 0xFF)] {
            let mut broken = bytes.clone();
            broken[place] = value;
            assert!(POINTS.head(&broken).is_none(), "byte {place}");
        }
        assert_eq!(decode(&bytes[1..]).drops.iter().count(), 1);
    }
}
