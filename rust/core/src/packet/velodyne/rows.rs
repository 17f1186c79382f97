//! Models with 16 or 32 lasers: a block holds all lasers, once or twice, at one azimuth.
//!
//! In dual return two blocks hold the same shots: the first the last returns, the second the
//! strongest (or the second strongest where the last is the strongest).

use super::board::Board;
use super::lanes::{Lanes, Row};
use super::reach::Reach;
use super::rotation::Rotation;
use super::{BLOCKS, CHANNELS, Packet, TURN_CENTIDEG, position};
use crate::angle::Arc;
use crate::error::InvalidValue;
use crate::packet::beams::{Beam, Beams};
use crate::packet::{Decoded, Decoder, Head, PacketKind, Place, ReturnMode};

/// How a model fires.
#[derive(Debug, Clone, Copy)]
pub struct Firing {
    /// Lasers of one unit: 16 or 32.
    pub lasers: usize,
    /// Time from one firing of all lasers to the next.
    pub firing_ns: i64,
    /// Metres of one unit of range.
    pub range_unit_m: f64,
}

impl Firing {
    /// Time from one block of single returns to the next.
    const fn row_ns(&self) -> i64 {
        (CHANNELS / self.lasers) as i64 * self.firing_ns
    }

    /// Time from one packet to the next.
    pub fn period_ns(&self, mode: ReturnMode) -> i64 {
        (BLOCKS / mode.returns()) as i64 * self.row_ns()
    }

    /// Times and angles of a data packet.
    pub fn head(&self, payload: &[u8]) -> Option<Head> {
        let packet = Packet::new(payload)?;
        let rotation = self.rotation(&packet, 0.0);
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

    /// Turns data packets into returns.
    ///
    /// # Errors
    /// [`InvalidValue`] where `beams` has another number of channels than the model.
    pub fn decoder(&self, beams: &Beams) -> Result<Box<dyn Decoder>, InvalidValue> {
        beams.expect(self.lasers)?;
        let channel = |place: usize| {
            let beam = &beams.channels()[place % self.lasers];
            Channel::new(beam, (place / self.lasers) as i64 * self.firing_ns)
        };
        let channels = std::array::from_fn(channel);
        Ok(Box::new(RowsDecoder {
            firing: *self,
            reach: Reach::new(&channels, self.row_ns()),
            board: Board::new(vec![Lanes::new(&channels, self.range_unit_m)]),
        }))
    }

    fn rotation(&self, packet: &Packet<'_>, mean_rate_rad_per_ns: f64) -> Rotation {
        let returns = packet.return_mode().returns();
        Rotation::of_blocks(packet, returns, self.row_ns(), mean_rate_rad_per_ns)
    }
}

/// What a payload is to the models of one bank with the product bytes `products`.
///
/// An HDL-64E may have any bytes there; its second block is of the second bank.
pub fn recognise(payload: &[u8], products: &[u8]) -> Option<PacketKind> {
    let is_of_two_banks = Packet::new(payload).is_some_and(|packet| packet.bank(1) == Some(1));
    recognise_product(payload, products).filter(|_| !is_of_two_banks)
}

/// What a payload is to the models with the product bytes `products`.
pub fn recognise_product(payload: &[u8], products: &[u8]) -> Option<PacketKind> {
    if position::Position::new(payload).is_some() {
        return Some(PacketKind::Position);
    }
    let packet = Packet::new(payload)?;
    let is_mode = matches!(packet.return_mode_byte(), 0x37..=0x39);
    let is_product = products.contains(&packet.product());
    (is_mode && is_product && packet.is_lower(0)).then_some(PacketKind::Data)
}

/// Whether the blocks of a row have the flag and an azimuth within one turn.
#[inline(always)]
pub(super) fn is_usable(packet: &Packet<'_>, row: usize, stride: usize) -> bool {
    let mut blocks = row * stride..(row + 1) * stride;
    blocks.all(|block| packet.is_lower(block))
        && packet.azimuth_centideg(row * stride) < TURN_CENTIDEG
}

/// What decoding needs of one shot.
#[derive(Debug, Clone, Copy, Default)]
pub struct Channel {
    /// After the first shot of its row.
    pub delay_ns: i64,
    pub(super) azimuth_offset_rad: f64,
    pub(super) cos_elevation: f64,
    pub(super) sin_elevation: f64,
    pub(super) vertical_offset_m: f64,
    pub(super) range_offset_m: f64,
    pub(super) ring: u16,
}

impl Channel {
    /// A beam that fires `firing_ns` later than its own delay says.
    pub fn new(beam: &Beam, firing_ns: i64) -> Self {
        Self {
            delay_ns: firing_ns + beam.delay_ns,
            azimuth_offset_rad: beam.azimuth_offset_rad,
            cos_elevation: beam.elevation_rad.cos(),
            sin_elevation: beam.elevation_rad.sin(),
            vertical_offset_m: beam.vertical_offset_m,
            range_offset_m: beam.range_offset_m,
            ring: beam.ring,
        }
    }
}

struct RowsDecoder {
    firing: Firing,
    reach: Reach,
    board: Board,
}

impl Decoder for RowsDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = Packet::new(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let rotation = self.firing.rotation(&packet, place.mean_rate_rad_per_ns);
        let mode = packet.return_mode();
        let stride = mode.returns();
        self.board.open(rotation.rate_rad_per_ns());
        for row in 0..BLOCKS / stride {
            if !is_usable(&packet, row, stride) {
                out.drops.add("block_invalid", stride as u64);
            } else if packet.any_has_echoes(row * stride, stride) {
                self.board.add(Row {
                    azimuth_rad: rotation.azimuth_rad(row),
                    time_ns: (place.time + rotation.start_ns(row)).0,
                    block: row * stride,
                    bank: 0,
                });
            }
        }
        self.board.push(&packet, mode, place.packet, out);
    }

