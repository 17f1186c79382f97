//! Errors that neighbouring data have in common: many of them tell less than their number says.
//!
//! Echoes on one patch of the surface share what the built surface differs from its model there, and
//! the ends of scan lines share the grid of the shots where sweeps repeat it. A group of `n` with a
//! common variance `c` beside their own variances `v` knows its mean to `c + 1 / sum(1 / v)`; each
//! member is given the weight that makes it so. All variances are estimated from residuals.

use std::collections::BTreeMap;

use super::weights::{EdgeMet, Tally, Used};

/// Length of a patch along the span, metres: waves of built surfaces are not much shorter.
const PATCH_M: f64 = 1.5;
/// Patches over the chord of a side.
const PATCHES: usize = 5;
/// A patch of fewer echoes tells nothing of the surface.
const FEW_ECHOES: usize = 5;
/// Fewer repetitions than this tell nothing of the grid of the shots.
const FEW_EDGES: usize = 5;
/// Bounds of what is estimated for the surface, metres.
const SURFACE_M: (f64, f64) = (0.0002, 0.03);
/// A mean beyond so many deviations counts as one at them.
const CLIPPED: f64 = 3.0;

/// What the data of one hold have in common.
#[derive(Debug, Clone, Default)]
pub struct Common {
    /// Sum of the inverse variances along the normal, by patch, 1/m^2.
    patches: Vec<f64>,
    ends: BTreeMap<(usize, usize), Ends>,
}

/// Edges of one lidar and side: variances of one edge by itself, of what the sweeps of a beam share
/// and of what all beams share, rad^2; and edges by beam.
#[derive(Debug, Clone, Default)]
struct Ends {
    own: f64,
    beam: f64,
    side: f64,
    count: BTreeMap<usize, usize>,
}

/// Number of the patch at an arc length, side and place along the chord.
pub fn patch(s_m: f64, is_second_side: bool, x_c: f64) -> usize {
    let over_chord = ((x_c * PATCHES as f64) as usize).min(PATCHES - 1);
    let along = (s_m / PATCH_M).max(0.0) as usize;
    (2 * along + usize::from(is_second_side)) * PATCHES + over_chord
}

impl Common {
    /// Reads off a tally what its data have in common, by the noise of each lidar in metres.
    pub fn of(tally: &Tally, noise_m: &[f64]) -> Self {
        let mut common = Self::default();
        for used in &tally.used {
            if common.patches.len() <= used.patch {
                common.patches.resize(used.patch + 1, 0.0);
            }
            common.patches[used.patch] += weight(used, noise_m);
        }
        let mut groups: BTreeMap<(usize, usize), Vec<&EdgeMet>> = BTreeMap::new();
        for edge in &tally.edges {
            groups
                .entry((edge.lidar, edge.side))
                .or_default()
                .push(edge);
        }
        let ends = groups.into_iter();
        common.ends = ends.map(|(key, edges)| (key, Ends::of(&edges))).collect();
        common
    }

    /// How many times larger the variance of an echo on a patch is for what it shares with others.
    pub fn echo_factor(&self, patch: usize, surface_m: f64, alone: f64) -> f64 {
        let sum = self.patches.get(patch).copied().unwrap_or(0.0);
        1.0 + surface_m * surface_m * sum.max(alone)
    }

    /// Variance with which an edge counts, rad^2; none where nothing is known of its like.
    pub fn edge_variance(&self, lidar: usize, side: usize, ring: usize) -> Option<f64> {
        let ends = self.ends.get(&(lidar, side))?;
        let count = ends.count.get(&ring).copied().unwrap_or(1) as f64;
        Some(ends.own + count * ends.beam)
    }

    /// Variance that all edges of a lidar and side share, rad^2.
    pub fn side_variance(&self, lidar: usize, side: usize) -> f64 {
        self.ends.get(&(lidar, side)).map_or(0.0, |ends| ends.side)
    }
}

impl Ends {
    /// Splits the variance of the step between shots by how far residuals repeat themselves.
    fn of(edges: &[&EdgeMet]) -> Self {
        let mut beams: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        let mut grid = 0.0;
        for edge in edges {
            beams.entry(edge.ring).or_default().push(edge.residual_rad);
            grid += edge.step_rad * edge.step_rad / 12.0 / edges.len() as f64;
        }
        let count = beams.iter().map(|(ring, all)| (*ring, all.len())).collect();
        let repeats = edges.len() - beams.len();
        if repeats < FEW_EDGES {
            let (own, beam, side) = (grid, 0.0, 0.0);
            return Self {
                own,
                beam,
                side,
                count,
            };
        }
        let inner: f64 = beams.values().map(|all| scatter(all)).sum();
        let own = (inner / repeats as f64).max(1e-4 * grid);
        let beam = between(&beams, own).unwrap_or((grid - own).max(0.0));
        let told = if beam > own { beams.len() } else { edges.len() } as f64;
        // A uniform error's variance, estimated from n, has a relative deviation of sqrt(0.8 / n).
        let sure = (own + beam) * (1.0 + 2.0 * (0.8 / told).sqrt());
        let side = (grid - sure).max(0.0);
        Self {
            own,
            beam,
            side,
            count,
        }
    }
}

/// Sum of squares about the mean.
fn scatter(all: &[f64]) -> f64 {
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    all.iter().map(|value| (value - mean).powi(2)).sum()
}

