//! From packets of the C series to returns: x right, y forward, azimuth 0 along y.

use std::f64::consts::TAU;

use super::{Cx, is_usable};
use crate::cloud::{Return, ReturnKind};
use crate::packet::aim::wrapped;
use crate::packet::echoes::judge;
use crate::packet::leishen::difop::Difop;
use crate::packet::leishen::products::Product;
use crate::packet::velodyne::{BLOCKS, CHANNELS, RawReturn};
use crate::packet::{Decoded, Decoder, Place, ReturnMode};

/// Channels of a C32W whose beams lie aside, and by how much.
const ASIDE: [usize; 8] = [6, 7, 14, 15, 22, 23, 29, 30];
const ASIDE_DEG: f64 = 3.89;
/// Where the unit tells the elevation of each channel of a C32 of version 3.
const fn told_at(channel: usize) -> usize {
    channel / 2 + channel % 2 * 16
}

/// Angles of the lasers of one unit, degrees.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lasers {
    elevation_deg: Vec<f64>,
    azimuth_deg: [f64; CHANNELS],
}

impl Lasers {
    /// Those of the maker's table.
    pub fn nominal(product: &Product) -> Self {
        let mut azimuth_deg = [0.0; CHANNELS];
        if product.id == "c32w" {
            for channel in ASIDE {
                azimuth_deg[channel] = ASIDE_DEG;
            }
        }
        Self {
            elevation_deg: product.elevation_deg.to_vec(),
            azimuth_deg,
        }
    }

    /// Those that a unit tells; `None` where they are far off the table, so that they were not programmed.
    pub fn measured(&self, product: &Product, difop: &Difop<'_>) -> Option<Self> {
        let count = self.elevation_deg.len();
        let mut own = self.clone();
        let mut most_deg = 1.5;
        if product.id == "msc16" {
            let [elevations, azimuths] = difop.solid_deg();
            // Told from the even channels to the odd ones.
            for place in 0..count {
                own.elevation_deg[place % 8 * 2 + place / 8] = elevations[place % 16];
            }
            for (channel, azimuth) in own.azimuth_deg.iter_mut().enumerate() {
                *azimuth = azimuths[channel % 16];
            }
        } else {
            let told = difop.elevations_deg();
            let at = |channel: usize| {
                if count == 32 {
                    told_at(channel)
                } else {
                    channel
                }
            };
            own.elevation_deg = (0..count).map(|channel| told[at(channel)]).collect();
            if count == 32 {
                most_deg = 3.0;
                let [late, early] = difop.adjust_deg();
                for (channel, azimuth) in own.azimuth_deg.iter_mut().enumerate() {
                    *azimuth = if channel % 4 <= 1 { early } else { late };
                }
            }
        }
        let pairs = own.elevation_deg.iter().zip(&self.elevation_deg);
        let is_near = pairs
            .into_iter()
            .all(|(one, other)| (one - other).abs() <= most_deg);
        let is_aimed = own.azimuth_deg.iter().all(|angle| angle.abs() < 30.0);
        (is_near && is_aimed).then_some(own)
    }

    /// Number of a laser counted from the lowest; of equal ones the first is lower.
    fn ring(&self, laser: usize) -> u16 {
        let own = self.elevation_deg[laser];
        let is_below = |(place, other): &(usize, &f64)| {
            let order = other.total_cmp(&own);
            order.is_lt() || order.is_eq() && *place < laser
        };
        self.elevation_deg
            .iter()
            .enumerate()
            .filter(is_below)
            .count() as u16
    }
}

/// What decoding needs of a channel.
#[derive(Debug, Clone, Copy)]
struct Channel {
    ring: u16,
    sin_elevation: f64,
    cos_elevation: f64,
    azimuth_rad: f64,
}

pub(super) struct CxDecoder {
    cx: Cx,
    channels: [Channel; CHANNELS],
}

/// Where one block points and when it began.
struct Row {
    azimuth_rad: f64,
    step_rad: f64,
    time_ns: i64,
    block: usize,
}

