//! One adjustment of everything that is known: scans, survey, tapes and priors.
//!
//! Poses of all lidars, what is wrong with each (offset of every channel, elevation, range scale), the
//! surfaces with their bend and roughness, and targets are found together by robust Gauss-Newton; the
//! joint covariance of all of it follows from the same normal equations.

use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DMatrix, Vector3};
use thiserror::Error;

use super::field::Field;
use super::hold::Hold;
use super::judged::{GROSS, Judged, doubted, judged, largest, share};
use super::normal::{Normal, Solved};
use super::rows::{self, Place, Row};
use super::select::{self, Gate, Met};
use super::state::{Layout, State, Term};
use super::surface::{SHARED, Surface};
use super::survey::Known;
use super::target::{self, OnSphere};
use super::variogram::{self, Sample};
use crate::error::{Coded, InvalidValue};

/// Prior sigmas of what may be wrong with a lidar, and of the bend of a surface over half its extent.
#[derive(Debug, Clone, Copy)]
pub struct Priors {
    /// Of every channel's range offset, and of the common one of a unit, metres.
    pub channel_offset_u_m: f64,
    /// Of the elevation offset, radians.
    pub elevation_u_rad: f64,
    /// Of the range scale.
    pub range_scale_u: f64,
}

/// Sigma of a surface's bend over half its extent, metres.
const BEND_U_M: f64 = 0.02;
/// Steps of one adjustment.
const STEPS: usize = 12;
/// An adjustment has settled when no pose moves by more than this part of its sigma.
const SETTLED: f64 = 0.02;
/// The same where gates or weights change afterwards anyway.
const COARSE: f64 = 1.0;
/// Gates of the search for surfaces, from the first poses to good ones.
const GATES: [Gate; 3] = [
    Gate {
        near_m: 0.25,
        turn_rad: 0.02,
    },
    Gate {
        near_m: 0.1,
        turn_rad: 0.002,
    },
    Gate {
        near_m: 0.06,
        turn_rad: 0.0005,
    },
];
/// Heights within a square of this side are taken for alike while nothing is known of them, metres.
const ALIKE_M: f64 = 1.0;
/// A surface less rough than this is described by its smooth part alone, metres.
const SMOOTH_M: f64 = 5e-4;
/// Rounds in which roughness and the scatter of the channels' offsets are learned from what was found.
const LEARNING_ROUNDS: usize = 2;
/// It is not taken for less than this, metres.
const LEAST_OFFSET_U_M: f64 = 2e-3;
/// Prior sigma of a unit's error of range to retroreflectors, metres.
const RETRO_U_M: f64 = 0.02;
/// Prior sigma of how far a sphere is from round on the side that one lidar sees, metres.
const SKIN_U_M: f64 = 1e-3;
/// Prior sigma of a model's error of range to what is met at 60 degrees from its normal, metres.
const SLANT_U_M: f64 = 1.5e-3;
/// A turn less sure than this is held by no observation, radians.
const LOOSE_TURN_RAD: f64 = 0.01;
/// Holds nothing but an unknown that nothing else holds: radians, and metres.
const LOOSE_RAD: f64 = 1.0;
const LOOSE_M: f64 = 100.0;

/// Everything that goes in.
#[derive(Debug, Clone)]
pub struct Network {
    /// First guess; its surfaces are flat.
    pub start: State,
    /// What every lidar sees.
    pub holds: Vec<Hold>,
    /// What is known besides.
    pub known: Vec<Known>,
    /// What is wrong with a lidar to within what.
    pub priors: Priors,
}

impl Network {
    /// Refuses numbers that cannot be meant.
    ///
    /// # Errors
    /// [`InvalidValue`] naming what refers to a lidar, surface or target that is not there, or a sigma
    /// that is not positive.
    pub fn check(&self) -> Result<(), InvalidValue> {
        let parts = [
            self.start.lidars.len(),
            self.start.surfaces.len(),
            self.start.targets.len(),
        ];
        let wrong = self.known.iter().find(|known| !known.fits(parts));
        match wrong {
            None => Ok(()),
            Some(known) => Err(InvalidValue {
                name: "known",
                expected: "lidars, surfaces and targets that are there, positive sigmas".into(),
                found: format!("{known:?}"),
            }),
        }
    }
}

