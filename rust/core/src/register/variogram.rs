//! How rough a surface is, from how residual heights differ over distance.

use std::collections::BTreeMap;

use super::field::Roughness;

/// Upper ends of the bins of distance, metres.
const BINS_M: [f64; 14] = [
    0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0, 1.4, 2.0, 2.8, 4.0, 6.0,
];
/// Points of one lidar within a square of this side are one: most of them lie close beneath it, where
/// the noise of the measurement hides what little heights differ, metres.
const PATCH_M: f64 = 0.1;
/// Patches that are compared with one another.
const SAMPLE: usize = 3000;
/// Fewer pairs than this say nothing of a bin.
const LEAST_PAIRS: usize = 200;
/// Correlation lengths that are tried, metres.
const LENGTHS_M: [f64; 10] = [0.4, 0.5, 0.65, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2];

/// A residual height: where, how high (metres), and the variance of the noise in it.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// u and v on the surface, metres.
    pub place_m: [f64; 2],
    /// Height, metres.
    pub height_m: f64,
    /// Variance of the measurement, square metres.
    pub noise_m2: f64,
    /// Heights of different groups are not compared: their lidars may stand differently.
    pub group: usize,
}

/// Means over patches, each of one group.
fn patches(samples: &[Sample]) -> Vec<Sample> {
    let mut sums: BTreeMap<(usize, [i64; 2]), (f64, Sample)> = BTreeMap::new();
    for sample in samples {
        let cell = sample.place_m.map(|t| (t / PATCH_M).floor() as i64);
        sums.entry((sample.group, cell))
            .and_modify(|(count, sum)| {
                *count += 1.0;
                (0..2).for_each(|k| sum.place_m[k] += sample.place_m[k]);
                sum.height_m += sample.height_m;
                sum.noise_m2 += sample.noise_m2;
            })
            .or_insert((1.0, *sample));
    }
    let mean = |(count, sum): (f64, Sample)| Sample {
        place_m: sum.place_m.map(|t| t / count),
        height_m: sum.height_m / count,
        noise_m2: sum.noise_m2 / (count * count),
        group: sum.group,
    };
    sums.into_values().map(mean).collect()
}

/// Semivariances by bin of distance, without the noise of the measurement.
fn semivariances(samples: &[Sample]) -> Vec<(f64, f64, f64)> {
    let patches = patches(samples);
    let thin = patches.len().div_ceil(SAMPLE).max(1);
    let chosen: Vec<&Sample> = patches.iter().step_by(thin).collect();
    let mut bins = [(0usize, 0.0, 0.0); BINS_M.len()];
    for (k, a) in chosen.iter().enumerate() {
        for b in chosen[..k].iter().filter(|b| b.group == a.group) {
            let distance = (a.place_m[0] - b.place_m[0]).hypot(a.place_m[1] - b.place_m[1]);
            let bin = BINS_M.partition_point(|end| *end <= distance);
            if let Some(bin) = bins.get_mut(bin) {
                let difference = (a.height_m - b.height_m).powi(2) - a.noise_m2 - b.noise_m2;
                *bin = (bin.0 + 1, bin.1 + distance, bin.2 + 0.5 * difference);
            }
        }
    }
    bins.iter()
        .filter(|(count, ..)| *count >= LEAST_PAIRS)
        .map(|(count, distance, sum)| {
            let n = *count as f64;
            (distance / n, sum / n, n.min(20_000.0))
        })
        .collect()
}

/// Roughness that explains the semivariances best; None where there are too few.
pub fn roughness(samples: &[Sample]) -> Option<Roughness> {
    let bins = semivariances(samples);
    if bins.len() < 5 {
        return None;
    }
    let tried = LENGTHS_M.iter().map(|length| fitted(&bins, *length));
    tried.min_by(|a, b| a.1.total_cmp(&b.1)).map(|best| best.0)
}

/// Nugget and sill at one correlation length by least squares, neither negative, and the misfit.
fn fitted(bins: &[(f64, f64, f64)], correlation_m: f64) -> (Roughness, f64) {
    let unit = Roughness {
        sigma_m: 1.0,
        correlation_m,
        nugget_m: 0.0,
    };
    let shape = |distance: f64| 1.0 - unit.correlation(distance);
    let (mut s, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (distance, value, n) in bins {
        // A semivariance scatters in proportion to itself.
        let (x, y) = (shape(*distance), *value);
        let w = n / (value.abs() + 1e-6).powi(2);
        (s, sx, sy, sxx, sxy) = (
            s + w,
            sx + w * x,
            sy + w * y,
            sxx + w * x * x,
            sxy + w * x * y,
        );
    }
    let sill = (s * sxy - sx * sy) / (s * sxx - sx * sx);
    let nugget = (sy - sill * sx) / s;
    let (sill, nugget) = match (sill > 0.0, nugget > 0.0) {
        (true, true) => (sill, nugget),
        (true, false) => ((sxy / sxx).max(0.0), 0.0),
        (false, _) => (0.0, (sy / s).max(0.0)),
    };
    let misfit = bins.iter().map(|(distance, value, n)| {
        let left = value - nugget - sill * shape(*distance);
        n * (left / (value.abs() + 1e-6)).powi(2)
    });
    let misfit = misfit.sum();
    let roughness = Roughness {
        sigma_m: sill.sqrt(),
        nugget_m: nugget.sqrt(),
        ..unit
    };
    (roughness, misfit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::random::{Stream, Subject};

    /// Heights along many parallel lines, of exponential correlation: nearly Matern's up to its length.
    fn lines(sigma_m: f64, keep: f64, noise_m: f64) -> Vec<Sample> {
        let mut random = Stream::new(3, Subject::Ground, [0, 0]);
        let mut samples = Vec::new();
        for line in 0..60 {
            let mut state = [random.normal(), random.normal()];
            for step in 0..200 {
                // Twice an autoregression of first order: smooth at short distance.
                state[0] = keep * state[0] + (1.0 - keep * keep).sqrt() * random.normal();
                state[1] = keep * state[1] + (1.0 - keep) * state[0];
                let variance = (1.0 + keep * keep) / (1.0 + keep).powi(2);
                samples.push(Sample {
                    place_m: [0.1 * f64::from(step), 50.0 * f64::from(line)],
                    height_m: sigma_m * state[1] / variance.sqrt() + noise_m * random.normal(),
                    noise_m2: noise_m * noise_m,
                    group: 0,
                });
            }
        }
        samples
    }

    #[test]
    fn correlated_heights_are_told_from_noise() {
        let found = roughness(&lines(0.01, 0.8, 0.002)).unwrap();
        assert!((found.sigma_m - 0.01).abs() < 0.002, "{found:?}");
        assert!(found.nugget_m < 0.002, "{found:?}");
        assert!((0.8..3.3).contains(&found.correlation_m), "{found:?}");
    }

    #[test]
    fn a_smooth_wall_has_no_roughness() {
        let found = roughness(&lines(0.0, 0.8, 0.004)).unwrap();
        assert!(found.sigma_m.hypot(found.nugget_m) < 0.0008, "{found:?}");
    }

    #[test]
    fn a_handful_of_points_tells_nothing() {
        assert!(roughness(&lines(0.01, 0.8, 0.002)[..20]).is_none());
    }
}
