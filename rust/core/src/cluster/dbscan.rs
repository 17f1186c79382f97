//! DBSCAN with one radius or a radius per point.

use std::borrow::Cow;

use super::graded::dbscan_graded;
use super::uniform::dbscan_uniform;
use super::varied::dbscan_varied;
use super::{Labels, NOISE};
use crate::error::{ClusterError, InvalidValue};
use crate::neighbors::{Coordinate, check_points, checked_radius, squared_distance};

/// How far a point looks for neighbours.
#[derive(Debug, Clone, PartialEq)]
pub enum Radius<'a> {
    /// The same for all, metres.
    Same(f64),
    /// One per point, metres.
    Each(Cow<'a, [f64]>),
}

impl From<f64> for Radius<'_> {
    fn from(radius_m: f64) -> Self {
        Self::Same(radius_m)
    }
}

impl<'a> From<&'a [f64]> for Radius<'a> {
    fn from(radii_m: &'a [f64]) -> Self {
        Self::Each(Cow::Borrowed(radii_m))
    }
}

impl From<Vec<f64>> for Radius<'_> {
    fn from(radii_m: Vec<f64>) -> Self {
        Self::Each(Cow::Owned(radii_m))
    }
}

impl Radius<'_> {
    fn check(&self) -> Result<(), InvalidValue> {
        let radii_m = match self {
            Self::Same(radius_m) => std::slice::from_ref(radius_m),
            Self::Each(radii_m) => radii_m,
        };
        let mut checks = radii_m.iter().map(|&r| checked_radius("radius_m", r));
        checks.find_map(Result::err).map_or(Ok(()), Err)
    }

    fn at(&self, index: usize) -> f64 {
        match self {
            Self::Same(radius_m) => *radius_m,
            Self::Each(radii_m) => radii_m[index],
        }
    }

    fn check_length(&self, expected: usize) -> Result<(), ClusterError> {
        match self {
            Self::Each(radii_m) if radii_m.len() != expected => Err(ClusterError::Length {
                name: "radius_m",
                expected,
                found: radii_m.len(),
            }),
            _ => Ok(()),
        }
    }
}

/// Checked parameters of [`dbscan`].
#[derive(Debug, Clone, PartialEq)]
pub struct DbscanParams<'a> {
    radius: Radius<'a>,
    needed: usize,
}

impl<'a> DbscanParams<'a> {
    /// Neighbours within `radius_m` count, the point itself among them; with `min_points` or more a
    /// point is a core.
    ///
    /// # Errors
    /// [`InvalidValue`] where a radius is not positive and finite or `min_points` is 0.
    pub fn new(radius_m: impl Into<Radius<'a>>, min_points: usize) -> Result<Self, InvalidValue> {
        let radius = radius_m.into();
        radius.check()?;
        if min_points == 0 {
            return Err(InvalidValue {
                name: "min_points",
                expected: "at least 1".into(),
                found: "0".into(),
            });
        }
        let needed = min_points;
        Ok(Self { radius, needed })
    }

    /// Asks for more than `min_points` neighbours, as Hu et al. 2024 word it, instead of as many.
    pub fn strict(mut self) -> Self {
        self.needed = self.needed.saturating_add(1);
        self
    }

    /// Neighbours that make a core, the point itself among them.
    pub(super) fn needed(&self) -> usize {
        self.needed
    }

    /// Radius of the point with this index, metres.
    pub(super) fn radius_m(&self, index: usize) -> f64 {
        self.radius.at(index)
    }

    pub(super) fn check_length(&self, expected: usize) -> Result<(), ClusterError> {
        self.radius.check_length(expected)
    }
}

