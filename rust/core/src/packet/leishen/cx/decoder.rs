//! From packets of the C series to returns: x right, y forward, azimuth 0 along y.

use std::f64::consts::TAU;

use super::{Cx, is_usable};
use crate::packet::aim::{RAD_PER_CENTIDEG, add, small_turn, told};
use crate::packet::fan::{Beam, Desk, Fan, Known, Row, from_y};
use crate::packet::leishen::difop::Difop;
use crate::packet::leishen::products::Product;
use crate::packet::velodyne::{BLOCKS, CHANNELS, Packet};
use crate::packet::{Decoded, Decoder, Place};

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
    elevation: (f64, f64),
    azimuth_rad: f64,
    azimuth: (f64, f64),
    /// Direction from the axis to the lens.
    lens: (f64, f64),
    delay_ns: i64,
}

pub(super) struct CxDecoder {
    cx: Cx,
    channels: [Channel; CHANNELS],
    /// By step to the next block.
    fans: Known<f64>,
    desk: Desk,
}

impl CxDecoder {
    pub fn new(cx: Cx, lasers: &Lasers) -> Self {
        let count = lasers.elevation_deg.len().max(1);
        let behind_rad = cx.product.lens.1.to_radians();
        let channels = std::array::from_fn(|channel| {
            let laser = channel % count;
            let elevation_deg = lasers.elevation_deg.get(laser).copied().unwrap_or(0.0);
            let azimuth_rad = lasers.azimuth_deg[channel].to_radians();
            Channel {
                ring: lasers.ring(laser),
                elevation: elevation_deg.to_radians().sin_cos(),
                azimuth_rad,
                azimuth: azimuth_rad.sin_cos(),
                lens: (azimuth_rad - behind_rad).sin_cos(),
                delay_ns: (channel as f64 * cx.shot_ns).round() as i64,
            }
        });
        Self {
            cx,
            channels,
            fans: Known::default(),
            desk: Desk::default(),
        }
    }

    /// Lays a block's echoes on the desk, those of the return with this number.
    fn fill(&mut self, packet: &Packet<'_>, block: usize, echo: usize) {
        let room = self.desk.echoes(echo);
        room.block.fill(block as u16);
        let room = room.range.iter_mut().zip(room.intensity);
        for ((range, intensity), raw) in room.zip(packet.echoes(block)) {
            *range = raw.range.into();
            *intensity = raw.intensity.into();
        }
    }
}

/// The beams of a block, between which the rotor turns in equal steps.
fn fan(channels: &[Channel; CHANNELS], step_rad: f64, lens_m: f64) -> Fan {
    let beam = |(number, channel): (usize, &Channel)| {
        let turned_rad = step_rad * number as f64 / CHANNELS as f64;
        let turned = small_turn(turned_rad);
        let ((sin, cos), (up, level)) = (add(channel.azimuth, turned), channel.elevation);
        let (lens_sin, lens_cos) = add(channel.lens, turned);
        Beam {
            ring: channel.ring,
            delay_ns: channel.delay_ns,
            turned_rad,
            azimuth_rad: turned_rad + channel.azimuth_rad,
            direction: [level * cos, level * sin, up],
            origin_m: [lens_m * lens_cos, lens_m * lens_sin, 0.0],
        }
    };
    channels.iter().enumerate().map(beam).collect()
}

/// Steps between stated azimuths are whole hundredths of a degree, but for the rounding of their difference.
fn on_grid(step_rad: f64) -> f64 {
    let centideg = step_rad / RAD_PER_CENTIDEG;
    let is_whole = (centideg - centideg.round()).abs() < 1e-6;
    if is_whole {
        centideg.round() * RAD_PER_CENTIDEG
    } else {
        step_rad
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
        let (lens_m, _) = self.cx.product.lens;
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
            self.desk.open(CHANNELS, stride);
            (0..stride).for_each(|echo| self.fill(&packet, block + echo, echo));
            let step_rad = on_grid(step_rad);
            let make = || fan(&self.channels, step_rad, lens_m);
            let fan = self.fans.get(step_rad, make);
            let row = Row {
                encoder_rad: azimuth_rad,
                azimuth_rad,
                axes: from_y(told(azimuth_rad)),
                origin_m: [0.0; 3],
                unit_m: self.cx.product.unit_m,
                time_ns: place.time.0.saturating_add(rotation.start_ns(row)),
                packets: [place.packet; 3],
            };
            self.desk.push(fan, None, &row, mode, out);
        }
        self.desk.flush(out);
    }
}