/// Everything that comes out.
#[derive(Debug, Clone)]
pub struct Adjusted {
    /// Estimates.
    pub state: State,
    /// Where they are in the covariance.
    pub layout: Layout,
    /// Joint covariance of the border's unknowns.
    pub covariance: DMatrix<f64>,
    /// Rays that met a surface.
    pub met: Vec<Met>,
    /// Their residuals, metres, and standard deviations; NaN where a ray was refused.
    pub residuals: Vec<[f64; 2]>,
    /// What became of everything known, in the order given.
    pub judged: Vec<Vec<Judged>>,
    /// Spheres as lidars saw them.
    pub seen: Vec<Seen>,
    /// Where those rays ended, world frame, metres.
    points_m: Vec<Vector3<f64>>,
    /// Scatter of the channels' offsets as found, metres.
    pub offset_u_m: f64,
    /// Steps taken after the last change.
    pub steps: usize,
    /// Whether it settled.
    pub converged: bool,
}

/// A sphere as one lidar saw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Which lidar.
    pub lidar: usize,
    /// Which target.
    pub target: usize,
    /// Echoes that agree.
    pub count: usize,
    /// Root mean square of their residuals, metres.
    pub rms_m: f64,
}

impl Adjusted {
    /// Where the rays that met a surface ended, world frame, metres.
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points_m
    }
}

/// Why there is no adjustment.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum NetworkError {
    /// Nothing to adjust.
    #[error("no ray of any lidar met a surface: {rays} rays, {surfaces} surfaces")]
    NothingMet {
        /// Mean rays of all lidars.
        rays: usize,
        /// Surfaces.
        surfaces: usize,
    },
    /// Normal equations without a solution.
    #[error("the normal equations of {unknowns} unknowns have no solution")]
    Singular {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// Somebody asked for it.
    #[error("the adjustment was stopped")]
    Stopped,
}

impl Coded for NetworkError {
    fn code(&self) -> &'static str {
        match self {
            Self::NothingMet { .. } => "calibration.nothing_met",
            Self::Singular { .. } => "calibration.singular",
            Self::Stopped => "calibration.stopped",
        }
    }

    fn hint(&self) -> Option<String> {
        Some("check position_m and axes of the lidars against the control points".into())
    }
}

/// Adjusts a network.
///
/// 1. Rays are given to surfaces and everything is adjusted with smooth surfaces, through ever
///    narrower gates. 2. The residuals tell the roughness, which joins the unknowns. 3. What was
///    surveyed wrongly is left out, the worst first, until all the rest agrees.
///
/// `stop` is looked at before every solution, so that a long adjustment can be given up.
///
/// # Errors
/// [`NetworkError`] where no surface is seen, nothing can be solved, or it was stopped.
pub fn adjust(network: &Network, stop: &AtomicBool) -> Result<Adjusted, NetworkError> {
    let mut work = Work::new(network, stop);
    for gate in &GATES {
        work.select(gate)?;
        work.settle(Doubt::All, COARSE)?;
    }
    let mut solved = work.settle(Doubt::All, COARSE)?;
    work.roughen(&solved);
    for _ in 0..LEARNING_ROUNDS {
        solved = work.settle(Doubt::All, COARSE)?;
        work.learn_offsets(&solved);
        work.roughen(&solved);
    }
    work.select(&GATES[GATES.len() - 1])?;
    solved = work.settle(Doubt::Rays, SETTLED)?;
    while let Some(worst) = work.worst(&solved) {
        work.left_out[worst] = true;
        solved = work.settle(Doubt::Rays, SETTLED)?;
    }
    Ok(work.finish(solved))
}

