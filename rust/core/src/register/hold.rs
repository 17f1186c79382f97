//! A static hold of one lidar: its sweeps added up per beam and azimuth cell.
//!
//! What moved through a cell is an outlier of its median; a cell that has no clear range is dropped
//! and counted. Points are kept as rays from the sensor's origin: for a lidar whose beams start
//! elsewhere, the ray through the point differs from the beam by an angle of centimetres over the
//! range, which the residual of millimetres does not feel.

use nalgebra::{Unit, Vector3};

use crate::error::InvalidValue;

/// Deviations from the median beyond this many standard deviations are movers.
const MOVER: f64 = 4.0;
/// Added to that limit, so that quantised ranges do not reject one another, metres.
const QUANTUM_M: f64 = 0.003;
/// A cell is static if at least this share of its echoes agrees with the median.
const STATIC_SHARE: f64 = 0.7;
/// Echoes by which a cell's own scatter is drawn towards that of all cells.
const SHRINKAGE: f64 = 8.0;
/// Cells whose variance is so many times the median's hold an edge or a mover.
const EDGE: f64 = 6.0;
/// Echoes scatter by no less than this, metres.
const LEAST_SCATTER_M: f64 = 1e-4;
/// So many cells tell by how much echoes scatter.
const SAMPLE: usize = 4000;
/// The scatter is read where this share of the deviations from the median ends, so that a cell which
/// is half one thing and half another does not take the way between them for noise; and what it is
/// in standard deviations there.
const QUANTILE: f64 = 0.35;
const QUANTILE_TO_SIGMA: f64 = 2.2;

/// Echoes brighter than this quantile of the mean rays by this factor are bright: a retroreflector
/// outshines what is matt, and covers less of the view than what is left above the quantile.
const BRIGHT_QUANTILE: f64 = 0.9;
const BRIGHT: f32 = 1.5;
/// More bright echoes than this are thinned.
const MOST_BRIGHT: usize = 40_000;

/// The mean ray of one channel within one azimuth cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Direction in the sensor frame.
    pub direction: Unit<Vector3<f64>>,
    /// Measured range, metres.
    pub range_m: f64,
    /// Standard deviation of that mean from the scatter within the cell, metres.
    pub sigma_m: f64,
    /// Mean intensity.
    pub intensity: f32,
    /// Channel.
    pub ring: u16,
    /// Number of the azimuth cell.
    pub cell: u32,
}

/// How sweeps are added up.
#[derive(Debug, Clone, Copy)]
pub struct HoldParams {
    step_deg: f64,
    min_count: usize,
}

impl HoldParams {
    /// Cells of `step_deg` degrees; those with fewer than `min_count` echoes are dropped.
    ///
    /// # Errors
    /// [`InvalidValue`] unless 0.01 <= `step_deg` <= 10 and `min_count` >= 2.
    pub fn new(step_deg: f64, min_count: usize) -> Result<Self, InvalidValue> {
        if !(0.01..=10.0).contains(&step_deg) {
            return Err(refuse("step_deg", "0.01 to 10", step_deg.to_string()));
        }
        if min_count < 2 {
            return Err(refuse("min_count", "2 or more", min_count.to_string()));
        }
        Ok(Self {
            step_deg,
            min_count,
        })
    }
}

/// What one lidar sees while nothing moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hold {
    /// Mean rays, by ring and azimuth.
    pub beams: Vec<Beam>,
    /// Single echoes that are brighter than the yard: what targets are looked for in.
    pub bright: Vec<Beam>,
    /// Azimuth cells of a full turn.
    pub cells: u32,
    /// Cells without a clear range: something moved, or an edge ran through.
    pub unclear: usize,
    /// Cells with too few echoes.
    pub sparse: usize,
}

/// Echoes of a hold as columns of equal length, sensor frame.
#[derive(Debug, Clone, Copy)]
pub struct Echoes<'a> {
    /// Points, metres.
    pub xyz_m: &'a [[f32; 3]],
    /// Channels.
    pub ring: &'a [u16],
    /// Azimuths, degrees.
    pub azimuth_deg: &'a [f32],
    /// Intensities; empty where they are not known.
    pub intensity: &'a [f32],
}

