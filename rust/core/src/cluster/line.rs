//! Spatial line clustering: which pieces of a contour lie on one curve.

use super::NOISE;
use crate::error::{FitError, InvalidValue};
use crate::fit::polynomial::{MOST_DEGREE, count_different};
use crate::fit::{SpaceCurve, SpanAxis, fit_polynomial};

/// Checked parameters of [`line_clusters`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineParams {
    axis: SpanAxis,
    degrees: [usize; 2],
    reach_m: f64,
}

impl LineParams {
    /// Curves over `axis` with these degrees of the two other coordinates (ascending index); a cluster
    /// lies on a curve when its centre is nearer than `reach_m` (the paper's D).
    ///
    /// # Errors
    /// [`InvalidValue`] for a degree beyond 12 or a reach that is not positive and finite.
    pub fn new(axis: SpanAxis, degrees: [usize; 2], reach_m: f64) -> Result<Self, InvalidValue> {
        let refuse = |name, expected: &str, found| InvalidValue {
            name,
            expected: expected.into(),
            found,
        };
        if degrees.iter().any(|&degree| degree > MOST_DEGREE) {
            return Err(refuse("degree", "at most 12", format!("{degrees:?}")));
        }
        if !(reach_m > 0.0 && reach_m.is_finite()) {
            return Err(refuse(
                "reach_m",
                "a positive length in metres",
                reach_m.to_string(),
            ));
        }
        Ok(Self {
            axis,
            degrees,
            reach_m,
        })
    }
}

/// What became of a cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    /// On the curve of the chosen cluster.
    Kept,
    /// Left out: its centre is as far from that curve as the reach or farther.
    TooFar,
}

/// One cluster of contour samples and its curve.
#[derive(Debug, Clone, PartialEq)]
pub struct ContourCluster {
    /// Its label among the samples.
    pub label: i32,
    /// Number of samples.
    pub count: usize,
    /// Mean of the samples, metres; equation (11).
    pub center_m: [f64; 3],
    /// Curve through the samples.
    pub curve: SpaceCurve,
    /// Whether the samples were too few for the degrees asked for; those of the curve are lower then.
    pub is_reduced: bool,
    /// Number of clusters on its curve, itself among them: n of equation (13).
    pub supporters: usize,
    /// Distance of its centre from the chosen curve, metres; 0 for the chosen cluster.
    pub distance_m: f64,
    /// Whether it is kept.
    pub fate: Fate,
}

/// The clusters of one contour, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct LineClusters {
    /// All clusters in the order of their labels.
    pub clusters: Vec<ContourCluster>,
    /// Place in `clusters` of the one whose curve keeps the most.
    pub chosen: usize,
    /// Whether each sample is kept.
    pub keep: Vec<bool>,
    /// Number of samples that were noise.
    pub noise: usize,
}

impl LineClusters {
    /// The clusters on the chosen curve.
    pub fn kept(&self) -> impl Iterator<Item = &ContourCluster> {
        self.clusters.iter().filter(|c| c.fate == Fate::Kept)
    }

    /// The clusters that were left out.
    pub fn left(&self) -> impl Iterator<Item = &ContourCluster> {
        self.clusters.iter().filter(|c| c.fate != Fate::Kept)
    }
}

/// Judges the clusters of one contour, equations (11)-(13) of Hu et al. 2024.
///
/// 1. The centre of every cluster (noise is dropped) and a polynomial curve through its samples; where
///    they are too few for the degrees, of the highest degree they allow.
/// 2. For every curve, the clusters whose centres are nearer than the reach, its own among them.
/// 3. The curve with most clusters wins, of several the one that fits the samples of its clusters with
///    the smallest mean distance, then that of the lowest label; its clusters are kept.
///
/// `labels` are those of [`super::dbscan()`] on `samples_m`, or any others with -1 for noise.
///
/// # Errors
/// [`FitError`] where lengths differ, all samples are noise, or a coordinate is not finite.
pub fn line_clusters(
    samples_m: &[[f64; 3]],
    labels: &[i32],
    params: &LineParams,
) -> Result<LineClusters, FitError> {
    check(samples_m, labels)?;
    let mut clusters = describe(samples_m, labels, params)?;
    if clusters.is_empty() {
        let samples = samples_m.len();
        return Err(FitError::NoCluster { samples });
    }
    for j in 0..clusters.len() {
        clusters[j].supporters = supporters(&clusters, j, params.reach_m).count();
    }
    let chosen = choose(&clusters, samples_m, labels, params.reach_m);
    judge(&mut clusters, chosen, params.reach_m);
    let is_kept = |label: i32| {
        let found = clusters.binary_search_by_key(&label, |c| c.label);
        found.is_ok_and(|k| clusters[k].fate == Fate::Kept)
    };
    Ok(LineClusters {
        keep: labels.iter().map(|&label| is_kept(label)).collect(),
        noise: labels.iter().filter(|&&label| label < 0).count(),
        clusters,
        chosen,
    })
}

