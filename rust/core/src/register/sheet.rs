//! A sheet as one lidar sees it: halfway between its edges on every ring, between its outermost rings.

use std::collections::BTreeMap;

use nalgebra::{Unit, Vector3};

use super::hold::{Beam, Hold};
use super::target::Cluster;

/// Middle of a sheet as measured, with what is not sure of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// Middle, sensor frame, metres.
    pub centre_m: Vector3<f64>,
    /// Its upright edges lean by so much from the upright of the sensor, level over upright.
    pub lean: f64,
    /// Standard deviations across its upright edges, along them, and along the ray, metres.
    pub sigma_m: [f64; 3],
    /// Channels that met it, each with its share of the echoes.
    pub shares: Vec<(u16, f64)>,
}

/// Edges of a sheet are no sharper than this, metres.
const EDGE_U_M: f64 = 1e-3;
/// How plumb a sheet hangs, as seen from aside, radians.
const PLUMB_U_RAD: f64 = 0.03;
/// How far a sheet may be turned away from a lidar out of the plane of rotation, radians.
const TURNED_U_RAD: f64 = 0.3;
/// Ranges of two channels to it differ by this, metres; and its strong echo falsifies all of them by this.
const CHANNEL_U_M: f64 = 0.01;
const STRONG_U_M: f64 = 3e-3;

/// What a sheet is looked for by.
#[derive(Debug, Clone, Copy)]
pub struct Looked {
    /// Its place, sensor frame, metres.
    pub expected_m: Vector3<f64>,
    /// Where the vertical points that it hangs by, sensor frame.
    pub up: Unit<Vector3<f64>>,
    /// Edge, metres.
    pub size_m: f64,
    /// How far from its place it may be, metres.
    pub within_m: f64,
}

/// The sheet nearest to its place, if one is near enough, and its number of echoes.
pub fn sheet(hold: &Hold, clusters: &[Cluster], looked: &Looked) -> Option<(Sheet, usize)> {
    let like = clusters
        .iter()
        .filter(|c| c.radius_m < looked.size_m + 0.1)
        .map(|c| ((c.middle_m - looked.expected_m).norm(), c));
    let (apart_m, nearest) = like.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (apart_m < looked.within_m).then(|| (middle(hold, nearest, looked), nearest.echoes.len()))
}

fn middle(hold: &Hold, cluster: &Cluster, looked: &Looked) -> Sheet {
    let direction = Unit::new_normalize(cluster.middle_m);
    let axes = across(&direction);
    let size_m = looked.size_m;
    let mut rings: BTreeMap<u16, Vec<&Beam>> = BTreeMap::new();
    for echo in cluster.echoes.iter().map(|k| &hold.bright[*k]) {
        rings.entry(echo.ring).or_default().push(echo);
    }
    let chords: Vec<_> = rings
        .values()
        .map(|on| Chord::of(on, &axes, size_m))
        .collect();
    let heights = chords.iter().map(|chord| chord.height_m);
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
    // All rings that met it lie on it, so its middle has this much room.
    let upright_u_m = (size_m - (high - low)).max(0.1 * size_m) / 12f64.sqrt();
    let height_m = 0.5 * (low + high);
    let plumb = Slope {
        mean: leaning(&looked.up, &axes),
        u: PLUMB_U_RAD,
    };
    let level = line(&full(&chords), plumb, height_m, |c| {
        [c.middle_m, c.middle_u_m2]
    });
    let away = Slope {
        mean: 0.0,
        u: TURNED_U_RAD,
    };
    let all: Vec<_> = chords.iter().collect();
    let range = line(&all, away, height_m, |c| [c.range_m, CHANNEL_U_M.powi(2)]);
    let count = cluster.echoes.len() as f64;
    let share = |(ring, on): (&u16, &Vec<&Beam>)| (*ring, on.len() as f64 / count);
    Sheet {
        centre_m: direction.into_inner() * range.value_m
            + axes[0] * level.value_m
            + axes[1] * height_m,
        lean: level.slope.mean,
        sigma_m: [
            // Where a sensor's shots fall at the same places in every turn, rings err together.
            level
                .worst_u_m
                .hypot(EDGE_U_M)
                .hypot(level.slope.u * upright_u_m),
            upright_u_m,
            STRONG_U_M.hypot(range.slope.mean.hypot(range.slope.u) * upright_u_m),
        ],
        shares: rings.iter().map(share).collect(),
    }
}