impl CxDecoder {
    pub fn new(cx: Cx, lasers: &Lasers) -> Self {
        let count = lasers.elevation_deg.len().max(1);
        let channels = std::array::from_fn(|channel| {
            let laser = channel % count;
            let elevation_deg = lasers.elevation_deg.get(laser).copied().unwrap_or(0.0);
            let (sin_elevation, cos_elevation) = elevation_deg.to_radians().sin_cos();
            Channel {
                ring: lasers.ring(laser),
                sin_elevation,
                cos_elevation,
                azimuth_rad: lasers.azimuth_deg[channel].to_radians(),
            }
        });
        Self { cx, channels }
    }

    fn shot(
        &self,
        row: &Row,
        channel: usize,
        echoes: &[RawReturn],
        mode: ReturnMode,
        place: Place,
        out: &mut Decoded,
    ) {
        let (kinds, merged) = judge(mode, echoes);
        out.merged += u64::from(merged);
        let beam = &self.channels[channel];
        let encoder_rad = row.azimuth_rad + row.step_rad * channel as f64 / CHANNELS as f64;
        let azimuth_rad = encoder_rad + beam.azimuth_rad;
        let delay_ns = (channel as f64 * self.cx.shot_ns).round() as i64;
        let (sin, cos) = azimuth_rad.sin_cos();
        let (lens_m, behind_deg) = self.cx.product.lens;
        let (lens_sin, lens_cos) = (azimuth_rad - behind_deg.to_radians()).sin_cos();
        for (index, (echo, kind)) in echoes.iter().zip(kinds).enumerate() {
            let Some(kind): Option<ReturnKind> = kind else {
                continue;
            };
            let range_m = f64::from(echo.range) * self.cx.product.unit_m;
            let level_m = range_m * beam.cos_elevation;
            out.encoder_rad.push(wrapped(encoder_rad.rem_euclid(TAU)));
            out.cloud.push(&Return {
                xyz_m: [
                    (level_m * sin + lens_m * lens_sin) as f32,
                    (level_m * cos + lens_m * lens_cos) as f32,
                    (range_m * beam.sin_elevation) as f32,
                ],
                time: crate::time::Timestamp(row.time_ns.saturating_add(delay_ns)),
                range_m: range_m as f32,
                azimuth_rad: wrapped(azimuth_rad.rem_euclid(TAU)),
                ring: beam.ring,
                intensity: echo.intensity.into(),
                return_index: index as u8,
                return_kind: kind,
                packet: place.packet,
                block: (row.block + index) as u16,
            });
        }
    }
}

impl Decoder for CxDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = self.cx.blocks(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let mode = self.cx.mode(payload);
        let stride = mode.returns();
        let rotation = self.cx.rotation(&packet, mode, place.mean_rate_rad_per_ns);
        let usual_rad = rotation.rate_rad_per_ns() * self.cx.row_ns();
        for row in 0..BLOCKS / stride {
            let block = row * stride;
            if !is_usable(&packet, block) {
                out.drops.add("block_invalid", stride as u64);
                continue;
            }
            let azimuth_rad = rotation.azimuth_rad(row);
            // To the next block; the last one, and one before a gap, turns as the others do.
            let next = (row + 1 < BLOCKS / stride && is_usable(&packet, block + stride))
                .then(|| (rotation.azimuth_rad(row + 1) - azimuth_rad).rem_euclid(TAU));
            let step_rad = next
                .filter(|step| *step < 2.0 * usual_rad)
                .unwrap_or(usual_rad);
            let row = Row {
                azimuth_rad,
                step_rad,
                time_ns: place.time.0.saturating_add(rotation.start_ns(row)),
                block,
            };
            let seconds = packet.returns(block + stride - 1);
            for (channel, (one, other)) in packet.returns(block).zip(seconds).enumerate() {
                self.shot(&row, channel, &[one, other][..stride], mode, place, out);
            }
        }
    }
}
