//! Which points belong to no cluster, of a cloud that came in scan lines.
//!
//! Nearly all points of a line have neighbours enough among the shots right before and behind them, so that most
//! need no search; the few others are looked for one by one, and where those are many, the cloud is clustered.

use super::bounds::Bounds;
use super::dbscan::{DbscanParams, dbscan};
use super::{NOISE, lines::Lines};
use crate::error::ClusterError;
use crate::neighbors::{Coordinate, check_points};

/// Searches that are dearer than clustering: so many, and one more for so many points.
const MOST_SEARCHES: (usize, usize) = (32, 64);
/// Points with a common box around them.
const RUN: usize = 32;

/// Whether [`dbscan`] labels each point [`NOISE`]; `lines` has the scan line of each, and points of a line come in
/// the order of its shots. Any other lines or order give the same, more slowly.
///
/// # Errors
/// As [`dbscan`]; [`ClusterError::Length`] where `lines` are not one per point.
///
/// # Examples
/// ```
/// use lidar_deflect_core::cluster::{DbscanParams, is_noise};
/// let points = [[0.0f32, 0.0, 0.0], [0.1, 0.0, 0.0], [9.0, 0.0, 0.0], [0.2, 0.0, 0.0]];
/// let noise = is_noise(&points, &[7; 4], &DbscanParams::new(0.15, 3)?)?;
/// assert_eq!(noise, [false, false, true, false]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn is_noise<T: Coordinate>(
    points: &[[T; 3]],
    lines: &[u16],
    params: &DbscanParams<'_>,
) -> Result<Vec<bool>, ClusterError> {
    check_points(points)?;
    params.check_length(points.len())?;
    if lines.len() != points.len() {
        return Err(ClusterError::Length {
            name: "lines",
            expected: points.len(),
            found: lines.len(),
        });
    }
    if let Some(noise) = told_by_lines(points, lines, params) {
        return Ok(noise);
    }
    let labels = dbscan(points, params)?;
    Ok(labels.as_slice().iter().map(|l| *l == NOISE).collect())
}

/// `None` where lines tell too little.
fn told_by_lines<T: Coordinate>(
    points: &[[T; 3]],
    lines: &[u16],
    params: &DbscanParams<'_>,
) -> Option<Vec<bool>> {
    let lines = Lines::new(points, lines, |index| params.radius_m(index));
    let needed = params.needed();
    let mut cores = lines.proven_cores(needed);
    let unsure: Vec<usize> = (0..points.len())
        .filter(|&place| !cores[place] && !lines.is_reached_beside(place, needed, &cores))
        .collect();
    let (some, per_points) = MOST_SEARCHES;
    if unsure.len() > some + points.len() / per_points {
        return None;
    }
    let mut noise = vec![false; points.len()];
    if unsure.is_empty() {
        return Some(noise);
    }
    let search = Search::new(&lines);
    for place in unsure {
        noise[lines.order[place] as usize] = !search.belongs(place, needed, &mut cores);
    }
    Some(noise)
}

/// Looks through all points, run by run.
struct Search<'a> {
    lines: &'a Lines,
    boxes: Vec<Bounds<f64>>,
    most: f64, // squared radius
}

impl<'a> Search<'a> {
    fn new(lines: &'a Lines) -> Self {
        let places = || 0..lines.order.len();
        let around = |start: usize| {
            let mut around = Bounds::at(lines.point(start));
            let others = places().skip(start + 1).take(RUN - 1);
            others.for_each(|place| around.add(lines.point(place)));
            around
        };
        Self {
            lines,
            boxes: places().step_by(RUN).map(around).collect(),
            most: lines.limits.iter().copied().fold(0.0, f64::max),
        }
    }

    /// Calls `visit` with all that may be neighbours of a point or it of them, and the squared distance.
    fn around(&self, place: usize, mut visit: impl FnMut(usize, f64)) {
        let own = Bounds::at(self.lines.point(place));
        for (run, bounds) in self.boxes.iter().enumerate() {
            if bounds.squared_gap(&own) <= self.most {
                let places = run * RUN..self.lines.order.len().min((run + 1) * RUN);
                places.for_each(|other| visit(other, self.lines.squared_distance(place, other)));
            }
        }
    }