/// Whose large residuals weigh less.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Doubt {
    All,
    Rays,
}

struct Work<'a> {
    network: &'a Network,
    stop: &'a AtomicBool,
    state: State,
    layout: Layout,
    met: Vec<Met>,
    places: Vec<Place>,
    /// Of the roughness, by lidar.
    layers: Vec<usize>,
    spheres: Vec<OnSphere>,
    spheres_alike: Vec<f64>,
    slack_m: f64,
    left_out: Vec<bool>,
    offset_u_m: f64,
    steps: usize,
    converged: bool,
}

impl<'a> Work<'a> {
    fn new(network: &'a Network, stop: &'a AtomicBool) -> Self {
        Self {
            network,
            stop,
            state: network.start.clone(),
            layout: network.start.layout(),
            met: Vec::new(),
            places: Vec::new(),
            layers: vec![SHARED; network.start.lidars.len()],
            spheres: Vec::new(),
            spheres_alike: Vec::new(),
            slack_m: 0.0,
            left_out: vec![false; network.known.len()],
            offset_u_m: network.priors.channel_offset_u_m,
            steps: 0,
            converged: false,
        }
    }

    fn select(&mut self, gate: &Gate) -> Result<(), NetworkError> {
        let holds = self.network.holds.iter().enumerate();
        self.met = holds
            .flat_map(|(lidar, hold)| select::met(&self.state, hold, lidar, gate))
            .collect();
        self.select_spheres(gate);
        let mut known = self.network.known.iter();
        let has_sight = known.any(|known| matches!(known, Known::Sight(_)));
        if self.met.is_empty() && self.spheres.is_empty() && !has_sight {
            return Err(NetworkError::NothingMet {
                rays: self.network.holds.iter().map(|h| h.beams.len()).sum(),
                surfaces: self.state.surfaces.len(),
            });
        }
        self.places = self.places();
        Ok(())
    }

    /// Bright echoes of spheres: the wider the gate, the less each of them is believed.
    fn select_spheres(&mut self, gate: &Gate) {
        let near_m = |range_m: f64| gate.near_m + gate.turn_rad * range_m;
        let holds = self.network.holds.iter().enumerate();
        self.spheres = holds
            .flat_map(|(lidar, hold)| target::met(&self.state, hold, lidar, near_m))
            .collect();
        let mut counts = BTreeMap::new();
        for met in &self.spheres {
            *counts.entry((met.lidar, met.target)).or_insert(0.0) += 1.0;
        }
        let alike = |met: &OnSphere| counts[&(met.lidar, met.target)];
        self.spheres_alike = self.spheres.iter().map(alike).collect();
        let is_last = gate.near_m <= GATES[GATES.len() - 1].near_m;
        self.slack_m = if is_last { 0.0 } else { gate.near_m };
    }

    fn sphere(&self, met: &OnSphere, alike: f64) -> Option<Row> {
        let echo = &self.network.holds[met.lidar].bright[met.echo];
        rows::on_sphere(&self.state, &self.layout, met, echo, self.slack_m, alike)
    }

    /// Where each ray ended, and how many rays of its lidar share that: what the surface hides there is
    /// the same for all of them and does not average out.
    fn places(&self) -> Vec<Place> {
        let place = |met: &Met| {
            let beam = &self.network.holds[met.lidar].beams[met.beam];
            let point = select::world(&self.state.lidars[met.lidar], beam);
            let surface = &self.state.surfaces[met.surface];
            let side_m = surface.field.as_ref().map_or(ALIKE_M, Field::spacing_m);
            let [u, v, _] = surface.frame.local(&point);
            let cell = |t: f64| (t / side_m).floor() as i64;
            let around = surface.around(self.layers[met.lidar], &point);
            let slant = surface.slant(&self.state.lidars[met.lidar].position_m, &point);
            ((met.lidar, met.surface, cell(u), cell(v)), around, slant)
        };
        let places: Vec<_> = self.met.iter().map(place).collect();
        let mut counts = HashMap::new();
        for (cell, ..) in &places {
            *counts.entry(*cell).or_insert(0.0) += 1.0;
        }
        let places = places.into_iter().map(|(cell, around, slant)| Place {
            surface: cell.1,
            around,
            alike: counts[&cell],
            slant,
        });
        places.collect()
    }