/// Labels the points of a cloud by density.
///
/// q is a neighbour of p when |pq| <= radius(p). A point with enough neighbours is a core; two cores
/// connect when their distance is within the radii of both; a point that is no core belongs to the
/// lowest-numbered cluster with a core whose radius reaches it, else it is noise. Clusters are
/// numbered by their smallest core index. With one radius these are the labels of scikit-learn.
///
/// Runs on the rayon pool of its caller; the labels are the same for any number of threads. Memory is
/// a small multiple of the cloud whatever the density: no neighbours are kept.
///
/// # Errors
/// [`ClusterError`] where a coordinate is not finite, there are more than 2^31 - 1 points, or the
/// radii are not one per point.
///
/// # Reference
/// Ester, Kriegel, Sander, Xu, "A density-based algorithm for discovering clusters", KDD 1996; cells
/// as in Gunawan, "A faster algorithm for DBSCAN", 2013.
///
/// # Examples
/// ```
/// use lidar_deflect_core::cluster::{DbscanParams, dbscan};
/// let points = [[0.0f32, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [9.0, 0.0, 0.0]];
/// let labels = dbscan(&points, &DbscanParams::new(0.15, 3)?)?;
/// assert_eq!(labels.as_slice(), [0, 0, 0, -1]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn dbscan<T: Coordinate>(
    points: &[[T; 3]],
    params: &DbscanParams<'_>,
) -> Result<Labels, ClusterError> {
    check_points(points)?;
    params.check_length(points.len())?;
    let on_grid = match &params.radius {
        Radius::Same(radius_m) => dbscan_uniform(points, *radius_m, params.needed),
        Radius::Each(radii_m) => dbscan_graded(points, radii_m, params.needed),
    };
    let labels = match on_grid {
        Some(labels) => labels,
        None => dbscan_varied(points, |i| params.radius.at(i), params.needed)?,
    };
    Ok(Labels(labels))
}

