//! Models with 16 or 32 lasers: a block holds all lasers, once or twice, at one azimuth.
//!
//! In dual return two blocks hold the same shots: the first the last returns, the second the
//! strongest (or the second strongest where the last is the strongest).

use super::lanes::{Lanes, Placed, Row};
use super::pairs::Pairs;
use super::reach::Reach;
use super::rotation::Rotation;
use super::squeeze::Squeezed;
use super::{BLOCKS, CHANNELS, Packet, RawReturn, TURN_CENTIDEG, position};
use crate::angle::Arc;
use crate::cloud::{Return, ReturnKind};
use crate::error::InvalidValue;
use crate::packet::aim::{turn, wrapped};
use crate::packet::beams::{Beam, Beams};
use crate::packet::echoes::judge;
use crate::packet::{Decoded, Decoder, Head, PacketKind, Place, ReturnMode};
use crate::time::Timestamp;

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
            lanes: Lanes::new(&channels, self.range_unit_m),
            placed: Placed::default(),
            squeezed: Squeezed::default(),
            pairs: Pairs::default(),
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
    lanes: Lanes,
    reach: Reach,
    placed: Placed,
    squeezed: Squeezed,
    pairs: Pairs,
}

impl Decoder for RowsDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = Packet::new(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let rotation = self.firing.rotation(&packet, place.mean_rate_rad_per_ns);
        let mode = packet.return_mode();
        let stride = mode.returns();
        let (mut rows, mut count) = ([Row::default(); BLOCKS], 0);
        for row in 0..BLOCKS / stride {
            if !is_usable(&packet, row, stride) {
                out.drops.add("block_invalid", stride as u64);
            } else if (row * stride..(row + 1) * stride).any(|block| packet.has_echoes(block)) {
                rows[count] = Row {
                    azimuth_rad: rotation.azimuth_rad(row),
                    time_ns: (place.time + rotation.start_ns(row)).0,
                    block: row * stride,
                };
                count += 1;
            }
        }
        self.lanes.set_rate(rotation.rate_rad_per_ns());
        self.lanes
            .place(&packet, &rows[..count], stride, &mut self.placed);
        let (placed, lanes) = (&self.placed, &self.lanes);
        if stride == 1 {
            let kind = single_kind(mode);
            self.squeezed.push(placed, lanes, place.packet, kind, out);
        } else {
            self.pairs.push(placed, lanes, place.packet, out);
        }
    }

    fn may_meet(&self, payload: &[u8], bearings: Arc) -> bool {
        Packet::new(payload).is_none_or(|packet| self.reach.meets(&packet, bearings))
    }
}

/// Meaning of the echoes of a single-return setting.
pub fn single_kind(mode: ReturnMode) -> ReturnKind {
    match mode {
        ReturnMode::Last => ReturnKind::Last,
        _ => ReturnKind::Strongest,
    }
}

/// The shots of one row: where the head points at each of them.
pub struct Shots {
    row_azimuth_rad: f64,
    row_sin_cos: (f64, f64),
    rate_rad_per_ns: f64,
    row_time_ns: i64,
    packet: u32,
    range_unit_m: f64,
    // Of the shot that was aimed last.
    encoder_rad: f64,
    azimuth_rad: f64,
    sin_cos: (f64, f64),
    time_ns: i64,
}

impl Shots {
    /// A row at an azimuth and `place.time`.
    pub fn new(
        row_azimuth_rad: f64,
        rate_rad_per_ns: f64,
        place: Place,
        range_unit_m: f64,
    ) -> Self {
        Self {
            row_azimuth_rad,
            row_sin_cos: row_azimuth_rad.sin_cos(),
            rate_rad_per_ns,
            row_time_ns: place.time.0,
            packet: place.packet,
            range_unit_m,
            encoder_rad: 0.0,
            azimuth_rad: 0.0,
            sin_cos: (0.0, 0.0),
            time_ns: 0,
        }
    }