/// Variance between beams beyond what their own edges scatter; none for too few beams.
fn between(beams: &BTreeMap<usize, Vec<f64>>, own: f64) -> Option<f64> {
    if beams.len() < 3 {
        return None;
    }
    let total: f64 = beams.values().map(|all| all.len() as f64).sum();
    let mean = beams.values().flatten().sum::<f64>() / total;
    let of = |all: &Vec<f64>| {
        let here = all.iter().sum::<f64>() / all.len() as f64;
        all.len() as f64 * (here - mean).powi(2)
    };
    let spread = beams.values().map(of).sum::<f64>() / (beams.len() - 1) as f64;
    Some(((spread - own) / (total / beams.len() as f64)).max(0.0))
}

fn weight(used: &Used, noise_m: &[f64]) -> f64 {
    (used.cosine / noise_m[used.lidar]).powi(2)
}

/// Deviation of the built surface from its model along the normal, from the means of patches beyond
/// what noise makes of them; `before` is the last estimate, metres.
pub fn surface_m(tallies: &[Tally], noise_m: &[f64], before_m: f64) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for tally in tallies {
        for (count, inverse, mean_m) in means(tally, noise_m) {
            if count < FEW_ECHOES {
                continue;
            }
            let noise = 1.0 / inverse;
            let expected = before_m * before_m + noise;
            let square = (mean_m * mean_m).min(CLIPPED * CLIPPED * expected);
            sum += (square - noise) / (expected * expected);
            weights += 1.0 / (expected * expected);
        }
    }
    if weights == 0.0 {
        return before_m;
    }
    (sum / weights)
        .max(0.0)
        .sqrt()
        .clamp(SURFACE_M.0, SURFACE_M.1)
}

/// Echoes, sum of inverse variances and mean residual along the normal of every patch.
fn means(tally: &Tally, noise_m: &[f64]) -> Vec<(usize, f64, f64)> {
    let mut patches: Vec<(usize, f64, f64)> = Vec::new();
    for used in &tally.used {
        if patches.len() <= used.patch {
            patches.resize(used.patch + 1, (0, 0.0, 0.0));
        }
        let at = &mut patches[used.patch];
        let weight = weight(used, noise_m);
        at.0 += 1;
        at.1 += weight;
        at.2 += weight * used.residual_m * used.cosine;
    }
    patches.iter_mut().for_each(|at| at.2 /= at.1.max(1e-300));
    patches
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Edges of four beams in ten sweeps: `own` wanders from sweep to sweep, `beam` from beam to beam.
    fn edges(own: f64, beam: f64) -> Vec<EdgeMet> {
        // Multiples of the golden section are spread evenly over (-0.5, 0.5).
        let even = |k: usize| (k as f64 * 0.618_034).fract() - 0.5;
        let of = |k: usize| EdgeMet {
            lidar: 0,
            ring: k % 8,
            side: 1,
            residual_rad: own * even(k) + beam * even(k % 8 + 100),
            step_rad: 1e-3,
        };
        (0..400).map(of).collect()
    }

    fn variances(edges: &[EdgeMet]) -> (f64, f64) {
        let tally = Tally {
            edges: edges.to_vec(),
            ..Tally::default()
        };
        let common = Common::of(&tally, &[0.01]);
        let one = common.edge_variance(0, 1, 3).unwrap() / (1e-6 / 12.0);
        (one, common.side_variance(0, 1) / (1e-6 / 12.0))
    }

    #[test]
    fn edges_on_a_wandering_grid_count_one_by_one() {
        let (one, side) = variances(&edges(1e-3, 0.0));
        assert!((one - 1.0).abs() < 0.3 && side == 0.0, "{one} {side}");
    }

    #[test]
    fn sweeps_that_repeat_the_grid_count_once() {
        // 50 sweeps of a beam weigh as much as one edge with the variance of the step.
        let (one, side) = variances(&edges(0.0, 1e-3));
        assert!((one / 50.0 - 1.0).abs() < 0.4 && side < 0.1, "{one} {side}");
    }

    #[test]
    fn a_side_in_one_cell_of_the_grid_is_known_no_better_than_the_cell() {
        let (_, side) = variances(&edges(0.0, 0.0));
        assert!((side - 1.0).abs() < 0.01, "{side}");
    }

    #[test]
    fn means_of_patches_tell_the_surface() {
        let even = |k: usize| (k as f64 * 0.618_034).fract() - 0.5;
        let used = |k: usize| Used {
            time_ns: 0,
            lidar: 0,
            ring: 0,
            s_m: 0.0,
            // A patch of 20 echoes stands out by up to 5 mm: a deviation of 10 / sqrt(12) mm.
            residual_m: 0.02 * even(k) + 0.01 * even(k / 20),
            point: nalgebra::Vector3::zeros(),
            chord: 0.5,
            cosine: 1.0,
            patch: k / 20,
        };
        let tally = Tally {
            used: (0..4000).map(used).collect(),
            ..Tally::default()
        };
        let noise_m = [0.02 / 12f64.sqrt()];
        let mut found_m = 0.002;
        for _ in 0..4 {
            found_m = surface_m(std::slice::from_ref(&tally), &noise_m, found_m);
        }
        assert!(
            (found_m / (0.01 / 12f64.sqrt()) - 1.0).abs() < 0.15,
            "{found_m}"
        );
        let common = Common::of(&tally, &noise_m);
        // 20 echoes of a patch: as one with the variance of the patch and a twentieth of the noise.
        let factor = common.echo_factor(3, found_m, 0.0);
        let alone = found_m.powi(2) / noise_m[0].powi(2);
        assert!((factor - (1.0 + 20.0 * alone)).abs() < 1e-9 * factor);
    }
}
