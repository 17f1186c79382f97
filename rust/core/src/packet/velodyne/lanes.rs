//! The 32 shots of one row, worked out side by side: fixed arrays and no branches,
//! so that the compiler makes vectors of them. The numbers are those of [`Shots`] to the bit.
//!
//! [`Shots`]: super::rows::Shots

use super::CHANNELS;
use super::rows::Channel;
use crate::cloud::ReturnKind;
use crate::packet::aim::{small_turn, wrapped};
use crate::packet::echoes::{RawEcho, judge};
use crate::packet::{Decoded, ReturnMode};
use crate::simd::{Kernel, vectorized};

type Lane<T> = [T; CHANNELS];

/// What decoding needs of the shots of a row, quantity by quantity.
pub struct Lanes {
    delay_ns: Lane<i64>,
    ring: Lane<u16>,
    azimuth_offset_rad: Lane<f64>,
    cos_elevation: Lane<f64>,
    sin_elevation: Lane<f64>,
    vertical_offset_m: Lane<f64>,
    range_offset_m: Lane<f64>,
    range_unit_m: f64,
    turn: Turned,
}

/// How far the head turns from the start of a row to each shot, at one rate.
struct Turned {
    rate_rad_per_ns: f64,
    turned_rad: Lane<f64>,
    sin: Lane<f64>,
    cos: Lane<f64>,
}

/// What is the same for all shots of a row.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Encoder azimuth at its start.
    pub azimuth_rad: f64,
    /// Instant of its start, nanoseconds since 1970 UTC.
    pub time_ns: i64,
    /// Number of the packet.
    pub packet: u32,
    /// Block of the packet, the first of two returns.
    pub block: u16,
}

/// The shots of a row, placed as if all of them had hit.
struct Placed {
    encoder_rad: Lane<f32>,
    azimuth_rad: Lane<f32>,
    range_m: Lane<f32>,
    xyz_m: Lane<[f32; 3]>,
    time_ns: Lane<i64>,
    intensity: Lane<u16>,
}

impl Lanes {
    /// For a sensor with these shots in a row.
    pub fn new(channels: &[Channel; CHANNELS], range_unit_m: f64) -> Self {
        let lane = |quantity: fn(&Channel) -> f64| std::array::from_fn(|k| quantity(&channels[k]));
        let mut lanes = Self {
            delay_ns: std::array::from_fn(|k| channels[k].delay_ns),
            ring: std::array::from_fn(|k| channels[k].ring),
            azimuth_offset_rad: lane(|c| c.azimuth_offset_rad),
            cos_elevation: lane(|c| c.cos_elevation),
            sin_elevation: lane(|c| c.sin_elevation),
            vertical_offset_m: lane(|c| c.vertical_offset_m),
            range_offset_m: lane(|c| c.range_offset_m),
            range_unit_m,
            turn: Turned {
                rate_rad_per_ns: 0.0,
                turned_rad: [0.0; CHANNELS],
                sin: [0.0; CHANNELS],
                cos: [0.0; CHANNELS],
            },
        };
        lanes.turn_by(0.0);
        lanes
    }

    /// Takes the rate of rotation of the packet.
    pub fn set_rate(&mut self, rate_rad_per_ns: f64) {
        if rate_rad_per_ns.to_bits() != self.turn.rate_rad_per_ns.to_bits() {
            self.turn_by(rate_rad_per_ns);
        }
    }

    fn turn_by(&mut self, rate_rad_per_ns: f64) {
        self.turn.rate_rad_per_ns = rate_rad_per_ns;
        for k in 0..CHANNELS {
            let turned_rad = rate_rad_per_ns * self.delay_ns[k] as f64;
            self.turn.turned_rad[k] = turned_rad;
            (self.turn.sin[k], self.turn.cos[k]) =
                small_turn(turned_rad + self.azimuth_offset_rad[k]);
        }
    }

    /// Appends the returns of a row of single returns; echoes without range are none.
    pub fn push(
        &self,
        row: Row,
        echoes: &Lane<RawEcho>,
        return_kind: ReturnKind,
        out: &mut Decoded,
    ) {
        match echoes.iter().filter(|echo| echo.range != 0).count() {
            0 => {}
            CHANNELS => self.keep_all(row, &self.place(row, echoes), return_kind, out),
            _ => {
                let mut hits = [Hit::default(); CHANNELS];
                let mut count = 0;
                for (shot, echo) in (0..).zip(echoes) {
                    hits[count] = Hit {
                        shot,
                        place: 0,
                        return_kind,
                    };
                    count += usize::from(echo.range != 0);
                }
                self.keep(&hits[..count], row, &[self.place(row, echoes)], out);
            }
        }
    }

    /// Appends the returns of a row of two returns, shot by shot.
    ///
    /// Which of the two is the brighter cannot be read from the intensity, which is corrected for
    /// range; so the nearer is called strongest even where the manual makes it the second strongest.
    pub fn push_pairs(&self, row: Row, echoes: [&Lane<RawEcho>; 2], out: &mut Decoded) {
        let mut hits = [Hit::default(); 2 * CHANNELS];
        let mut count = 0;
        for shot in 0..CHANNELS {
            let (kinds, merged) = judge(ReturnMode::Dual, &echoes.map(|lane| lane[shot]));
            out.merged += u64::from(merged);
            for (place, kind) in (0..2).zip(kinds) {
                let Some(return_kind) = kind else { continue };
                hits[count] = Hit {
                    shot: shot as u8,
                    place,
                    return_kind,
                };
                count += 1;
            }
        }
        if count > 0 {
            let placed = echoes.map(|echoes| self.place(row, echoes));
            self.keep(&hits[..count], row, &placed, out);
        }
    }