/// A hold of mean rays that are known already, in any order; sorted by ring and azimuth.
///
/// # Errors
/// [`InvalidValue`] where a direction has no length, or a range or sigma is not positive. Columns of
/// unequal length end with the shortest.
pub fn of_rays(
    direction: &[[f64; 3]],
    range_m: &[f64],
    sigma_m: &[f64],
    ring: &[u16],
    cell: &[u32],
    intensity: &[f32],
    cells: u32,
) -> Result<Hold, InvalidValue> {
    let columns = direction
        .iter()
        .zip(range_m)
        .zip(sigma_m)
        .zip(ring)
        .zip(cell);
    let rays = columns
        .zip(intensity)
        .map(|(((((d, r), s), ring), cell), i)| {
            Ok(Beam {
                direction: Unit::try_new(Vector3::from(*d), 1e-9)
                    .ok_or_else(|| refuse("direction", "a length", format!("{d:?}")))?,
                range_m: positive("range_m", *r)?,
                sigma_m: positive("sigma_m", *s)?,
                intensity: *i,
                ring: *ring,
                cell: *cell,
            })
        });
    let mut beams = rays.collect::<Result<Vec<_>, InvalidValue>>()?;
    beams.sort_by_key(|b| (b.ring, b.cell));
    let limit = brightness(&beams).unwrap_or(f32::INFINITY);
    let bright = beams.iter().filter(|b| b.intensity > limit);
    Ok(Hold {
        bright: bright.copied().collect(),
        beams,
        cells,
        ..Hold::default()
    })
}

fn positive(name: &'static str, value: f64) -> Result<f64, InvalidValue> {
    match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => Err(refuse(name, "a positive number", value.to_string())),
    }
}

fn refuse(name: &'static str, expected: &str, found: String) -> InvalidValue {
    InvalidValue {
        name,
        expected: expected.into(),
        found,
    }
}

#[derive(Clone, Copy)]
struct Echo {
    key: (u16, u32),
    range_m: f64,
    index: usize,
}

/// Adds up the sweeps of a hold.
pub fn add_up(echoes: &Echoes<'_>, params: &HoldParams) -> Hold {
    let cells = (360.0 / params.step_deg).ceil() as u32;
    let mut sorted = keyed(echoes, params.step_deg, cells);
    sorted.sort_by(|a, b| a.key.cmp(&b.key).then(a.range_m.total_cmp(&b.range_m)));
    let all = sorted.chunk_by(|a, b| a.key == b.key);
    let (full, sparse): (Vec<_>, Vec<_>) = all.partition(|cell| cell.len() >= params.min_count);
    let clear = |usual_m: f64| move |cell: &&[Echo]| mean_ray(cell, echoes, usual_m);
    let thin = full.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<_> = full.iter().step_by(thin).copied().collect();
    let usual_m = usual_scatter(&sample.iter().filter_map(clear(0.0)).collect::<Vec<_>>());
    let means: Vec<_> = full.iter().filter_map(clear(usual_m)).collect();
    let single_m = usual_scatter(&means);
    let beams: Vec<Beam> = means.iter().map(|m| settled(m, single_m)).collect();
    Hold {
        bright: bright(echoes, &beams, single_m, params.step_deg),
        cells,
        unclear: full.len() - beams.len(),
        sparse: sparse.len(),
        beams,
    }
}

/// The brightest echoes one by one; none where intensities are not known.
fn bright(echoes: &Echoes<'_>, beams: &[Beam], sigma_m: f64, step_deg: f64) -> Vec<Beam> {
    let Some(limit) = brightness(beams).filter(|_| !echoes.intensity.is_empty()) else {
        return Vec::new();
    };
    let single = |k: usize| {
        let point = vector(&echoes.xyz_m[k]);
        let direction = Unit::try_new(point, 0.05)?;
        Some(Beam {
            direction,
            range_m: point.norm(),
            sigma_m,
            intensity: echoes.intensity[k],
            ring: *echoes.ring.get(k)?,
            cell: (f64::from(*echoes.azimuth_deg.get(k)?).rem_euclid(360.0) / step_deg) as u32,
        })
    };
    let above = echoes.intensity.iter().enumerate();
    let above = above.filter(|(_, intensity)| **intensity > limit);
    let found: Vec<Beam> = above.filter_map(|(k, _)| single(k)).collect();
    let thin = found.len().div_ceil(MOST_BRIGHT).max(1);
    found.into_iter().step_by(thin).collect()
}

