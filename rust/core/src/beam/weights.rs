//! How data are weighted, what became of them, and what their residuals tell of their weights.

use nalgebra::Vector3;

use super::common::{self, Common};

/// Residuals beyond so many standard deviations count less.
const ROBUST: f64 = 3.0;

/// So often weights are taken from residuals.
const LEARNED: usize = 4;

/// How data are weighted.
#[derive(Debug, Clone)]
pub struct Weights {
    /// Standard deviation of a range of each lidar, metres.
    pub noise_m: Vec<f64>,
    /// Standard deviation of the surface about its model along the normal, shared by the echoes of a
    /// patch, metres.
    pub surface_m: f64,
    /// Standard deviation of an edge beyond that of the step between shots, rad.
    pub edge_rad: f64,
    /// At most so many echoes of a hold are used.
    pub echoes: usize,
    /// What the data of each hold have in common; empty before the first look at residuals.
    pub common: Vec<Common>,
    /// How often they were taken from residuals.
    pub learned: usize,
}

/// What became of the data of a hold.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// What all of them cost.
    pub cost: f64,
    /// Echoes that counted.
    pub used: Vec<Used>,
    /// Edges that counted.
    pub edges: Vec<EdgeMet>,
    /// Echoes whose rays miss the blade.
    pub missed: usize,
    /// Echoes beyond the gate.
    pub rejected: Vec<Used>,
    /// Echoes at grazing angles or ends of runs.
    pub unfit: usize,
    /// Edges that were soft, missed the blade, or lay beyond the gate or at no silhouette.
    pub edges_left_out: [usize; 3],
}

/// An echo that met the model, whether it counted or not.
#[derive(Debug, Clone, Copy)]
pub struct Used {
    /// Instant, nanoseconds.
    pub time_ns: i64,
    /// Number of the lidar.
    pub lidar: usize,
    /// Number of the beam.
    pub ring: usize,
    /// Arc length at which its ray meets the model, metres.
    pub s_m: f64,
    /// Measured minus modelled range, metres.
    pub residual_m: f64,
    /// Measured point, world, metres.
    pub point: Vector3<f64>,
    /// Chord fraction at which its ray meets the model; below 0 on the pressure side.
    pub chord: f64,
    /// Cosine of the angle of incidence.
    pub cosine: f64,
    /// Number of the patch of the surface, see [`common::patch`].
    pub patch: usize,
}

/// An edge that counted.
#[derive(Debug, Clone, Copy)]
pub struct EdgeMet {
    /// Number of the lidar.
    pub lidar: usize,
    /// Number of the beam.
    pub ring: usize,
    /// 0 at the leading edge, 1 at the trailing edge.
    pub side: usize,
    /// Measured minus modelled angle, rad.
    pub residual_rad: f64,
    /// Angle from shot to shot, rad.
    pub step_rad: f64,
}

impl Weights {
    /// Takes from the residuals about a blade that is found the noise of each lidar and what neighbouring
    /// data have in common: before, they have in common that it is elsewhere. After a few times they stay,
    /// or what they weigh would never come to rest.
    pub fn learn(&mut self, tallies: &[Tally]) {
        if self.learned == LEARNED {
            return;
        }
        self.learned += 1;
        self.learn_noise(tallies);
        self.surface_m = common::surface_m(tallies, &self.noise_m, self.surface_m);
        let of = |tally| Common::of(tally, &self.noise_m);
        self.common = tallies.iter().map(of).collect();
    }

    /// 1.48 of the median size of the residuals of each lidar.
    fn learn_noise(&mut self, tallies: &[Tally]) {
        for lidar in 0..self.noise_m.len() {
            let of = |t: &Tally| -> Vec<f64> {
                t.used
                    .iter()
                    .filter(|u| u.lidar == lidar)
                    .map(|u| u.residual_m.abs())
                    .collect()
            };
            let mut sizes: Vec<f64> = tallies.iter().flat_map(of).collect();
            if sizes.len() > 200 {
                let middle = sizes.len() / 2;
                let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
                self.noise_m[lidar] = (1.4826 * *median).clamp(0.002, 0.1);
            }
        }
    }
}

/// Share of its weight that a value keeps beyond a few of its deviations.
pub(super) fn let_go(value: f64, sigma: f64) -> f64 {
    robust(value, sigma, 0.0)
}

/// Share of its weight that a datum keeps: whole up to the first value, none from the second on.
pub(super) fn faded(value: f64, (whole, none): (f64, f64)) -> f64 {
    ((none - value) / (none - whole)).clamp(0.0, 1.0)
}

/// Weight of a residual: it fades beyond a few standard deviations, later while the gate is wide.
pub(super) fn robust(residual: f64, sigma: f64, gate: f64) -> f64 {
    1.0 / (1.0 + (residual / width(sigma, gate)).powi(2))
}

/// What a residual costs whose weight is that of [`robust`] over `variance`; beyond the gate no more.
pub(super) fn cost(residual: f64, sigma: f64, gate: f64, variance: f64) -> f64 {
    let width = width(sigma, gate);
    width * width / variance * (residual.abs().min(gate) / width).powi(2).ln_1p()
}

fn width(sigma: f64, gate: f64) -> f64 {
    (ROBUST * sigma).max(0.3 * gate)
}