    fn place(&self, row: Row, echoes: &Lane<RawEcho>) -> Placed {
        vectorized(Place {
            lanes: self,
            row,
            echoes,
        })
    }

    /// Appends a row in which all shots hit.
    fn keep_all(&self, row: Row, placed: &Placed, return_kind: ReturnKind, out: &mut Decoded) {
        let cloud = &mut out.cloud;
        out.encoder_rad.extend_from_slice(&placed.encoder_rad);
        cloud.xyz_m.extend_from_slice(&placed.xyz_m);
        cloud.time_ns.extend_from_slice(&placed.time_ns);
        cloud.azimuth_rad.extend_from_slice(&placed.azimuth_rad);
        cloud.ring.extend_from_slice(&self.ring);
        if out.is_slim {
            return;
        }
        cloud.range_m.extend_from_slice(&placed.range_m);
        cloud.intensity.extend_from_slice(&placed.intensity);
        let len = cloud.xyz_m.len();
        cloud.return_index.resize(len, 0);
        cloud.return_kind.resize(len, return_kind);
        cloud.packet.resize(len, row.packet);
        cloud.block.resize(len, row.block);
    }

    /// Appends the hits of a row; `placed` has the shots of each of its blocks.
    fn keep(&self, hits: &[Hit], row: Row, placed: &[Placed], out: &mut Decoded) {
        let cloud = &mut out.cloud;
        let shots = || {
            hits.iter()
                .map(|hit| (&placed[usize::from(hit.place)], hit.shot()))
        };
        out.encoder_rad
            .extend(shots().map(|(p, k)| p.encoder_rad[k]));
        cloud.xyz_m.extend(shots().map(|(p, k)| p.xyz_m[k]));
        cloud.time_ns.extend(shots().map(|(p, k)| p.time_ns[k]));
        cloud
            .azimuth_rad
            .extend(shots().map(|(p, k)| p.azimuth_rad[k]));
        cloud.ring.extend(shots().map(|(_, k)| self.ring[k]));
        if out.is_slim {
            return;
        }
        cloud.range_m.extend(shots().map(|(p, k)| p.range_m[k]));
        cloud.intensity.extend(shots().map(|(p, k)| p.intensity[k]));
        cloud.return_index.extend(hits.iter().map(|hit| hit.place));
        cloud
            .return_kind
            .extend(hits.iter().map(|hit| hit.return_kind));
        let block = |hit: &Hit| row.block + u16::from(hit.place);
        cloud.block.extend(hits.iter().map(block));
        cloud
            .packet
            .resize(cloud.packet.len() + hits.len(), row.packet);
    }
}

/// A shot that hit.
#[derive(Debug, Clone, Copy)]
struct Hit {
    shot: u8,
    place: u8, // among the returns of the shot
    return_kind: ReturnKind,
}

impl Hit {
    #[inline(always)]
    fn shot(&self) -> usize {
        usize::from(self.shot) % CHANNELS
    }
}

impl Default for Hit {
    fn default() -> Self {
        Self {
            shot: 0,
            place: 0,
            return_kind: ReturnKind::Strongest,
        }
    }
}

/// Places all shots of a row.
struct Place<'a> {
    lanes: &'a Lanes,
    row: Row,
    echoes: &'a Lane<RawEcho>,
}

impl Kernel for Place<'_> {
    type Out = Placed;

    #[inline(always)]
    fn run(self) -> Placed {
        let Self { lanes, row, echoes } = self;
        let (row_sin, row_cos) = row.azimuth_rad.sin_cos();
        let mut placed = Placed {
            encoder_rad: [0.0; CHANNELS],
            azimuth_rad: [0.0; CHANNELS],
            range_m: [0.0; CHANNELS],
            xyz_m: [[0.0; 3]; CHANNELS],
            time_ns: lanes.delay_ns.map(|delay| row.time_ns.wrapping_add(delay)),
            intensity: echoes.map(|echo| echo.intensity.into()),
        };
        for k in 0..CHANNELS {
            let encoder_rad = row.azimuth_rad + lanes.turn.turned_rad[k];
            placed.encoder_rad[k] = wrapped(encoder_rad);
            placed.azimuth_rad[k] = wrapped(encoder_rad + lanes.azimuth_offset_rad[k]);
        }
        for (k, echo) in echoes.iter().enumerate() {
            let (sin_by, cos_by) = (lanes.turn.sin[k], lanes.turn.cos[k]);
            let sin = row_sin * cos_by + row_cos * sin_by;
            let cos = row_cos * cos_by - row_sin * sin_by;
            let range_m = f64::from(echo.range) * lanes.range_unit_m + lanes.range_offset_m[k];
            let level_m = range_m * lanes.cos_elevation[k];
            let height_m = range_m * lanes.sin_elevation[k] + lanes.vertical_offset_m[k];
            placed.range_m[k] = range_m as f32;
            placed.xyz_m[k] = [
                (level_m * cos) as f32,
                (-level_m * sin) as f32,
                height_m as f32,
            ];
        }
        placed
    }
}