/// Intensity above which an echo is bright; None where nothing has any.
fn brightness(beams: &[Beam]) -> Option<f32> {
    let mut all: Vec<f32> = beams.iter().map(|b| b.intensity).collect();
    all.sort_by(f32::total_cmp);
    let matt = *all.get((BRIGHT_QUANTILE * all.len() as f64) as usize)?;
    (matt > 0.0).then_some(BRIGHT * matt)
}

fn keyed(echoes: &Echoes<'_>, step_deg: f64, cells: u32) -> Vec<Echo> {
    let points = echoes.xyz_m.iter().zip(echoes.ring).zip(echoes.azimuth_deg);
    points
        .enumerate()
        .filter_map(|(index, ((point, ring), azimuth))| {
            let range_m = vector(point).norm();
            let turn = f64::from(*azimuth).rem_euclid(360.0);
            let usable = range_m > 0.05 && range_m.is_finite() && turn.is_finite();
            let cell = ((turn / step_deg) as u32).min(cells - 1);
            usable.then_some(Echo {
                key: (*ring, cell),
                range_m,
                index,
            })
        })
        .collect()
}

fn vector(point: &[f32; 3]) -> Vector3<f64> {
    Vector3::new(point[0].into(), point[1].into(), point[2].into())
}

/// A mean ray whose sigma is the scatter of its single echoes, and how many they are.
type Mean = (Beam, f64);

