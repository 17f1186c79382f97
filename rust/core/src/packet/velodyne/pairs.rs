//! Returns of a packet whose shots have two echoes each, in columns.

use super::CHANNELS;
use super::lanes::{Column, Lanes, Placed, SHOTS};
use crate::cloud::ReturnKind;
use crate::packet::echoes::{RawEcho, judge};
use crate::packet::{Decoded, ReturnMode};

/// The hits of a packet, row by row and shot by shot. Meant to be used again and again.
pub struct Pairs {
    count: usize,
    /// Among the placed shots.
    places: [u16; SHOTS],
    /// Places among the returns of the shot, and what they are.
    meanings: [(u8, ReturnKind); SHOTS],
}

impl Default for Pairs {
    fn default() -> Self {
        Self {
            count: 0,
            places: [0; SHOTS],
            meanings: [(0, ReturnKind::Strongest); SHOTS],
        }
    }
}

impl Pairs {
    /// Appends the returns of pairs of blocks.
    ///
    /// Which of the two is the brighter cannot be read from the intensity, which is corrected for
    /// range; so the nearer is called strongest even where the manual makes it the second strongest.
    pub fn push(&mut self, placed: &Placed, banks: &[Lanes], packet: u32, out: &mut Decoded) {
        out.merged += self.judge(placed);
        let places = &self.places[..self.count];
        gather(&placed.encoder_rad, places, &mut out.encoder_rad);
        let cloud = &mut out.cloud;
        let [x, y, z] = placed.xyz_m.each_ref().map(|axis| axis.as_flattened());
        let shots = || places.iter().map(|place| usize::from(*place) % SHOTS);
        cloud.xyz_m.extend(shots().map(|k| [x[k], y[k], z[k]]));
        let time_ns = |k: usize| placed.time_ns(banks, k / CHANNELS, k % CHANNELS);
        cloud.time_ns.extend(shots().map(time_ns));
        gather(&placed.azimuth_rad, places, &mut cloud.azimuth_rad);
        let ring = |k: usize| banks[placed.bank[k / CHANNELS]].ring[k % CHANNELS];
        cloud.ring.extend(shots().map(ring));
        if out.is_slim {
            return;
        }
        gather(&placed.range_m, places, &mut cloud.range_m);
        gather(&placed.intensity, places, &mut cloud.intensity);
        cloud
            .block
            .extend(shots().map(|k| placed.block[k / CHANNELS]));
        cloud.packet.resize(cloud.xyz_m.len(), packet);
        let meanings = self.meanings[..self.count].iter();
        cloud
            .return_index
            .extend(meanings.clone().map(|(echo, _)| echo));
        cloud.return_kind.extend(meanings.map(|(_, kind)| kind));
    }

    /// Tells the echoes of pairs of blocks; gives how many repeat another.
    fn judge(&mut self, placed: &Placed) -> u64 {
        let mut all_merged = 0;
        self.count = 0;
        for block in (0..placed.blocks).step_by(2) {
            for shot in 0..CHANNELS {
                let (kinds, merged) = judge(ReturnMode::Dual, &placed.echoes(block, shot));
                all_merged += u64::from(merged);
                for (echo, kind) in (0..2_u8).zip(kinds) {
                    let Some(kind) = kind else { continue };
                    let place = (block + usize::from(echo)) * CHANNELS + shot;
                    self.places[self.count % SHOTS] = place as u16;
                    self.meanings[self.count % SHOTS] = (echo, kind);
                    self.count += 1;
                }
            }
        }
        all_merged
    }
}

impl Placed {
    /// Both echoes of a shot of the pair of blocks that begins with `block`.
    fn echoes(&self, block: usize, shot: usize) -> [RawEcho; 2] {
        [block, block + 1].map(|block| RawEcho {
            range: self.raw_range[block][shot],
            intensity: self.intensity[block][shot] as u8,
        })
    }
}

fn gather<T: Copy>(column: &Column<T>, places: &[u16], out: &mut Vec<T>) {
    let shots = column.as_flattened();
    out.extend(
        places
            .iter()
            .map(|place| shots[usize::from(*place) % SHOTS]),
    );
}
