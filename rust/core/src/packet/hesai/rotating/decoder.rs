//! From blocks of channels to returns: x right, y forward, azimuth 0 along y.

use std::f64::consts::TAU;

use super::{Family, firings};
use crate::packet::aim::told;
use crate::packet::fan::{Beam, Desk, Fan, Row, from_y};
use crate::packet::hesai::channels::Channels;
use crate::packet::hesai::layout::View;
use crate::packet::hesai::unit::Unit;
use crate::packet::{Decoded, Decoder, Place};
use crate::time::Timestamp;

/// The beams of one way to fire, at one speed, of all channels or of those of one loop.
#[derive(Debug, Clone)]
struct Aimed {
    rpm: f64,
    chosen: Option<usize>,
    fan: Fan,
}

pub(super) struct RotatingDecoder<F> {
    family: F,
    azimuth_rad: Vec<f64>,
    elevation: Vec<(f64, f64)>,
    delays_ns: Vec<Vec<f64>>,
    aimed: Vec<Aimed>,
    channels: Option<Channels>,
    near_m: f64,
    desk: Desk,
}

impl<F: Family> RotatingDecoder<F> {
    pub fn new(family: F, unit: &Unit, channels: Option<Channels>) -> Self {
        let lasers = unit.elevation_rad.len();
        let times = unit.fire_times.iter();
        let times = times.map(|(_, times)| times.iter().map(|ns| ns.unwrap_or(0.0)).collect());
        let mut delays_ns: Vec<Vec<f64>> = times.collect();
        if delays_ns.is_empty() {
            delays_ns.push(vec![0.0; lasers]);
        }
        let never = Aimed {
            rpm: f64::NAN,
            chosen: None,
            fan: Fan::default(),
        };
        let elevations = unit.elevation_rad.iter();
        Self {
            family,
            azimuth_rad: unit.azimuth_rad.clone(),
            elevation: elevations.map(|angle| angle.sin_cos()).collect(),
            aimed: vec![never; delays_ns.len()],
            delays_ns,
            channels,
            near_m: unit.near_m.unwrap_or(family.near_m()),
            desk: Desk::default(),
        }
    }

    /// Loop whose choice of lasers a firing has, `Some(None)` for all lasers; `None` where nothing tells them.
    fn chosen(&self, view: &View<'_>, first: usize) -> Option<Option<usize>> {
        let channels = view.layout().channels;
        let told = self.family.chosen_loop(view, first);
        let told = told.filter(|number| self.lasers_of(*number, channels).is_some());
        (told.is_some() || channels == self.elevation.len()).then_some(told)
    }

    fn lasers_of(&self, number: usize, channels: usize) -> Option<&[usize]> {
        self.channels.as_ref()?.of(number, channels)
    }

    /// Brings the beams of one way to fire to a speed and a choice of lasers.
    fn aim(&mut self, table: usize, view: &View<'_>, chosen: Option<usize>) -> usize {
        let (table, rpm) = (table.min(self.aimed.len() - 1), view.rpm());
        let aimed = &self.aimed[table];
        if aimed.rpm != rpm || aimed.chosen != chosen {
            let channels = view.layout().channels;
            let lasers = chosen.and_then(|number| self.lasers_of(number, channels));
            let beam = |laser| self.beam(table, laser, rpm);
            let fan = match lasers {
                Some(lasers) => lasers.iter().copied().map(beam).collect(),
                None => (0..self.elevation.len()).map(beam).collect(),
            };
            self.aimed[table] = Aimed { rpm, chosen, fan };
        }
        table
    }

    fn beam(&self, table: usize, laser: usize, rpm: f64) -> Beam {
        let delay_ns = self.delays_ns[table].get(laser).copied().unwrap_or(0.0);
        ray(
            laser,
            self.azimuth_rad[laser] + delay_ns * rpm * TAU / 60e9,
            self.elevation[laser],
            delay_ns,
        )
    }

    fn firing(&mut self, view: &View<'_>, first: usize, place: Place, out: &mut Decoded) {
        let returns = view.return_mode().returns() as u64;
        let Some(block_rad) = self.family.azimuth_rad(view, first) else {
            return out.drops.add("block_invalid", returns);
        };
        let Some(chosen) = self.chosen(view, first) else {
            return out.drops.add("channels_unknown", returns);
        };
        let (far, near) = self.family.fire_times(view, first);
        let [far, near] = [far, near].map(|table| self.aim(table, view, chosen));
        let firing = Firing {
            first,
            encoder_rad: self.family.encoder_rad(view, first).unwrap_or(block_rad),
            azimuth_rad: block_rad,
            time: place.time + (self.family.block_ns(view, first) - self.family.block_ns(view, 0)),
            least_range: self.family.least_range(),
            packet: place.packet,
        };
        let near = (near != far).then(|| (&self.aimed[near].fan, self.near_m));
        firing.place(view, &self.aimed[far].fan, near, &mut self.desk, out);
    }
}

/// The beam of a laser that points to an azimuth after the firing's, and fires later.
pub fn ray(laser: usize, azimuth_rad: f64, elevation: (f64, f64), delay_ns: f64) -> Beam {
    let (sin, cos) = azimuth_rad.sin_cos();
    let (up, level) = elevation;
    Beam {
        ring: laser as u16,
        delay_ns: delay_ns.round() as i64,
        azimuth_rad,
        direction: [level * cos, level * sin, up],
        ..Beam::default()
    }
}

/// One firing of all channels.
#[derive(Debug, Clone, Copy)]
pub struct Firing {
    /// First of its blocks.
    pub first: usize,
    /// Azimuth on the scale on which sweeps are cut.
    pub encoder_rad: f64,
    /// Azimuth of the rotor.
    pub azimuth_rad: f64,
    /// When it began.
    pub time: Timestamp,
    /// Least value of a range that is an echo.
    pub least_range: u16,
    /// Number of the packet.
    pub packet: u32,
}

impl Firing {
    /// Places the echoes; channels without a beam in `fan` give none.
    pub fn place(
        &self,
        view: &View<'_>,
        fan: &Fan,
        near: Option<(&Fan, f64)>,
        desk: &mut Desk,
        out: &mut Decoded,
    ) {
        let mode = view.return_mode();
        desk.open(fan.len(), mode.returns());
        for echo in 0..mode.returns() {
            let block = self.first + echo;
            let echoes = desk.echoes(echo);
            echoes.block.fill(block as u16);
            view.read(block, self.least_range, echoes.range, echoes.intensity);
        }
        let row = Row {
            encoder_rad: self.encoder_rad,
            azimuth_rad: self.azimuth_rad,
            axes: from_y(told(self.azimuth_rad)),
            origin_m: [0.0; 3],
            unit_m: view.layout().unit_m,
            time_ns: self.time.0,
            packets: [self.packet; 3],
        };
        desk.push(fan, near, &row, mode, out);
    }
}

impl<F: Family> Decoder for RotatingDecoder<F> {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let layout = self.family.layout(payload);
        let Some(view) = layout.and_then(|layout| View::new(payload, layout)) else {
            return out.drops.add("packet_size", 1);
        };
        let returns = view.return_mode().returns();
        out.drops
            .add("block_invalid", (view.layout().blocks % returns) as u64);
        for first in firings(&view) {
            self.firing(&view, first, place, out);
        }
        self.desk.flush(out);
    }
}