/// Mean of the echoes that agree with the median; echoes scatter by no less than `usual_m`, whatever
/// a handful of them makes believe.
fn mean_ray(cell: &[Echo], echoes: &Echoes<'_>, usual_m: f64) -> Option<Mean> {
    let median = cell[cell.len() / 2].range_m;
    let mut deviations: Vec<f64> = cell.iter().map(|e| (e.range_m - median).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    let inner = QUANTILE_TO_SIGMA * deviations[(QUANTILE * cell.len() as f64) as usize];
    let limit = MOVER * inner.max(usual_m) + QUANTUM_M;
    let kept: Vec<&Echo> = cell
        .iter()
        .filter(|e| (e.range_m - median).abs() <= limit)
        .collect();
    if (kept.len() as f64) < STATIC_SHARE * cell.len() as f64 || kept.len() < 2 {
        return None;
    }
    let count = kept.len() as f64;
    let of = |value: &dyn Fn(&Echo) -> f64| kept.iter().map(|e| value(e)).sum::<f64>() / count;
    let range_m = of(&|e| e.range_m);
    let azimuth = of(&|e| f64::from(echoes.azimuth_deg[e.index]));
    // Along a grazing surface range follows azimuth; what is left is noise.
    let away = |e: &Echo| f64::from(echoes.azimuth_deg[e.index]) - azimuth;
    let slope = of(&|e| away(e) * (e.range_m - range_m)) / of(&|e| away(e).powi(2)).max(1e-12);
    let scatter = of(&|e| (e.range_m - range_m - slope * away(e)).powi(2));
    let direction: Vector3<f64> = kept
        .iter()
        .map(|e| vector(&echoes.xyz_m[e.index]) / e.range_m)
        .sum();
    let intensity = match echoes.intensity {
        [] => 0.0,
        values => of(&|e| f64::from(values[e.index])) as f32,
    };
    let beam = Beam {
        direction: Unit::new_normalize(direction),
        range_m,
        sigma_m: (scatter * count / (count - 2.0).max(1.0)).sqrt(),
        intensity,
        ring: cell[0].key.0,
        cell: cell[0].key.1,
    };
    Some((beam, count))
}

/// Standard deviation of a single echo over many cells, metres: the median variance, freed from what the
/// median of a few degrees of freedom lies too low, tells which cells hold an edge; the others' mean is it.
fn usual_scatter(means: &[Mean]) -> f64 {
    let own = |(beam, count): &Mean| (beam.sigma_m.powi(2), count - 2.0);
    let free: Vec<(f64, f64)> = means.iter().map(own).filter(|m| m.1 > 0.0).collect();
    // Wilson and Hilferty: the median of chi-square over its degrees of freedom.
    let even = |(variance, freedom): &(f64, f64)| variance / (1.0 - 2.0 / (9.0 * freedom)).powi(3);
    let mut all: Vec<f64> = free.iter().map(even).collect();
    all.sort_by(f64::total_cmp);
    let median = all.get(all.len() / 2).copied().unwrap_or(0.0);
    let clear = free.iter().filter(|m| m.0 <= EDGE * median);
    let (sum, freedom) = clear.fold((0.0, 0.0), |s, (v, f)| (s.0 + f * v, s.1 + f));
    match freedom > 0.0 {
        true => (sum / freedom).sqrt().max(LEAST_SCATTER_M),
        false => LEAST_SCATTER_M,
    }
}

/// Turns the scatter of single echoes into that of their mean. A handful of echoes says little of its own
/// scatter, so it is drawn towards the usual one.
fn settled((beam, count): &Mean, usual_m: f64) -> Beam {
    let own = (count - 2.0).max(0.0);
    let variance = (own * beam.sigma_m.powi(2) + SHRINKAGE * usual_m * usual_m) / (own + SHRINKAGE);
    Beam {
        sigma_m: (variance / count).sqrt(),
        ..*beam
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::random::{Stream, Subject};

    /// Forty sweeps of one ring over a wall at y = 5 m; a bird in a tenth of the sweeps.
    fn wall(noise_m: f64) -> (Vec<[f32; 3]>, Vec<f32>) {
        let mut random = Stream::new(7, Subject::Ground, [0, 0]);
        let mut rows = (Vec::new(), Vec::new());
        for sweep in 0..40 {
            for step in 0..50 {
                let azimuth = 30.0 + 0.2 * f64::from(step) + 0.003 * f64::from(sweep);
                let (sine, cosine) = azimuth.to_radians().sin_cos();
                let bird = sweep % 10 == 3 && (10..20).contains(&step);
                let range = if bird { 2.0 } else { 5.0 / sine } + noise_m * random.normal();
                rows.0
                    .push([(range * cosine) as f32, (range * sine) as f32, 0.0]);
                rows.1.push(azimuth as f32);
            }
        }
        rows
    }

    #[test]
    fn a_few_sweeps_tell_the_scatter_as_well_as_many_do() {
        // Three to six echoes a cell: the median of so few variances is half of the variance.
        let (points, azimuths) = wall(0.012);
        for sweeps in [3, 4, 6, 40] {
            let few = 50 * sweeps;
            let hold = hold_of(&(points[..few].to_vec(), azimuths[..few].to_vec()));
            let mean = |b: &Beam| b.sigma_m * (sweeps as f64).sqrt();
            let single_m = hold.beams.iter().map(mean).sum::<f64>() / hold.beams.len() as f64;
            assert!(
                (single_m / 0.012 - 1.0).abs() < 0.25,
                "{sweeps}: {single_m}"
            );
        }
    }

    fn hold_of(rows: &(Vec<[f32; 3]>, Vec<f32>)) -> Hold {
        let ring = vec![0; rows.0.len()];
        let echoes = Echoes {
            xyz_m: &rows.0,
            ring: &ring,
            azimuth_deg: &rows.1,
            intensity: &[],
        };
        add_up(&echoes, &HoldParams::new(0.2, 3).unwrap())
    }

    #[test]
    fn movers_drop_out_and_the_mean_is_as_good_as_it_says() {
        let hold = hold_of(&wall(0.012));
        assert_eq!(hold.cells, 1800);
        assert!(hold.beams.len() > 45);
        let errors: Vec<f64> = hold
            .beams
            .iter()
            .map(|b| (b.range_m * b.direction.y - 5.0) / (b.sigma_m * b.direction.y))
            .collect();
        let chi2: f64 = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        // 50 cells: the mean square scatters by sqrt(2 / 50) = 0.2; three sigma.
        assert!((chi2 - 1.0).abs() < 0.6, "{chi2}");
    }

    #[test]
    fn a_cell_without_a_clear_range_is_dropped_and_counted() {
        let mut rows = wall(0.002);
        for (index, point) in rows.0.iter_mut().enumerate() {
            if (index / 50) % 2 == 0 && index % 50 < 10 {
                *point = point.map(|c| c * 1.5); // every other sweep
            }
        }
        let hold = hold_of(&rows);
        assert!(hold.unclear >= 4, "{}", hold.unclear);
        assert!(
            hold.beams
                .iter()
                .all(|b| (b.range_m * b.direction.y - 5.0).abs() < 0.02)
        );
    }
}
