//! What is known of the unknowns before the data, stage by stage.

use nalgebra::DMatrix;

use super::adjust::{Adjustment, EDGE_OFFSET_RAD, Stage};
use super::family::Kind;
use super::layout::RIG;
use super::normal::Normal;
use super::weights::let_go;

/// A stress-free curvature known no better than this has to be found with the loads, rad/m.
const VAGUE_RAD_M: f64 = 1e-4;
/// Unknowns of a lidar's pose.
const POSE: usize = 6;
/// Inverse variance of what is held, against 1 of what is free.
const HELD: f64 = 1e6;
/// Standard deviation of the edges of a hold, lidar and side where no drawing tells how the nose turns away
/// from a lidar, rad.
const NOSE_RAD: f64 = 3e-4;
/// Edges whose offset keeps less than this share of its weight are let go ...
const LOOSE: f64 = 0.1;
/// ... and worth a word beyond this, rad.
const LOOSE_RAD: f64 = 1e-3;

impl Adjustment {
    /// Whether no drawing tells how the blade is bent without load.
    pub(super) fn is_vague(&self) -> bool {
        self.problem.trust.free_rad_m > VAGUE_RAD_M
    }

    /// Behind the last unknown that may change at a stage.
    pub(super) fn open_until(&self, stage: Stage) -> usize {
        match stage {
            Stage::Loads => self.layout.lidar_at(0),
            Stage::Blade => self.layout.shape_at(),
            Stage::Surface => self.layout.shape_at() + self.problem.shape.waves_from(),
            Stage::All => self.layout.len(),
        }
    }

    /// The first stage at which an unknown may change.
    fn needs(&self, unknown: usize) -> Stage {
        let surface = self.layout.shape_at();
        if (surface..surface + self.problem.shape.waves_from()).contains(&unknown) {
            return Stage::Surface;
        }
        if unknown >= self.layout.lidar_at(0) {
            return Stage::All;
        }
        let kind = if unknown < self.layout.shared {
            Some(self.shared[unknown].kind)
        } else {
            self.own
                .iter()
                .flatten()
                .nth(unknown - self.layout.shared)
                .map(|own| own.kind)
        };
        match kind {
            Some(Kind::Force { .. } | Kind::Weight(0)) => Stage::Loads,
            Some(Kind::Free { mode: 0 | 1, .. } | Kind::Prebend) if self.is_vague() => Stage::Loads,
            _ => Stage::Blade,
        }
    }

    /// Inverse variance of an unknown before the data.
    fn tightness_of(&self, unknown: usize) -> f64 {
        match self.layout.edge_group(unknown) {
            None => self.tightness[unknown],
            Some(group) => self.edge_tightness(group),
        }
    }

    /// The same of the edge offset of a hold, lidar and side. Its edges share the grid of the shots;
    /// where they lie far off, what ends the echoes is not the silhouette, and they shall not pull the
    /// blade.
    fn edge_tightness(&self, (hold, lidar, side): (usize, usize, usize)) -> f64 {
        let shared = match self.weights.common.get(hold) {
            Some(common) => common.side_variance(lidar, side),
            None => 0.0,
        };
        let nose_rad = if self.is_vague() { NOSE_RAD } else { 0.0 };
        let spread = ((nose_rad * nose_rad + shared).sqrt() / EDGE_OFFSET_RAD).hypot(1.0);
        let value = self.values[self.layout.edge_offset_at(hold, lidar, side)];
        let_go(value, spread) / (spread * spread)
    }

    /// Edges that end where the silhouette is not: hold, lidar, side, and how far outside, rad.
    pub fn loose_edges(&self) -> Vec<(usize, usize, usize, f64)> {
        let layout = &self.layout;
        let groups =
            (layout.edge_at() + 1..layout.range_at(0)).filter_map(|u| layout.edge_group(u));
        let offset = |(hold, lidar, side)| {
            let value = self.values[layout.edge_offset_at(hold, lidar, side)];
            (hold, lidar, side, value * EDGE_OFFSET_RAD)
        };
        let is_loose = |group: &(usize, usize, usize)| self.edge_tightness(*group) < LOOSE;
        groups
            .filter(is_loose)
            .map(offset)
            .filter(|found| found.3.abs() > LOOSE_RAD)
            .collect()
    }

    /// What is known before the data.
    pub(super) fn prior(&self, stage: Stage) -> Normal {
        let mut prior = Normal::new(&self.asked, &self.free);
        let (asked, free) = (self.asked.start, self.free.start);
        let (rig, count) = (self.layout.lidar_at(0), self.layout.rig_len());
        for i in self.free.clone() {
            let is_held = self.needs(i) > stage;
            let tight = if is_held { HELD } else { self.tightness_of(i) };
            prior.matrix[(i - asked, i - free)] = tight;
            prior.right[i - asked] = tight * (self.expected[i] - self.values[i]);
        }
        self.tie_clocks(&mut prior);
        self.smooth(&mut prior);
        if self.free.contains(&rig) {
            let information = self.rig_information(stage);
            let pull = &information * (&self.rig.prior - &self.rig.values);
            prior
                .matrix
                .view_mut((rig - asked, rig - free), (count, count))
                .copy_from(&information);
            prior.right.rows_mut(rig - asked, count).copy_from(&pull);
        }
        prior
    }

    /// How far the unknowns are from what was known before, as a weighted sum of squares.
    pub(super) fn surprise(&self, stage: Stage) -> f64 {
        let of = |i: usize| self.tightness_of(i) * (self.expected[i] - self.values[i]).powi(2);
        let rig = self.layout.lidar_at(0)..self.layout.shape_at();
        let apart: f64 = self.free.clone().filter(|i| !rig.contains(i)).map(of).sum();
        let own = apart + self.roughness();
        if !self.free.contains(&rig.start) {
            return own;
        }
        let off = &self.rig.prior - &self.rig.values;
        own + off.dot(&(self.rig_information(stage) * &off))
    }

    /// What is known of the lidars; while the blade is being found their ranges are held as well, or a beam
    /// that meets a saddle takes its offset for its own.
    fn rig_information(&self, stage: Stage) -> DMatrix<f64> {
        let mut information = self.rig.information.clone();
        match stage {
            Stage::Loads => information *= HELD,
            Stage::Blade | Stage::Surface => {
                for lidar in 0..self.layout.channels.len() {
                    let first = self.layout.lidar_at(lidar) - self.layout.lidar_at(0);
                    for k in first + POSE..first + RIG + self.layout.channels[lidar] {
                        information[(k, k)] *= HELD;
                    }
                }
            }
            Stage::All => {}
        }
        information
    }
}
