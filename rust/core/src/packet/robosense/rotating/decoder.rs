//! From blocks of channels to returns: x forward, y left, azimuth clockwise from x.

use std::ops::RangeInclusive;

use super::turn::Turn;
use super::{Family, GUARD_M, Lens, Settings, Slot};
use crate::packet::aim::{add, small_turn, told};
use crate::packet::fan::{Beam, Desk, Known, Row, from_x};
use crate::packet::robosense::difop::Angles;
use crate::packet::robosense::layout::View;
use crate::packet::split::Following;
use crate::packet::{Decoded, Decoder, Place, ReturnMode};

/// One laser.
#[derive(Debug, Clone, Copy)]
struct Laser {
    ring: u16,
    elevation: (f64, f64),
    azimuth_rad: f64,
    azimuth: (f64, f64),
}

/// Neighbouring channels of a block that are neighbouring shots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Run {
    /// Place of the block in its firing.
    place: usize,
    channel: usize,
    echo: usize,
    lane: usize,
    length: usize,
}

/// What the channels of a firing are, for one number of returns.
#[derive(Debug, Clone, Default)]
struct Wiring {
    runs: Vec<Run>,
    /// Laser and delay of each shot; `None` for one that is not fired.
    shots: Vec<Option<(usize, i64)>>,
}

impl Wiring {
    fn new<F: Family>(family: &F, returns: usize, lasers: usize) -> Self {
        let mut wiring = Self::default();
        for place in 0..family.blocks_of_firing(returns) {
            for channel in 0..family.layout().channels {
                let slot = family.slot(returns, place, channel);
                if slot.laser < lasers && slot.shot < 2 && slot.echo < 2 {
                    let lane = slot.shot * family.lasers() + slot.laser;
                    wiring.wire(place, channel, lane, slot);
                }
            }
        }
        wiring
    }

    fn wire(&mut self, place: usize, channel: usize, lane: usize, slot: Slot) {
        let echo = slot.echo;
        if self.shots.len() <= lane {
            self.shots.resize(lane + 1, None);
        }
        self.shots[lane] = Some((slot.laser, slot.delay_ns));
        let last = self.runs.last_mut().filter(|run| {
            (run.place, run.echo) == (place, echo)
                && (run.channel + run.length, run.lane + run.length) == (channel, lane)
        });
        match last {
            Some(run) => run.length += 1,
            None => self.runs.push(Run {
                place,
                channel,
                echo,
                lane,
                length: 1,
            }),
        }
    }

    /// Lays the channels of a block on the desk.
    fn fill(
        &self,
        view: &View<'_>,
        (block, place): (usize, usize),
        kept: &RangeInclusive<u16>,
        desk: &mut Desk,
    ) {
        for run in self.runs.iter().filter(|run| run.place == place) {
            let echoes = desk.echoes(run.echo);
            let lanes = run.lane..run.lane + run.length;
            echoes.block[lanes.clone()].fill(block as u16);
            let ranges = &mut echoes.range[lanes.clone()];
            let intensities = &mut echoes.intensity[lanes];
            view.read(block, run.channel, kept, ranges, intensities);
        }
    }
}

pub(super) struct RotatingDecoder<F> {
    family: F,
    lasers: Vec<Laser>,
    settings: Settings,
    /// Number of the packet whose first block was taken with the packet before.
    taken: Option<u32>,
    /// For one and two returns.
    wirings: [Wiring; 2],
    /// By returns and step to the next firing.
    fans: Known<(usize, f64)>,
    desk: Desk,
}

impl<F: Family> RotatingDecoder<F> {
    pub fn new(family: F, angles: &Angles, settings: Settings) -> Self {
        let elevations = &angles.elevation_rad;
        // Rings count from the lowest laser; of equal ones the first is lower.
        let ring = |laser: usize| {
            let below = |other: &usize| {
                let order = elevations[*other].total_cmp(&elevations[laser]);
                order.is_lt() || order.is_eq() && *other < laser
            };
            (0..elevations.len()).filter(below).count() as u16
        };
        let lasers = elevations.iter().zip(&angles.azimuth_rad).enumerate();
        let lasers: Vec<Laser> = lasers
            .map(|(laser, (elevation_rad, azimuth_rad))| Laser {
                ring: ring(laser),
                elevation: elevation_rad.sin_cos(),
                azimuth_rad: *azimuth_rad,
                azimuth: azimuth_rad.sin_cos(),
            })
            .collect();
        Self {
            family,
            wirings: [1, 2].map(|returns| Wiring::new(&family, returns, lasers.len())),
            lasers,
            settings,
            taken: None,
            fans: Known::default(),
            desk: Desk::default(),
        }
    }