/// Level in the plane of rotation, and upright, across a direction of the sensor.
pub fn across(direction: &Unit<Vector3<f64>>) -> [Vector3<f64>; 2] {
    let turning = Vector3::z().cross(direction);
    let level = turning.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    [level, direction.cross(&level)]
}

/// Lean of those edges of a plumb sheet that are nearer to the upright axis.
fn leaning(up: &Unit<Vector3<f64>>, axes: &[Vector3<f64>; 2]) -> f64 {
    let (level, upright) = (axes[0].dot(up), axes[1].dot(up));
    let lean = match upright.abs() >= level.abs() {
        true => level / upright,
        false => -upright / level,
    };
    if lean.is_finite() { lean } else { 0.0 }
}

/// Where one ring crosses a sheet, metres.
#[derive(Debug, Clone, Copy)]
struct Chord {
    middle_m: f64,
    middle_u_m2: f64,
    length_m: f64,
    gap_m: f64,
    height_m: f64,
    range_m: f64,
}

impl Chord {
    /// From the places of its echoes.
    ///
    /// An edge falls into one of the gaps between shots, into a long one the likelier, and lies anywhere
    /// in it; that of the other side does so as well, so the middle varies by gap^2 / 24.
    fn of(on: &[&Beam], axes: &[Vector3<f64>; 2], size_m: f64) -> Self {
        let place = |echo: &&Beam, axis: usize| axes[axis].dot(&echo.direction) * echo.range_m;
        let mut level: Vec<f64> = on.iter().map(|echo| place(echo, 0)).collect();
        level.sort_by(f64::total_cmp);
        let (low, high) = (level[0], level[level.len() - 1]);
        let power = |n| level.windows(2).map(|w| (w[1] - w[0]).powi(n)).sum::<f64>();
        let gap_m2 = match high > low {
            true => power(3) / power(1),
            false => size_m * size_m,
        };
        let mean = |of: &dyn Fn(&&Beam) -> f64| on.iter().map(of).sum::<f64>() / on.len() as f64;
        Self {
            middle_m: 0.5 * (low + high),
            middle_u_m2: gap_m2 / 24.0,
            length_m: high - low,
            gap_m: gap_m2.sqrt(),
            height_m: mean(&|echo| place(echo, 1)),
            range_m: mean(&|echo| echo.range_m),
        }
    }
}

/// The chords that run from side to side: a ring that leaves a sheet over its upper or lower edge has its
/// middle elsewhere.
fn full(chords: &[Chord]) -> Vec<&Chord> {
    let longest = chords
        .iter()
        .max_by(|a, b| a.length_m.total_cmp(&b.length_m));
    let is_full = |chord: &&Chord| {
        longest.is_some_and(|most| chord.length_m + chord.gap_m + most.gap_m >= most.length_m)
    };
    chords.iter().filter(is_full).collect()
}

/// A slope with its standard deviation.
#[derive(Debug, Clone, Copy)]
struct Slope {
    mean: f64,
    u: f64,
}

/// A line over the height, read at one height.
struct Line {
    value_m: f64,
    worst_u_m: f64,
    slope: Slope,
}

