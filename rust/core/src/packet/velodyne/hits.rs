//! Which shots of a packet hit, and their returns in columns.

use super::CHANNELS;
use super::lanes::{Column, Lane, Placed, ROOM};
use crate::cloud::ReturnKind;
use crate::packet::echoes::{RawEcho, judge};
use crate::packet::{Decoded, ReturnMode};

/// Shots that there is room for.
const SHOTS: usize = ROOM * CHANNELS;

/// The hits of a packet, in the order of its shots. Meant to be used again and again.
pub struct Hits {
    count: usize,
    /// Among the placed shots.
    places: [u16; SHOTS],
    /// Places among the returns of the shot, and what they are, where there are two.
    meanings: [(u8, ReturnKind); SHOTS],
}

/// What all returns of a packet have in common.
#[derive(Debug, Clone, Copy)]
pub struct Origin<'a> {
    /// Number of the packet.
    pub packet: u32,
    /// Numbers of the beams of a block.
    pub ring: &'a Lane<u16>,
}

impl Default for Hits {
    fn default() -> Self {
        Self {
            count: 0,
            places: [0; SHOTS],
            meanings: [(0, ReturnKind::Strongest); SHOTS],
        }
    }
}

impl Hits {
    /// Appends the returns of a packet of single returns; echoes without range are none.
    pub fn push_single(
        &mut self,
        placed: &Placed,
        return_kind: ReturnKind,
        origin: Origin<'_>,
        out: &mut Decoded,
    ) {
        if placed.hits[..placed.blocks]
            .iter()
            .all(|hits| *hits == u32::MAX)
        {
            keep_all(placed, origin, out);
        } else {
            self.find(placed);
            self.keep(placed, origin, out);
        }
        if !out.is_slim {
            let len = out.cloud.len();
            out.cloud.return_index.resize(len, 0);
            out.cloud.return_kind.resize(len, return_kind);
        }
    }

    /// Appends the returns of a packet of two returns, row by row and shot by shot.
    ///
    /// Which of the two is the brighter cannot be read from the intensity, which is corrected for
    /// range; so the nearer is called strongest even where the manual makes it the second strongest.
    pub fn push_pairs(&mut self, placed: &Placed, origin: Origin<'_>, out: &mut Decoded) {
        out.merged += self.judge(placed);
        self.keep(placed, origin, out);
        if !out.is_slim {
            let meanings = &self.meanings[..self.count];
            let cloud = &mut out.cloud;
            cloud.return_index.extend(meanings.iter().map(|m| m.0));
            cloud.return_kind.extend(meanings.iter().map(|m| m.1));
        }
    }

    fn find(&mut self, placed: &Placed) {
        self.count = 0;
        for (block, hits) in placed.hits[..placed.blocks].iter().enumerate() {
            let mut left = *hits;
            while left != 0 {
                let place = block * CHANNELS + left.trailing_zeros() as usize;
                self.places[self.count % SHOTS] = place as u16;
                self.count += 1;
                left &= left - 1;
            }
        }
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

    /// Appends what all hits have, whatever they mean.
    fn keep(&self, placed: &Placed, origin: Origin<'_>, out: &mut Decoded) {
        let (places, cloud) = (&self.places[..self.count], &mut out.cloud);
        gather(&placed.encoder_rad, places, &mut out.encoder_rad);
        gather(&placed.xyz_m, places, &mut cloud.xyz_m);
        gather(&placed.time_ns, places, &mut cloud.time_ns);
        gather(&placed.azimuth_rad, places, &mut cloud.azimuth_rad);
        let beam = |place: &u16| origin.ring[usize::from(*place) % CHANNELS];
        cloud.ring.extend(places.iter().map(beam));
        if out.is_slim {
            return;
        }
        gather(&placed.range_m, places, &mut cloud.range_m);
        gather(&placed.intensity, places, &mut cloud.intensity);
        gather(&placed.block, places, &mut cloud.block);
        cloud.packet.resize(cloud.xyz_m.len(), origin.packet);
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

/// Appends all placed shots.
fn keep_all(placed: &Placed, origin: Origin<'_>, out: &mut Decoded) {
    fn append<T: Copy>(column: &Column<T>, blocks: usize, out: &mut Vec<T>) {
        out.extend_from_slice(column[..blocks].as_flattened());
    }
    let (blocks, cloud) = (placed.blocks, &mut out.cloud);
    append(&placed.encoder_rad, blocks, &mut out.encoder_rad);
    append(&placed.xyz_m, blocks, &mut cloud.xyz_m);
    append(&placed.time_ns, blocks, &mut cloud.time_ns);
    append(&placed.azimuth_rad, blocks, &mut cloud.azimuth_rad);
    for _ in 0..blocks {
        cloud.ring.extend_from_slice(origin.ring);
    }
    if out.is_slim {
        return;
    }
    append(&placed.range_m, blocks, &mut cloud.range_m);
    append(&placed.intensity, blocks, &mut cloud.intensity);
    append(&placed.block, blocks, &mut cloud.block);
    cloud.packet.resize(cloud.xyz_m.len(), origin.packet);
}