fn check(samples_m: &[[f64; 3]], labels: &[i32]) -> Result<(), FitError> {
    let shape = "line clustering";
    if samples_m.len() != labels.len() {
        let reason = format!("{} samples but {} labels", samples_m.len(), labels.len());
        return Err(FitError::Degenerate { shape, reason });
    }
    crate::fit::all_finite(shape, samples_m.iter().map(<[f64; 3]>::as_slice))
}

fn describe(
    samples_m: &[[f64; 3]],
    labels: &[i32],
    params: &LineParams,
) -> Result<Vec<ContourCluster>, FitError> {
    let mut names: Vec<i32> = labels.iter().copied().filter(|&l| l > NOISE).collect();
    names.sort_unstable();
    names.dedup();
    let describe_one = |label| describe_one(label, &samples_of(samples_m, labels, label), params);
    names.into_iter().map(describe_one).collect()
}

fn samples_of(samples_m: &[[f64; 3]], labels: &[i32], label: i32) -> Vec<[f64; 3]> {
    let pairs = samples_m.iter().zip(labels);
    pairs
        .filter(|(_, l)| **l == label)
        .map(|(p, _)| *p)
        .collect()
}

fn describe_one(
    label: i32,
    samples_m: &[[f64; 3]],
    params: &LineParams,
) -> Result<ContourCluster, FitError> {
    let mean = |k: usize| samples_m.iter().map(|p| p[k]).sum::<f64>() / samples_m.len() as f64;
    let curve = fit_curve(samples_m, params)?;
    let degrees = [curve.across[0].degree(), curve.across[1].degree()];
    Ok(ContourCluster {
        label,
        count: samples_m.len(),
        center_m: [mean(0), mean(1), mean(2)],
        is_reduced: degrees != params.degrees,
        curve,
        supporters: 0,
        distance_m: 0.0,
        fate: Fate::TooFar,
    })
}

fn fit_curve(samples_m: &[[f64; 3]], params: &LineParams) -> Result<SpaceCurve, FitError> {
    let (along, across) = params.axis.indices();
    let column = |k: usize| samples_m.iter().map(|p| p[k]).collect::<Vec<f64>>();
    let abscissas = column(along);
    let most = count_different(&abscissas).saturating_sub(1);
    let fit = |k: usize| fit_reduced(&abscissas, &column(across[k]), params.degrees[k].min(most));
    Ok(SpaceCurve {
        axis: params.axis,
        across: [fit(0)?, fit(1)?],
    })
}

/// The highest degree that the abscissas bear; a constant always fits.
fn fit_reduced(
    abscissas: &[f64],
    ordinates: &[f64],
    degree: usize,
) -> Result<crate::fit::Polynomial, FitError> {
    match fit_polynomial(abscissas, ordinates, degree) {
        Err(FitError::Degenerate { .. }) if degree > 0 => {
            fit_reduced(abscissas, ordinates, degree - 1)
        }
        fit => Ok(fit?.estimate),
    }
}

/// Distance of the centre of cluster `k` from the curve of cluster `j`, equation (12).
fn distance_m(clusters: &[ContourCluster], k: usize, j: usize) -> f64 {
    match k == j {
        true => 0.0,
        false => clusters[j].curve.distance_m(clusters[k].center_m),
    }
}

/// Places of the clusters on the curve of cluster `j`, equation (13).
fn supporters(clusters: &[ContourCluster], j: usize, reach_m: f64) -> impl Iterator<Item = usize> {
    (0..clusters.len()).filter(move |&k| distance_m(clusters, k, j) < reach_m)
}

fn choose(
    clusters: &[ContourCluster],
    samples_m: &[[f64; 3]],
    labels: &[i32],
    reach_m: f64,
) -> usize {
    let most = clusters.iter().map(|c| c.supporters).max().unwrap_or(0);
    let tied: Vec<usize> = (0..clusters.len())
        .filter(|&j| clusters[j].supporters == most)
        .collect();
    if let [only] = tied[..] {
        return only;
    }
    let residual_m = |j: usize| mean_residual_m(clusters, j, samples_m, labels, reach_m);
    let judged = tied.into_iter().map(|j| (residual_m(j), j));
    let best = judged.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    best.map_or(0, |(_, j)| j)
}

/// Mean distance from the curve of cluster `j` of the samples of all clusters on it, metres.
fn mean_residual_m(
    clusters: &[ContourCluster],
    j: usize,
    samples_m: &[[f64; 3]],
    labels: &[i32],
    reach_m: f64,
) -> f64 {
    let (mut sum_m, mut count) = (0.0, 0);
    for k in supporters(clusters, j, reach_m) {
        for sample_m in samples_of(samples_m, labels, clusters[k].label) {
            sum_m += clusters[j].curve.distance_m(sample_m);
            count += 1;
        }
    }
    sum_m / f64::from(count)
}