    fn may_meet(&self, payload: &[u8], bearings: Arc) -> bool {
        Packet::new(payload).is_none_or(|packet| self.reach.meets(&packet, bearings))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::velodyne::plain::{Shots, random_packet};
    use crate::packet::velodyne::puck::{FIRING_NS, RANGE_UNIT_M, VLP16};
    use crate::time::Timestamp;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const FIRING: Firing = Firing {
        lasers: 16,
        firing_ns: FIRING_NS,
        range_unit_m: RANGE_UNIT_M,
    };

    /// Beams that differ in all that a beam may have.
    fn beams() -> Beams {
        let mut channels = VLP16.beams().channels().to_vec();
        for (number, beam) in channels.iter_mut().enumerate() {
            beam.azimuth_offset_rad = 0.01 * number as f64 - 0.05;
            beam.range_offset_m = 0.001 * number as f64;
        }
        Beams::new(channels).unwrap()
    }

    /// The same shot by shot.
    fn one_by_one(beams: &Beams, payload: &[u8], place: Place, out: &mut Decoded) {
        let packet = Packet::new(payload).unwrap();
        let rotation = FIRING.rotation(&packet, 0.0);
        let stride = packet.return_mode().returns();
        for row in 0..BLOCKS / stride {
            let time = place.time + rotation.start_ns(row);
            let rate = rotation.rate_rad_per_ns();
            let place = Place { time, ..place };
            let mut shots = Shots::new(rotation.azimuth_rad(row), rate, place, RANGE_UNIT_M);
            let block = row * stride;
            let second = packet.returns(block + stride - 1);
            for (shot, echoes) in packet.returns(block).zip(second).enumerate() {
                let firing_ns = (shot / 16) as i64 * FIRING_NS;
                let channel = Channel::new(&beams.channels()[shot % 16], firing_ns);
                shots.shot(&channel, echoes, packet.return_mode(), block, out);
            }
        }
    }

    #[test]
    fn shots_side_by_side_are_those_one_by_one() {
        let mut rng = ChaCha8Rng::seed_from_u64(16);
        let beams = beams();
        let mut decoder = FIRING.decoder(&beams).unwrap();
        let place = Place {
            time: Timestamp(1_718_000_000_000_000_000),
            packet: 7,
            mean_rate_rad_per_ns: 0.0,
        };
        for mode in [ReturnMode::Strongest, ReturnMode::Last, ReturnMode::Dual] {
            for share in [0.0, 0.05, 0.6, 1.0] {
                let payload = random_packet(&mut rng, mode, share, 1);
                let (mut found, mut expected) = (Decoded::default(), Decoded::default());
                decoder.decode(&payload, place, &mut found);
                one_by_one(&beams, &payload, place, &mut expected);
                assert_eq!(expected.cloud.is_empty(), share == 0.0);
                assert_eq!(
                    format!("{found:?}"),
                    format!("{expected:?}"),
                    "{mode:?}, {share}"
                );
            }
        }
    }
}