/// The line through what chords tell (a value and its variance) whose slope was expected to be `prior`.
fn line(chords: &[&Chord], prior: Slope, height_m: f64, told: impl Fn(&Chord) -> [f64; 2]) -> Line {
    let count = chords.len() as f64;
    let at_m = chords.iter().map(|c| c.height_m).sum::<f64>() / count;
    let mean = |k: usize| chords.iter().map(|c| told(c)[k]).sum::<f64>() / count;
    let value_m = mean(0);
    let mut precision = prior.u.powi(-2);
    let mut sum = prior.mean * precision;
    for chord in chords {
        let [value, variance] = told(chord);
        let from_m = chord.height_m - at_m;
        let weight = from_m / variance.max(EDGE_U_M * EDGE_U_M);
        precision += weight * from_m;
        sum += weight * (value - value_m);
    }
    let slope = Slope {
        mean: sum / precision,
        u: precision.sqrt().recip(),
    };
    Line {
        value_m: value_m + slope.mean * (height_m - at_m),
        worst_u_m: mean(1).sqrt(),
        slope,
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::clusters;
    use super::*;

    const EDGE_M: f64 = 0.3;

    /// Bright echoes of a sheet at `centre` across x, its upright edges leaning by `lean`, as rings 0.07 m
    /// apart with shots `step_m` apart see it.
    fn hold(centre: &Vector3<f64>, lean: f64, step_m: f64) -> Hold {
        let mut hold = Hold::default();
        let half = 0.5 * EDGE_M * (1.0 + lean * lean).sqrt(); // across the leaning axes, not normalised
        for (shot, ring) in (-400..400).flat_map(|shot| (0..20u16).map(move |ring| (shot, ring))) {
            let (y, z) = (step_m * f64::from(shot), 0.07 * f64::from(ring) - 0.7);
            let (level, upright) = (y - centre.y, z - centre.z);
            let inside = |t: f64| t.abs() <= half;
            if inside(level - lean * upright) && inside(upright + lean * level) {
                let point = Vector3::new(centre.x, y, z);
                hold.bright.push(Beam {
                    direction: Unit::new_normalize(point),
                    range_m: point.norm(),
                    sigma_m: 0.005,
                    intensity: 220.0,
                    ring,
                    cell: 0,
                });
            }
        }
        hold
    }

    fn found(hold: &Hold, expected_m: Vector3<f64>, up: Vector3<f64>) -> Option<Sheet> {
        let looked = Looked {
            expected_m,
            up: Unit::new_normalize(up),
            size_m: EDGE_M,
            within_m: 0.5,
        };
        sheet(hold, &clusters(hold), &looked).map(|(sheet, _)| sheet)
    }

    #[test]
    fn the_middle_of_a_sheet_lies_between_its_edges() {
        let centre = Vector3::new(8.0, 0.05, 0.02);
        let hold = hold(&centre, 0.0, 0.005);
        let sheet = found(&hold, Vector3::new(8.1, 0.1, 0.1), Vector3::z()).unwrap();
        let from = sheet.centre_m - centre;
        assert!(from.y.abs() < 3.0 * sheet.sigma_m[0], "{from}");
        assert!(from.z.abs() < 2.0 * sheet.sigma_m[1], "{from}");
        assert!(from.x.abs() < 2e-3, "{from}"); // the sheet is flat, its corners are farther
        // Shots 5 mm apart: 5 / sqrt(24) mm, and edges of 1 mm.
        assert!(
            (1e-3..1.6e-3).contains(&sheet.sigma_m[0]),
            "{}",
            sheet.sigma_m[0]
        );
        let shares: f64 = sheet.shares.iter().map(|share| share.1).sum();
        assert!((shares - 1.0).abs() < 1e-12);
        assert!(found(&hold, Vector3::new(3.0, 0.1, 0.1), Vector3::z()).is_none());
    }

    #[test]
    fn a_ring_that_leaves_over_the_upper_edge_does_not_move_the_middle() {
        // Rings 0.07 m apart on a sheet that leans by a tenth: the outermost ones end at a corner.
        let (centre, lean) = (Vector3::new(8.0, 0.05, 0.02), 0.1);
        let sheet = found(
            &hold(&centre, lean, 0.002),
            centre,
            Vector3::new(0.0, lean, 1.0),
        )
        .unwrap();
        assert!((sheet.lean - lean).abs() < 0.03, "{}", sheet.lean);
        let from = sheet.centre_m - centre;
        let across_m = from.y - sheet.lean * from.z;
        assert!(across_m.abs() < 2.0 * sheet.sigma_m[0], "{across_m}");
    }

    #[test]
    fn shots_that_fall_at_the_same_places_in_every_turn_tell_no_more_than_one() {
        let centre = Vector3::new(8.0, 0.05, 0.02);
        let once = hold(&centre, 0.0, 0.05);
        let mut often = once.clone();
        (0..9).for_each(|_| often.bright.extend_from_slice(&once.bright));
        let [one, ten] = [&once, &often].map(|hold| found(hold, centre, Vector3::z()).unwrap());
        assert!((one.sigma_m[0] - ten.sigma_m[0]).abs() < 1e-6);
        assert!(
            (one.sigma_m[0] - 0.05 / 24f64.sqrt()).abs() < 5e-4,
            "{}",
            one.sigma_m[0]
        );
    }
}