fn judge(clusters: &mut [ContourCluster], chosen: usize, reach_m: f64) {
    for k in 0..clusters.len() {
        let distance_m = distance_m(clusters, k, chosen);
        let is_near = distance_m < reach_m;
        clusters[k].distance_m = distance_m;
        clusters[k].fate = if is_near { Fate::Kept } else { Fate::TooFar };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(degrees: [usize; 2]) -> LineParams {
        LineParams::new(SpanAxis::Z, degrees, 0.6).unwrap()
    }

    /// Samples of one lidar on a bent contour, 1 m apart from `z_m`, moved by `off_m` in x.
    fn piece(z_m: f64, count: usize, off_m: f64) -> Vec<[f64; 3]> {
        let place = |i: usize| {
            let z = z_m + i as f64;
            [0.002 * (z - 70.0).powi(2) + off_m, 0.1 * z, z]
        };
        (0..count).map(place).collect()
    }

    fn join(pieces: &[Vec<[f64; 3]>]) -> (Vec<[f64; 3]>, Vec<i32>) {
        let label = |(k, piece): (usize, &Vec<[f64; 3]>)| vec![k as i32; piece.len()];
        (
            pieces.concat(),
            pieces.iter().enumerate().flat_map(label).collect(),
        )
    }

    #[test]
    fn the_lidar_off_the_contour_is_left_out_with_its_distance() {
        let pieces = [
            piece(75.0, 8, 0.0),
            piece(85.0, 8, 1.5),
            piece(95.0, 8, 0.0),
            piece(104.0, 6, 0.0),
        ];
        let (mut samples, mut labels) = join(&pieces);
        samples.push([50.0, 0.0, 90.0]);
        labels.push(NOISE);
        let found = line_clusters(&samples, &labels, &params([2, 1])).unwrap();
        let kept: Vec<i32> = found.kept().map(|c| c.label).collect();
        assert_eq!(kept, [0, 2, 3]);
        let left = found.left().next().unwrap();
        // Off by 1.5 m in x; nearest to a curve of slope 0.074 at the centre (z = 88.5), so 1.5 cos,
        // and a little for the curvature.
        let slope: f64 = 0.004 * 18.5;
        assert_eq!((left.label, left.fate), (1, Fate::TooFar));
        assert!((left.distance_m - 1.5 / (1.0 + slope * slope + 0.01).sqrt()).abs() < 0.05);
        assert_eq!(found.keep.iter().filter(|&&keep| keep).count(), 22);
        assert_eq!(
            (found.noise, found.clusters[found.chosen].supporters),
            (1, 3)
        );
    }

    #[test]
    fn one_cluster_is_kept_and_fitted() {
        let (samples, labels) = join(&[piece(80.0, 5, 0.0)]);
        let found = line_clusters(&samples, &labels, &params([2, 1])).unwrap();
        assert!(found.keep.iter().all(|&keep| keep) && !found.clusters[0].is_reduced);
        assert!((found.clusters[0].curve.point_m(90.0)[0] - 0.8).abs() < 1e-9);
        assert_eq!(found.clusters[0].center_m[2], 82.0);
    }

    #[test]
    fn a_small_cluster_takes_a_lower_degree_and_says_so() {
        let lone = vec![[0.0, 0.0, 3.0]];
        let twins = vec![[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [0.1, 0.0, 4.0]];
        let (samples, labels) = join(&[lone, twins]);
        let found = line_clusters(&samples, &labels, &params([2, 1])).unwrap();
        let degrees = |k: usize| found.clusters[k].curve.across.clone().map(|p| p.degree());
        assert_eq!((degrees(0), degrees(1)), ([0, 0], [1, 1]));
        assert!(found.clusters.iter().all(|c| c.is_reduced));
    }

    #[test]
    fn of_equal_supporters_the_smaller_mean_residual_wins() {
        // Two clusters see each other; the curve of the first is bent by an outlier.
        let mut rough = piece(80.0, 6, 0.0);
        rough[5][0] += 0.3;
        let (samples, labels) = join(&[rough, piece(87.0, 6, 0.0)]);
        let found = line_clusters(&samples, &labels, &params([1, 1])).unwrap();
        assert_eq!(
            found
                .clusters
                .iter()
                .map(|c| c.supporters)
                .collect::<Vec<_>>(),
            [2, 2]
        );
        assert_eq!(found.chosen, 1);
    }

    #[test]
    fn what_cannot_be_judged_is_refused() {
        let noise = line_clusters(&[[0.0; 3]; 4], &[NOISE; 4], &params([1, 1])).unwrap_err();
        assert_eq!(noise, FitError::NoCluster { samples: 4 });
        assert!(line_clusters(&[[0.0; 3]; 4], &[0; 3], &params([1, 1])).is_err());
        let bad = line_clusters(&[[f64::NAN; 3]], &[0], &params([1, 1])).unwrap_err();
        assert!(matches!(bad, FitError::NotFinite { index: 0, .. }));
        assert!(LineParams::new(SpanAxis::Z, [13, 1], 0.6).is_err());
        assert!(LineParams::new(SpanAxis::Z, [1, 1], f64::NAN).is_err());
    }
}
