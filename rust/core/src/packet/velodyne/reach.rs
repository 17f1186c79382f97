//! Where the returns of a packet may lie: what is wanted in few directions need not be decoded in all.

use super::rotation::{MAX_ROWS, TURN, rows_of, steps, within_turn};
use super::rows::Channel;
use super::{CHANNELS, Packet};
use crate::angle::Arc;

/// Nearer than this to the spin axis a return may lie in any direction, metres.
const NEAR_M: f64 = 0.5;

/// How far from the azimuth of their row returns may lie.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    /// Largest offset of a channel, 0.01 degree; `None` where returns may lie behind the sensor.
    aside: Option<i32>,
    /// Rows from the first shot of one until after its last.
    rows: i32,
}

impl Reach {
    /// Of the shots of a row.
    pub fn new(channels: &[Channel; CHANNELS], row_ns: i64) -> Self {
        let most = |of: fn(&Channel) -> f64| channels.iter().map(of).fold(0.0, f64::max);
        let aside_rad = most(|channel| channel.azimuth_offset_rad.abs());
        let is_ahead = most(|channel| -channel.range_offset_m) < NEAR_M
            && channels.iter().all(|channel| channel.cos_elevation > 0.0);
        let last_ns = channels.iter().map(|channel| channel.delay_ns.abs()).max();
        Self {
            aside: is_ahead.then(|| (100.0 * aside_rad.to_degrees()).ceil() as i32 + 1),
            rows: (last_ns.unwrap_or(0) / row_ns + 1) as i32,
        }
    }

    /// Whether a return of the packet may lie in an arc of bearings, which run against azimuths.
    pub fn meets(&self, packet: &Packet<'_>, bearings: Arc) -> bool {
        let Some(aside) = self.aside else { return true };
        let (azimuths, count) = rows_of(packet, packet.return_mode().returns());
        let margin = self.rows.saturating_mul(widest_step(&azimuths, count));
        let margin = aside.saturating_add(margin);
        let from = (-100.0 * (bearings.from_rad + bearings.width_rad).to_degrees()).floor() as i32;
        let from = from.rem_euclid(TURN);
        let width = (100.0 * bearings.width_rad.to_degrees()).ceil() as i32 + 1;
        let is_within = |azimuth: i32| {
            let after = within_turn(azimuth - from);
            // Azimuths beyond a turn are not valid: the decoder is to say so.
            (azimuth >= TURN) | (after <= width + margin) | (TURN - after <= margin)
        };
        let azimuths = azimuths[..count].iter().copied().map(i32::from);
        azimuths.fold(false, |any, azimuth| any | is_within(azimuth))
    }
}

/// The rate of a packet is a mean of its steps, so that no shot lies farther from its row than the
/// widest of them; 0.01 degree.
fn widest_step(azimuths: &[u16; MAX_ROWS], rows: usize) -> i32 {
    let steps = steps(azimuths);
    let sizes = steps[..rows - 1].iter().map(|step| step.abs());
    sizes.max().unwrap_or(TURN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::wrap_turn;
    use crate::packet::velodyne::puck::VLP16;
    use crate::packet::velodyne::{BLOCKS, RawBlock, RawReturn, encode};
    use crate::packet::{Decoded, Place, ReturnMode};
    use crate::time::Timestamp;
    use proptest::prelude::*;

    fn payload(azimuths: &[u16], mode: ReturnMode) -> Vec<u8> {
        let mut blocks = [RawBlock::default(); BLOCKS];
        for (block, azimuth) in blocks.iter_mut().zip(azimuths) {
            block.azimuth_centideg = *azimuth;
            block.returns = [RawReturn {
                range: 5000,
                intensity: 1,
            }; CHANNELS];
        }
        encode(&blocks, 0, mode, 0x22).to_vec()
    }

    proptest! {
        /// Packets that turn evenly, and packets of noise.
        #[test]
        fn no_return_lies_where_none_is_said_to_be(
            start in 0u16..36_000, step in 0u16..60, noise in prop::collection::vec(any::<u16>(), 12),
            is_noise in any::<bool>(), is_dual in any::<bool>(), from in 0.0..6.2, width in 0.0..3.0,
        ) {
            let even: Vec<u16> = (0..12).map(|row| (start + row * step) % 36_000).collect();
            let mode = if is_dual { ReturnMode::Dual } else { ReturnMode::Strongest };
            let payload = payload(if is_noise { &noise } else { &even }, mode);
            let mut decoder = VLP16.decoder(&VLP16.beams()).unwrap();
            let bearings = Arc { from_rad: from, width_rad: width };
            if !decoder.may_meet(&payload, bearings) {
                let mut out = Decoded::default();
                let place = Place { time: Timestamp(0), packet: 0, mean_rate_rad_per_ns: 0.0 };
                decoder.decode(&payload, place, &mut out);
                let bearing = |[x, y, _]: [f32; 3]| f64::from(y).atan2(f64::from(x));
                let is_in = |p: &[f32; 3]| wrap_turn(bearing(*p) - from) <= width;
                prop_assert!(!out.cloud.xyz_m.iter().any(is_in));
            }
        }
    }

    #[test]
    fn a_packet_that_looks_elsewhere_is_told_from_one_that_does_not() {
        let decoder = VLP16.decoder(&VLP16.beams()).unwrap();
        let azimuths: Vec<u16> = (0..12).map(|row| 9_000 + row * 40).collect();
        let payload = payload(&azimuths, ReturnMode::Strongest);
        let arc = |from_deg: f64| Arc {
            from_rad: from_deg.to_radians(),
            width_rad: 0.1,
        };
        assert!(decoder.may_meet(&payload, arc(267.0)));
        assert!(!decoder.may_meet(&payload, arc(90.0)));
    }
}