    /// Gauss-Newton until no pose moves by more than this part of its sigma.
    fn settle(&mut self, doubt: Doubt, settled: f64) -> Result<Solved, NetworkError> {
        self.converged = false;
        let mut step = 1;
        loop {
            let solved = self.solve(doubt)?;
            self.state
                .advance(&self.layout, &solved.border, &solved.nodes);
            self.steps = step;
            let moved = self.moved(&solved);
            self.converged = moved < settled;
            if self.converged || step == STEPS {
                return Ok(solved);
            }
            step += 1;
        }
    }

    /// Largest step of a pose over its sigma.
    fn moved(&self, solved: &Solved) -> f64 {
        let poses = self
            .layout
            .lidars
            .iter()
            .flat_map(|at| *at..at + Term::ELEVATION);
        poses
            .map(|k| solved.border[k].abs() / solved.covariance[(k, k)].sqrt())
            .fold(0.0, f64::max)
    }

    fn solve(&self, doubt: Doubt) -> Result<Solved, NetworkError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(NetworkError::Stopped);
        }
        let mut normal = Normal::new(&self.state, &self.layout);
        for (met, place) in self.met.iter().zip(&self.places) {
            if let Some(row) = self.ray(met, place) {
                normal.add(&row, share(&row));
            }
        }
        for (met, alike) in self.spheres.iter().zip(&self.spheres_alike) {
            if let Some(row) = self.sphere(met, *alike) {
                normal.add(&row, share(&row));
            }
        }
        for (known, left_out) in self.network.known.iter().zip(&self.left_out) {
            for row in known.rows(&self.state, &self.layout) {
                let share = match (left_out, doubt) {
                    (true, _) => 0.0,
                    (_, Doubt::All) if known.may_be_wrong() => doubted(&row),
                    _ => 1.0,
                };
                normal.add(&row, share);
            }
        }
        self.hold_priors(&mut normal);
        normal.solve(&self.frozen()).ok_or(NetworkError::Singular {
            unknowns: self.layout.border + self.layout.nodes,
        })
    }

    /// Turns that do not move once rays keep the places where they ended, unless they are this sure: what
    /// nothing but a mounting holds would carry the rays over the roughness and back.
    fn frozen(&self) -> Vec<(usize, f64)> {
        let turns =
            |at: &usize| (*at + Term::ROTATION..*at + Term::POSITION).map(|k| (k, LOOSE_TURN_RAD));
        self.layout.lidars.iter().flat_map(turns).collect()
    }

    fn ray(&self, met: &Met, place: &Place) -> Option<Row> {
        let beam = &self.network.holds[met.lidar].beams[met.beam];
        rows::ray(&self.state, &self.layout, met.lidar, beam, place)
    }

    fn hold_priors(&self, normal: &mut Normal) {
        let priors = &self.network.priors;
        for (lidar, at) in self.state.lidars.iter().zip(&self.layout.lidars) {
            (0..3).for_each(|k| normal.hold(at + Term::ROTATION + k, 0.0, LOOSE_RAD));
            (0..3).for_each(|k| normal.hold(at + Term::POSITION + k, 0.0, LOOSE_M));
            normal.hold(
                at + Term::ELEVATION,
                lidar.elevation_rad,
                priors.elevation_u_rad,
            );
            normal.hold(at + Term::SCALE, lidar.scale, priors.range_scale_u);
            normal.hold_alike(at + Term::OFFSETS, &lidar.offsets_m, self.offset_u_m);
        }
        for (surface, at) in self.state.surfaces.iter().zip(&self.layout.surfaces) {
            (0..3).for_each(|k| normal.hold(at + k, 0.0, LOOSE_M));
            (3..6).for_each(|k| normal.hold(at + k, surface.coefficients[k], BEND_U_M));
        }
        let targets = self.layout.targets.iter().flat_map(|at| *at..at + 3);
        targets.for_each(|k| normal.hold(k, 0.0, LOOSE_M));
        for (lidar, at) in self.state.lidars.iter().zip(&self.layout.retro) {
            normal.hold(*at, lidar.retro_m, RETRO_U_M);
        }
        for (lidar, at) in self.state.lidars.iter().zip(&self.layout.skins) {
            let skins = lidar.skins_m.iter().enumerate();
            skins.for_each(|(k, skin_m)| normal.hold(at + k, *skin_m, SKIN_U_M));
        }
        let slants = self.state.lidars.iter().map(|lidar| lidar.slant_m);
        let slants: BTreeMap<_, _> = self.layout.slants.iter().zip(slants).collect();
        for (at, slant_m) in slants {
            normal.hold(*at, slant_m, SLANT_U_M);
        }
    }

    /// Takes the scatter of the channels about their lidar's mean from what was found: squares of the
    /// estimates plus their variances, one step of expectation and maximisation.
    fn learn_offsets(&mut self, solved: &Solved) {
        let (mut sum, mut freedom) = (0.0, 0.0);
        for (lidar, at) in self.state.lidars.iter().zip(&self.layout.lidars) {
            let count = lidar.offsets_m.len() as f64;
            let mean = lidar.offsets_m.iter().sum::<f64>() / count;
            sum += lidar
                .offsets_m
                .iter()
                .map(|c| (c - mean).powi(2))
                .sum::<f64>();
            let own = at + Term::OFFSETS;
            let block = solved
                .covariance
                .view((own, own), (lidar.offsets_m.len(), lidar.offsets_m.len()));
            sum += block.trace() - block.sum() / count;
            freedom += count - 1.0;
        }
        if freedom > 0.0 {
            let most = self.network.priors.channel_offset_u_m;
            self.offset_u_m = (sum / freedom)
                .sqrt()
                .clamp(LEAST_OFFSET_U_M.min(most), most);
        }
    }

    /// Gives every surface the roughness that its residuals show.
    fn roughen(&mut self, solved: &Solved) {
        self.layers = self.layers(solved);
        for surface in 0..self.state.surfaces.len() {
            let samples = self.samples(surface);
            let Some(roughness) = variogram::roughness(&samples) else {
                continue;
            };
            let layers = match roughness.sigma_m < SMOOTH_M {
                true => Vec::new(),
                false => self.places_by_layer(surface, &samples),
            };
            self.state.surfaces[surface].field = Some(Field::new(roughness, &layers));
        }
        self.layout = self.state.layout();
        self.places = self.places();
    }

    /// Layer of the roughness of every lidar: one of its own where nothing but a mounting holds a turn.
    fn layers(&self, solved: &Solved) -> Vec<usize> {
        let is_loose = |at: &usize| {
            let mut turns = *at + Term::ROTATION..*at + Term::POSITION;
            turns.any(|k| solved.covariance[(k, k)] > LOOSE_TURN_RAD * LOOSE_TURN_RAD)
        };
        let lidars = self.layout.lidars.iter().enumerate();
        lidars
            .map(|(lidar, at)| if is_loose(at) { lidar + 1 } else { SHARED })
            .collect()
    }

    /// Where on a surface something was measured, (u, v) by layer.
    fn places_by_layer(&self, surface: usize, samples: &[Sample]) -> Vec<Vec<[f64; 2]>> {
        let mut layers = vec![Vec::new(); self.layers.iter().max().map_or(1, |most| most + 1)];
        for sample in samples {
            layers[self.layers[sample.group]].push(sample.place_m);
        }
        for known in &self.network.known {
            if let Known::Control {
                surface: on, xyz_m, ..
            } = known
                && *on == surface
            {
                let [u, v, _] = self.state.surfaces[surface].frame.local(xyz_m);
                layers[SHARED].push([u, v]);
            }
        }
        layers
    }

    /// Residual heights of the rays on a surface.
    fn samples(&self, surface: usize) -> Vec<Sample> {
        let shape = Surface {
            field: None, // whatever is not smooth is what is looked for
            ..self.state.surfaces[surface].clone()
        };
        let all = self.met.iter().zip(&self.places);
        let on = all.filter(|(met, _)| met.surface == surface);
        on.filter_map(|(met, place)| {
            self.ray(met, place).filter(|row| share(row) > 0.0)?;
            let beam = &self.network.holds[met.lidar].beams[met.beam];
            let lidar = &self.state.lidars[met.lidar];
            let point = select::world(lidar, beam);
            let ray = (point - lidar.position_m) / beam.range_m;
            let point = point + ray * (lidar.slant_m * place.slant);
            let [u, v, _] = shape.frame.local(&point);
            let (height_m, gradient, _) = shape.above(&point);
            let cosine = gradient.dot(&ray).abs() / gradient.norm();
            Some(Sample {
                place_m: [u, v],
                height_m,
                noise_m2: (beam.sigma_m * cosine).powi(2)
                    + (rows::DIRECTION_U_RAD * beam.range_m).powi(2) * (1.0 - cosine * cosine),
                group: met.lidar,
            })
        })
        .collect()
    }

    /// The surveyed value whose residual is the least believable, if it is a gross error.
    fn worst(&self, solved: &Solved) -> Option<usize> {
        let judged = (0..self.network.known.len())
            .filter(|k| self.network.known[*k].may_be_wrong() && !self.left_out[*k])
            .map(|k| (k, largest(&self.judge(k, solved))));
        judged
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, studentised)| *studentised > GROSS)
            .map(|(k, _)| k)
    }

    fn judge(&self, known: usize, solved: &Solved) -> Vec<Judged> {
        let rows = self.network.known[known].rows(&self.state, &self.layout);
        let left_out = self.left_out[known];
        rows.iter()
            .map(|row| judged(row, solved.variance(row), left_out))
            .collect()
    }

    fn seen(&self) -> Vec<Seen> {
        let mut sums: BTreeMap<(usize, usize), (usize, f64)> = BTreeMap::new();
        for (met, alike) in self.spheres.iter().zip(&self.spheres_alike) {
            let row = self.sphere(met, *alike);
            if let Some(row) = row.filter(|row| share(row) > 0.0) {
                let sum = sums.entry((met.lidar, met.target)).or_default();
                *sum = (sum.0 + 1, sum.1 + row.residual.powi(2));
            }
        }
        let seen = |((lidar, target), (count, squares)): (_, (usize, f64))| Seen {
            lidar,
            target,
            count,
            rms_m: (squares / count as f64).sqrt(),
        };
        sums.into_iter().map(seen).collect()
    }

    fn finish(self, solved: Solved) -> Adjusted {
        let rays = self.met.iter().zip(&self.places);
        let residuals = rays.map(|(met, place)| match self.ray(met, place) {
            Some(row) if share(&row) > 0.0 => [row.residual, row.sigma],
            _ => [f64::NAN; 2],
        });
        let points = self.met.iter().map(|met| {
            let beam = &self.network.holds[met.lidar].beams[met.beam];
            select::world(&self.state.lidars[met.lidar], beam)
        });
        Adjusted {
            seen: self.seen(),
            points_m: points.collect(),
            residuals: residuals.collect(),
            judged: (0..self.network.known.len())
                .map(|k| self.judge(k, &solved))
                .collect(),
            covariance: solved.covariance,
            state: self.state,
            layout: self.layout,
            met: self.met,
            offset_u_m: self.offset_u_m,
            steps: self.steps,
            converged: self.converged,
        }
    }
}
