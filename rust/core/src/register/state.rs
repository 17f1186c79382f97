//! The unknowns of the adjustment: poses, what is wrong with each lidar, surfaces, targets.

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Vector3};

use super::surface::{COEFFICIENTS, Height, Surface};
use super::target::Target;

/// Roughness of a surface before anything is known of it, metres.
pub const UNKNOWN_ROUGHNESS_M: f64 = 0.02;

/// One lidar as it is taken to stand.
#[derive(Debug, Clone)]
pub struct LidarState {
    /// World from sensor.
    pub rotation: Rotation3<f64>,
    /// Optical centre, world frame, metres.
    pub position_m: Vector3<f64>,
    /// True elevations are larger than the nominal ones by this, radians.
    pub elevation_rad: f64,
    /// True ranges are larger by this factor, plus the offset of the channel.
    pub scale: f64,
    /// By ring, metres: measured + offset = true.
    pub offsets_m: Vec<f64>,
    /// The same of echoes of retroreflectors on top, metres.
    pub retro_m: f64,
    /// The same of each target on top: how far it is from round on the side that this lidar sees, metres.
    pub skins_m: Vec<f64>,
    /// The same of what is met slantwise on top, times 1 / cos(incidence) - 1, metres.
    pub slant_m: f64,
}

/// Everything that is estimated.
#[derive(Debug, Clone)]
pub struct State {
    /// Lidars.
    pub lidars: Vec<LidarState>,
    /// Surfaces.
    pub surfaces: Vec<Surface>,
    /// Targets.
    pub targets: Vec<Target>,
}

/// Places of the unknowns of one lidar, from its first.
pub struct Term;

impl Term {
    /// Rotation vector about the world axes, three places.
    pub const ROTATION: usize = 0;
    /// Position, three places.
    pub const POSITION: usize = 3;
    /// Elevation offset.
    pub const ELEVATION: usize = 6;
    /// Range scale.
    pub const SCALE: usize = 7;
    /// First of the channels' offsets.
    pub const OFFSETS: usize = 8;
}

/// Where the unknowns of every part begin: those of the border in one sequence, nodes in another.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    /// By lidar.
    pub lidars: Vec<usize>,
    /// By surface.
    pub surfaces: Vec<usize>,
    /// By target.
    pub targets: Vec<usize>,
    /// Error of range to retroreflectors, by lidar; empty without targets.
    pub retro: Vec<usize>,
    /// First of the targets' own errors of range, by lidar.
    pub skins: Vec<usize>,
    /// Error of range to what is met slantwise, by lidar: one unknown of all with as many channels, as
    /// optics and electronics of a model make it.
    pub slants: Vec<usize>,
    /// Number of unknowns of the border.
    pub border: usize,
    /// First node by surface.
    pub fields: Vec<usize>,
    /// Number of nodes.
    pub nodes: usize,
}

impl State {
    /// Where its unknowns are.
    pub fn layout(&self) -> Layout {
        let mut layout = Layout::default();
        let mut next = |length: usize| {
            let start = layout.border;
            layout.border += length;
            start
        };
        let lidars = self
            .lidars
            .iter()
            .map(|l| Term::OFFSETS + l.offsets_m.len());
        layout.lidars = lidars.map(&mut next).collect();
        layout.surfaces = self.surfaces.iter().map(|_| next(COEFFICIENTS)).collect();
        layout.targets = self.targets.iter().map(|_| next(3)).collect();
        let bright = self.lidars.iter().filter(|_| !self.targets.is_empty());
        layout.retro = bright.map(|_| next(1)).collect();
        let skins = self.lidars.iter().map(|lidar| lidar.skins_m.len());
        layout.skins = skins.map(&mut next).collect();
        let mut of_kind = BTreeMap::new();
        let kinds = self.lidars.iter().map(|lidar| lidar.offsets_m.len());
        layout.slants = kinds
            .map(|channels| *of_kind.entry(channels).or_insert_with(|| next(1)))
            .collect();
        for surface in &self.surfaces {
            layout.fields.push(layout.nodes);
            layout.nodes += surface.field.as_ref().map_or(0, super::field::Field::len);
        }
        layout
    }

    /// What a point of a surface may differ by from its modelled height, metres.
    pub fn unseen_m(&self, surface: usize, height: &Height) -> f64 {
        let Some(field) = &self.surfaces[surface].field else {
            return UNKNOWN_ROUGHNESS_M;
        };
        let roughness = field.roughness();
        match height.around {
            Some(_) => roughness.nugget_m.hypot(field.between_m()),
            None => roughness.nugget_m.hypot(roughness.sigma_m),
        }
    }

    /// Moves all unknowns by a step.
    pub fn advance(&mut self, layout: &Layout, border: &[f64], nodes: &[f64]) {
        let vector = |at: usize| Vector3::new(border[at], border[at + 1], border[at + 2]);
        for (lidar, at) in self.lidars.iter_mut().zip(&layout.lidars) {
            lidar.rotation = Rotation3::new(vector(at + Term::ROTATION)) * lidar.rotation;
            lidar.position_m += vector(at + Term::POSITION);
            lidar.elevation_rad += border[at + Term::ELEVATION];
            lidar.scale += border[at + Term::SCALE];
            let steps = &border[at + Term::OFFSETS..];
            lidar
                .offsets_m
                .iter_mut()
                .zip(steps)
                .for_each(|(x, dx)| *x += dx);
        }
        for (k, surface) in self.surfaces.iter_mut().enumerate() {
            let steps = &border[layout.surfaces[k]..];
            surface
                .coefficients
                .iter_mut()
                .zip(steps)
                .for_each(|(x, dx)| *x += dx);
            if let Some(field) = &mut surface.field {
                let steps = &nodes[layout.fields[k]..];
                field
                    .heights_m
                    .iter_mut()
                    .zip(steps)
                    .for_each(|(x, dx)| *x += dx);
            }
        }
        for (target, at) in self.targets.iter_mut().zip(&layout.targets) {
            target.centre_m += vector(*at);
        }
        for (lidar, at) in self.lidars.iter_mut().zip(&layout.retro) {
            lidar.retro_m += border[*at];
        }
        for (lidar, at) in self.lidars.iter_mut().zip(&layout.skins) {
            let steps = &border[*at..];
            lidar
                .skins_m
                .iter_mut()
                .zip(steps)
                .for_each(|(x, dx)| *x += dx);
        }
        for (lidar, at) in self.lidars.iter_mut().zip(&layout.slants) {
            lidar.slant_m += border[*at];
        }
    }
}