    /// The packet that follows, where its first block is of the firing of this packet's last one.
    fn shared<'a>(
        &self,
        view: &View<'_>,
        turn: &Turn,
        following: Option<Following<'a>>,
    ) -> Option<(View<'a>, u32)> {
        let following = following.filter(|_| turn.has_tail())?;
        let next = View::new(following.payload, self.family.layout())?;
        let is_shared = self.family.returns(&next) == self.family.returns(view)
            && Turn::of(&self.family, &next, 0.0).has_lead()
            && next.azimuth(0) == view.azimuth(view.blocks() - 1);
        is_shared.then_some((next, following.packet))
    }

    /// The mode of a packet: what the unit says, unless the packet has another number of returns.
    fn mode_of(&self, returns: usize) -> ReturnMode {
        let told = self.settings.mode.filter(|mode| mode.returns() == returns);
        told.unwrap_or(match returns {
            1 => ReturnMode::Strongest,
            _ => ReturnMode::Dual,
        })
    }

    /// Ranges within the limits of the model.
    fn kept(&self, unit_m: f64) -> RangeInclusive<u16> {
        let (least_m, most_m) = self.family.limits_m();
        let units = |limit_m: f64| ((limit_m + GUARD_M) / unit_m) as u16;
        units(least_m).saturating_add(1)..=units(most_m)
    }
}

/// The beam of a laser that fires when the rotor has turned so far.
fn beam(laser: &Laser, lens: Lens, turned_rad: f64, delay_ns: i64) -> Beam {
    let turned = small_turn(turned_rad);
    let ((sin, cos), (up, level)) = (add(laser.azimuth, turned), laser.elevation);
    Beam {
        ring: laser.ring,
        delay_ns,
        turned_rad: 0.0,
        azimuth_rad: turned_rad + laser.azimuth_rad,
        direction: [level * cos, level * sin, up],
        origin_m: [lens.out_m * turned.1, lens.out_m * turned.0, lens.up_m],
    }
}

impl<F: Family> Decoder for RotatingDecoder<F> {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        self.decode_before(payload, None, place, out);
    }

    fn decode_before(
        &mut self,
        payload: &[u8],
        following: Option<Following<'_>>,
        place: Place,
        out: &mut Decoded,
    ) {
        let Some(view) = View::new(payload, self.family.layout()) else {
            return out.drops.add("packet_size", 1);
        };
        let left_out = view.layout().blocks - view.blocks();
        out.drops.add("block_invalid", left_out as u64);
        let returns = self.family.returns(&view).clamp(1, 2);
        let rate = place.mean_rate_rad_per_ns;
        let turn = Turn::with_returns(&self.family, &view, returns, rate);
        let turn = turn.with_speed(self.settings.rpm);
        let shared = self.shared(&view, &turn, following);
        let is_lead_taken = self.taken == Some(place.packet);
        self.taken = shared.map(|(_, packet)| packet);
        let unit_m = self.family.unit_m(&view);
        let (mode, kept) = (self.mode_of(returns), self.kept(unit_m));
        for firing in usize::from(is_lead_taken)..turn.firings() {
            let (wiring, step_rad) = (&self.wirings[returns - 1], turn.step_rad(firing));
            let fan = self.fans.get((returns, step_rad), || {
                let (lens, lasers) = (self.family.lens(), &self.lasers);
                let aimed = |(laser, delay_ns): (usize, i64)| {
                    let turned_rad = turn.turned_until(step_rad, delay_ns);
                    beam(&lasers[laser], lens, turned_rad, delay_ns)
                };
                // What is not fired has no echo.
                let shots = wiring.shots.iter();
                shots
                    .map(|shot| shot.map_or(Beam::default(), aimed))
                    .collect()
            });
            let next = shared.filter(|_| firing + 1 == turn.firings());
            if next.is_some() {
                self.desk.flush(out);
            }
            self.desk.open(fan.len(), returns);
            let mut held = 0;
            for block in turn.blocks_of(firing) {
                wiring.fill(&view, block, &kept, &mut self.desk);
                held += 1;
            }
            if let Some((next, _)) = &next {
                wiring.fill(next, (0, held), &kept, &mut self.desk);
            }
            let encoder_rad = turn.azimuth_rad(firing);
            let other = next.map_or(place.packet, |(_, packet)| packet);
            let row = Row {
                encoder_rad,
                azimuth_rad: encoder_rad,
                axes: from_x(told(encoder_rad)),
                origin_m: [0.0; 3],
                unit_m,
                time_ns: (place.time + turn.start_ns(firing)).0,
                packets: [place.packet, other, other],
            };
            self.desk.push(fan, None, &row, mode, out);
        }
        self.desk.flush(out);
    }
}