    /// Points the head to where it is at a channel's shot.
    #[inline]
    pub fn aim(&mut self, channel: &Channel) {
        let turned_rad = self.rate_rad_per_ns * channel.delay_ns as f64;
        self.encoder_rad = self.row_azimuth_rad + turned_rad;
        self.azimuth_rad = self.encoder_rad + channel.azimuth_offset_rad;
        self.sin_cos = turn(self.row_sin_cos, turned_rad + channel.azimuth_offset_rad);
        self.time_ns = self.row_time_ns.saturating_add(channel.delay_ns);
    }

    /// Places one echo of the shot that was aimed last.
    #[inline]
    pub fn echo(
        &self,
        channel: &Channel,
        echo: RawReturn,
        return_index: u8,
        return_kind: ReturnKind,
        block: usize,
        out: &mut Decoded,
    ) {
        if echo.range == 0 {
            return;
        }
        let range_m = f64::from(echo.range) * self.range_unit_m + channel.range_offset_m;
        let level_m = range_m * channel.cos_elevation;
        let (sin, cos) = self.sin_cos;
        let height_m = range_m * channel.sin_elevation + channel.vertical_offset_m;
        out.encoder_rad.push(wrapped(self.encoder_rad));
        out.cloud.push(&Return {
            xyz_m: [
                (level_m * cos) as f32,
                (-level_m * sin) as f32,
                height_m as f32,
            ],
            time: Timestamp(self.time_ns),
            range_m: range_m as f32,
            azimuth_rad: wrapped(self.azimuth_rad),
            ring: channel.ring,
            intensity: u16::from(echo.intensity),
            return_index,
            return_kind,
            packet: self.packet,
            block: block as u16,
        });
    }

    /// Places the two echoes of one shot, the second of which stands in block `next` behind the first's.
    ///
    /// Which of the two is the brighter cannot be read from the intensity, which is corrected for
    /// range; so the nearer is called strongest even where the manual makes it the second strongest.
    pub fn pair(
        &mut self,
        channel: &Channel,
        echoes: [RawReturn; 2],
        block: usize,
        out: &mut Decoded,
    ) {
        self.aim(channel);
        let (kinds, merged) = judge(ReturnMode::Dual, &echoes);
        out.merged += u64::from(merged);
        for (place, (echo, kind)) in echoes.into_iter().zip(kinds).enumerate() {
            if let Some(kind) = kind {
                self.echo(channel, echo, place as u8, kind, block + place, out);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::velodyne::puck::{FIRING_NS, RANGE_UNIT_M, VLP16};
    use crate::packet::velodyne::{BLOCKS, LEN, RawBlock, encode};
    use rand::{RngExt, SeedableRng};
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

    /// A packet of which about `share` of the shots hit; the second echo often repeats the first.
    fn packet(rng: &mut ChaCha8Rng, mode: ReturnMode, share: f64) -> [u8; LEN] {
        let mut blocks = [RawBlock::default(); BLOCKS];
        for number in 0..BLOCKS {
            let row = number / mode.returns();
            blocks[number].azimuth_centideg = (35_900 + 39 * row as u16) % TURN_CENTIDEG;
            for shot in 0..CHANNELS {
                let range = rng.random_range(1..=u16::MAX);
                let range = if rng.random_bool(share) { range } else { 0 };
                let intensity = rng.random();
                let repeated = number % mode.returns() == 1 && rng.random_bool(0.3);
                blocks[number].returns[shot] = match repeated {
                    true => blocks[number - 1].returns[shot],
                    false => RawReturn { range, intensity },
                };
            }
        }
        encode(&blocks, 1_000_000, mode, 0x22)
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
            let [first, second] = [block, block + stride - 1].map(|block| packet.echoes(block));
            for shot in 0..CHANNELS {
                let firing_ns = (shot / 16) as i64 * FIRING_NS;
                let channel = Channel::new(&beams.channels()[shot % 16], firing_ns);
                if stride == 2 {
                    shots.pair(&channel, [first[shot], second[shot]], block, out);
                } else {
                    let kind = single_kind(packet.return_mode());
                    shots.aim(&channel);
                    shots.echo(&channel, first[shot], 0, kind, block, out);
                }
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
                let payload = packet(&mut rng, mode, share);
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