    /// Whether a point is a core.
    fn is_core(&self, place: usize, needed: usize) -> bool {
        let (mut count, limit) = (0, self.lines.limits[place]);
        self.around(place, |_, square| count += usize::from(square <= limit));
        count >= needed
    }

    /// Whether a point is a core or some core reaches it; what is found to be a core is noted.
    fn belongs(&self, place: usize, needed: usize, cores: &mut [bool]) -> bool {
        let limits = &self.lines.limits;
        let (mut count, mut is_reached, mut others) = (0, false, Vec::new());
        self.around(place, |other, square| {
            count += usize::from(square <= limits[place]);
            if square <= limits[other] && other != place {
                is_reached |= cores[other];
                others.push(other);
            }
        });
        cores[place] = count >= needed;
        if cores[place] || is_reached {
            return true;
        }
        let found = others
            .into_iter()
            .find(|&other| self.is_core(other, needed));
        if let Some(core) = found {
            cores[core] = true;
        }
        found.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn by_clusters(points: &[[f32; 3]], params: &DbscanParams<'_>) -> Vec<bool> {
        let labels = dbscan(points, params).unwrap();
        labels.as_slice().iter().map(|l| *l == NOISE).collect()
    }

    /// Lines along x, strays among them; `wild` of a hundred points lie anywhere.
    fn cloud(count: usize, wild: u32) -> (Vec<[f32; 3]>, Vec<u16>) {
        let point = |i: usize| {
            let random = (i as u32).wrapping_mul(0x9E37_79B9) >> 7;
            let (line, step) = (i % 5, i / 5);
            match random % 100 < wild {
                true => [random % 61, random % 53, random % 47].map(|c| c as f32 * 0.1),
                false => [
                    0.03 * step as f32,
                    0.4 * line as f32,
                    0.001 * (random % 9) as f32,
                ],
            }
        };
        let points = (0..count).map(point).collect();
        (points, (0..count).map(|i| (i % 5) as u16).collect())
    }

    #[test]
    fn lines_tell_what_clusters_tell() {
        for (count, wild) in [(0, 0), (1, 0), (40, 0), (900, 3), (900, 60), (901, 100)] {
            let (points, lines) = cloud(count, wild);
            for (radius_m, min_points) in [(0.1, 4), (0.1, 1), (0.25, 9), (0.5, 60)] {
                let params = DbscanParams::new(radius_m, min_points).unwrap();
                let found = is_noise(&points, &lines, &params).unwrap();
                assert_eq!(found, by_clusters(&points, &params), "{count} {wild}");
            }
        }
    }

    #[test]
    fn lines_suffice_for_a_cloud_with_few_strays_but_not_for_rain() {
        let params = DbscanParams::new(0.1, 4).unwrap();
        let tell = |wild: u32| {
            let (points, lines) = cloud(900, wild);
            told_by_lines(&points, &lines, &params)
        };
        let strays = tell(3).map(|noise| noise.iter().filter(|n| **n).count());
        assert!(strays.is_some_and(|strays| strays > 3));
        assert!(tell(60).is_none());
    }

    #[test]
    fn lines_are_one_per_point() {
        let params = DbscanParams::new(0.1, 4).unwrap();
        assert!(is_noise(&[[0.0f32; 3]], &[], &params).is_err());
        assert!(is_noise(&[[f32::NAN; 3]], &[0], &params).is_err());
    }

    proptest! {
        #[test]
        fn any_cloud_has_the_noise_of_its_clusters(
            cloud in prop::collection::vec((prop::array::uniform3(0.0f32..3.0), 0u16..4, 0.1f64..0.9), 0..120),
            min_points in 1usize..7,
            is_same in any::<bool>(),
        ) {
            let points: Vec<_> = cloud.iter().map(|c| c.0).collect();
            let lines: Vec<_> = cloud.iter().map(|c| c.1).collect();
            let radii: Vec<_> = cloud.iter().map(|c| c.2).collect();
            let params = if is_same { DbscanParams::new(0.4, min_points) } else { DbscanParams::new(radii, min_points) };
            let params = params.unwrap();
            let expected = by_clusters(&points, &params);
            if let Some(told) = told_by_lines(&points, &lines, &params) {
                prop_assert_eq!(&told, &expected);
            }
            prop_assert_eq!(is_noise(&points, &lines, &params).unwrap(), expected);
        }
    }
}