/// The same labels by looking at all pairs, word for word after the definition: for tests and benches.
///
/// # Errors
/// As [`dbscan`].
pub fn dbscan_brute<T: Coordinate>(
    points: &[[T; 3]],
    params: &DbscanParams<'_>,
) -> Result<Labels, ClusterError> {
    check_points(points)?;
    params.check_length(points.len())?;
    let n = points.len();
    let sees = |p: usize, q: usize| {
        let radius_m = params.radius.at(p);
        squared_distance(points[p], points[q]) <= radius_m * radius_m
    };
    let is_core = |p: usize| (0..n).filter(|&q| sees(p, q)).count() >= params.needed;
    let cores: Vec<bool> = (0..n).map(is_core).collect();
    let mut labels = vec![NOISE; n];
    let mut next = 0;
    for seed in 0..n {
        if !cores[seed] || labels[seed] != NOISE {
            continue;
        }
        let mut cluster = vec![seed];
        labels[seed] = next;
        while let Some(p) = cluster.pop() {
            for q in 0..n {
                if cores[q] && labels[q] == NOISE && sees(p, q) && sees(q, p) {
                    labels[q] = next;
                    cluster.push(q);
                }
            }
        }
        next += 1;
    }
    let reached_by = |q: usize| {
        (0..n)
            .filter(|&p| cores[p] && sees(p, q))
            .map(|p| labels[p])
            .min()
    };
    let label_of = |q: usize| {
        if cores[q] {
            labels[q]
        } else {
            reached_by(q).unwrap_or(NOISE)
        }
    };
    Ok(Labels((0..n).map(label_of).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn in_pool<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(work)
    }

    #[test]
    fn parameters_without_meaning_are_refused() {
        assert!(DbscanParams::new(0.0, 4).is_err() && DbscanParams::new(f64::NAN, 4).is_err());
        assert!(DbscanParams::new(vec![0.1, -0.1], 4).is_err());
        assert_eq!(DbscanParams::new(0.1, 0).unwrap_err().name, "min_points");
    }

    #[test]
    fn radii_must_be_one_per_point() {
        let params = DbscanParams::new(vec![0.1; 2], 4).unwrap();
        let error = dbscan(&[[0.0f32; 3]; 3], &params).unwrap_err();
        assert!(matches!(
            error,
            ClusterError::Length {
                expected: 3,
                found: 2,
                ..
            }
        ));
    }

    #[test]
    fn strict_asks_for_one_neighbour_more() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        let params = DbscanParams::new(1.0, 3).unwrap();
        assert_eq!(dbscan(&points, &params).unwrap().as_slice(), [0, 0, 0]);
        assert_eq!(
            dbscan(&points, &params.strict()).unwrap().as_slice(),
            [NOISE; 3]
        );
    }

    #[test]
    fn a_border_point_joins_the_lowest_cluster_that_reaches_it() {
        // Two triples of cores; the point between them is within the radius of one core of each.
        let x = [10.0, 10.1, 10.2, 9.2, 8.4, 8.3, 8.2, 30.0];
        let points = x.map(|x| [x, 0.0, 0.0]);
        let labels = dbscan(&points, &DbscanParams::new(0.85, 4).unwrap()).unwrap();
        assert_eq!(
            labels.as_slice(),
            [0, 0, 0, 0, 1, 1, 1, NOISE].map(|l: i32| l)
        );
    }

    #[test]
    fn a_radius_seen_from_one_side_only_does_not_connect_cores() {
        // Pairs 1.5 apart; the second pair sees the first, not the other way round.
        let points = [0.0, 0.1, 1.5, 1.6].map(|x| [x, 0.0, 0.0]);
        let params = DbscanParams::new(vec![0.5, 0.5, 3.0, 3.0], 2).unwrap();
        assert_eq!(dbscan(&points, &params).unwrap().as_slice(), [0, 0, 1, 1]);
    }

    #[test]
    fn sizes_count_the_points_of_each_cluster() {
        let labels = Labels(vec![0, -1, 1, 0]);
        assert_eq!((labels.clusters(), labels.sizes()), (2, vec![2, 1]));
    }

    /// Whole numbers put pairs exactly onto the radius, repeat points and line them up.
    fn cloud() -> impl Strategy<Value = Vec<[i32; 3]>> {
        let coordinate = prop_oneof![Just(0), -3i32..4, -40i32..40];
        prop::collection::vec(prop::array::uniform3(coordinate), 0..150)
    }

    fn scaled(cloud: &[[i32; 3]], scale: f64, shift: f64) -> Vec<[f64; 3]> {
        let place = |c: i32| f64::from(c) * scale + shift;
        cloud.iter().map(|p| p.map(place)).collect()
    }

    proptest! {
        #[test]
        fn one_radius_agrees_with_brute_force(
            cloud in cloud(), power in -100i32..100, square in 1u32..60, min_points in 1usize..8,
            shift in prop_oneof![Just(0.0), Just(1e3), Just(1e7)],
        ) {
            let scale = 2f64.powi(power);
            let params = DbscanParams::new(f64::from(square).sqrt() * scale, min_points).unwrap();
            let points = scaled(&cloud, scale, shift * scale);
            let expected = dbscan_brute(&points, &params).unwrap();
            for threads in [1, 2] {
                let found = in_pool(threads, || dbscan(&points, &params)).unwrap();
                prop_assert_eq!(&found, &expected);
            }
            let narrow: Vec<[f32; 3]> = points.iter().map(|p| p.map(|c| c as f32)).collect();
            prop_assert_eq!(dbscan(&narrow, &params), dbscan_brute(&narrow, &params));
        }

        #[test]
        fn a_radius_per_point_agrees_with_brute_force(
            cloud in cloud(), squares in prop_oneof![
                prop::collection::vec(1u32..60, 150), // too different for a grid
                prop::collection::vec(5u32..60, 150),
            ],
            power in -60i32..60, min_points in 1usize..8,
        ) {
            let scale = 2f64.powi(power);
            let points = scaled(&cloud, scale, 0.0);
            let radius = |s: &u32| f64::from(*s).sqrt() * scale;
            let radii: Vec<f64> = squares.iter().take(points.len()).map(radius).collect();
            let params = DbscanParams::new(radii, min_points).unwrap();
            let expected = dbscan_brute(&points, &params).unwrap();
            for threads in [1, 2] {
                let found = in_pool(threads, || dbscan(&points, &params)).unwrap();
                prop_assert_eq!(&found, &expected);
            }
        }

        #[test]
        fn equal_radii_per_point_give_the_labels_of_one_radius(
            cloud in cloud(), square in 1u32..60, min_points in 1usize..8,
        ) {
            let points = scaled(&cloud, 0.1, 0.0);
            let radius_m = f64::from(square).sqrt() * 0.1;
            let one = DbscanParams::new(radius_m, min_points).unwrap();
            let each = DbscanParams::new(vec![radius_m; points.len()], min_points).unwrap();
            prop_assert_eq!(dbscan(&points, &one), dbscan(&points, &each));
        }

        #[test]
        fn a_cloud_too_wide_for_a_grid_is_still_clustered(
            cloud in cloud(), square in 1u32..60, min_points in 1usize..5,
        ) {
            let mut points = scaled(&cloud, 1.0, 0.0);
            points.extend([[1e300, -1e300, 0.0], [1e18, 0.0, 0.0]]);
            let params = DbscanParams::new(f64::from(square).sqrt(), min_points).unwrap();
            prop_assert_eq!(dbscan(&points, &params), dbscan_brute(&points, &params));
        }
    }
}
