//! The plain twin of decoding, for tests: shot by shot and echo by echo.

use super::rows::Channel;
use super::{BLOCKS, CHANNELS, LEN, RawBlock, RawReturn, TURN_CENTIDEG, encode};
use crate::cloud::{Return, ReturnKind};
use crate::packet::aim::{turn, wrapped};
use crate::packet::echoes::{judge, single_kind};
use crate::packet::{Decoded, Place, ReturnMode};
use crate::time::Timestamp;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

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
    fn aim(&mut self, channel: &Channel) {
        let turned_rad = self.rate_rad_per_ns * channel.delay_ns as f64;
        self.encoder_rad = self.row_azimuth_rad + turned_rad;
        self.azimuth_rad = self.encoder_rad + channel.azimuth_offset_rad;
        self.sin_cos = turn(self.row_sin_cos, turned_rad + channel.azimuth_offset_rad);
        self.time_ns = self.row_time_ns.saturating_add(channel.delay_ns);
    }

    /// Places one echo of the shot that was aimed last.
    fn echo(
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

    /// Places the echoes of one shot, in single return the first alone.
    pub fn shot(
        &mut self,
        channel: &Channel,
        (first, second): (RawReturn, RawReturn),
        mode: ReturnMode,
        block: usize,
        out: &mut Decoded,
    ) {
        if mode.returns() == 2 {
            return self.pair(channel, [first, second], block, out);
        }
        self.aim(channel);
        self.echo(channel, first, 0, single_kind(mode), block, out);
    }

    /// Places the two echoes of one shot, the second of which stands in block `next` behind the first's.
    ///
    /// Which of the two is the brighter cannot be read from the intensity, which is corrected for
    /// range; so the nearer is called strongest even where the manual makes it the second strongest.
    fn pair(&mut self, channel: &Channel, echoes: [RawReturn; 2], block: usize, out: &mut Decoded) {
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

/// A packet of which about `share` of the shots of `banks` banks hit; the second echo often repeats the first.
pub fn random_packet(rng: &mut ChaCha8Rng, mode: ReturnMode, share: f64, banks: u8) -> [u8; LEN] {
    let mut blocks = [RawBlock::default(); BLOCKS];
    for number in 0..BLOCKS {
        let row = number / mode.returns();
        blocks[number].bank = row as u8 % banks;
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
