//! Which points lie within a radius of a place; the only file that names kiddo.

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::error::{ClusterError, InvalidValue};

/// Coordinates of a cloud: `f32` as stored or `f64` as computed.
pub trait Coordinate: Copy + PartialOrd + Send + Sync + Into<f64> + 'static {}
impl Coordinate for f32 {}
impl Coordinate for f64 {}

/// Radii whose square neither overflows nor loses digits.
const RADII: std::ops::RangeInclusive<f64> = 1e-150..=1e150;
/// The tree may round differently: it offers a hair more, the exact comparison decides.
const TREE_MARGIN: f64 = 1.0 + 1e-12;

/// The point with 64-bit coordinates.
#[inline(always)]
pub fn wide<T: Coordinate>([x, y, z]: [T; 3]) -> [f64; 3] {
    [x.into(), y.into(), z.into()]
}

/// Squared distance, summed in the order x, y, z as scikit-learn does.
#[inline(always)]
pub fn squared_distance<T: Coordinate>(p: [T; 3], q: [T; 3]) -> f64 {
    let (p, q) = (wide(p), wide(q));
    let (dx, dy, dz) = (p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    dx * dx + dy * dy + dz * dz
}

/// Checks one search radius, metres.
///
/// # Errors
/// [`InvalidValue`] where it is not a positive number between 1e-150 and 1e150.
pub fn checked_radius(name: &'static str, radius_m: f64) -> Result<f64, InvalidValue> {
    if RADII.contains(&radius_m) {
        return Ok(radius_m);
    }
    Err(InvalidValue {
        name,
        expected: "a positive, finite radius in metres".into(),
        found: radius_m.to_string(),
    })
}

/// Checks that a cloud can be searched.
///
/// # Errors
/// [`ClusterError::NotFinite`] with the first bad point, [`ClusterError::TooMany`] beyond 2^31 - 1.
pub fn check_points<T: Coordinate>(points: &[[T; 3]]) -> Result<(), ClusterError> {
    let most = i32::MAX as usize;
    if points.len() > most {
        let found = points.len();
        return Err(ClusterError::TooMany { most, found });
    }
    let is_bad = |p: &[T; 3]| !wide(*p).iter().all(|c| c.is_finite());
    match points.iter().position(is_bad) {
        None => Ok(()),
        Some(index) => Err(ClusterError::NotFinite {
            index,
            point: wide(points[index]),
        }),
    }
}

/// Radius queries on a cloud: q is a neighbour of p when |pq|^2 <= r^2 in 64-bit arithmetic.
pub struct Neighbors<'a, T: Coordinate> {
    points: &'a [[T; 3]],
    tree: Option<ImmutableKdTree<f64, 3>>, // none over an empty cloud
}

impl<'a, T: Coordinate> Neighbors<'a, T> {
    /// Builds the search tree over `points`, metres.
    ///
    /// # Errors
    /// [`ClusterError`] as of [`check_points`].
    pub fn new(points: &'a [[T; 3]]) -> Result<Self, ClusterError> {
        check_points(points)?;
        Ok(Self {
            points,
            tree: (!points.is_empty()).then(|| build(points)),
        })
    }

    /// Calls `visit` with the index of every point within `radius_m` of `place_m`, in no promised
    /// order; a point at the place itself counts.
    pub fn for_each_within(&self, place_m: [T; 3], radius_m: f64, mut visit: impl FnMut(usize)) {
        let Some(tree) = &self.tree else { return };
        let limit = radius_m * radius_m;
        tree.query(&wide(place_m))
            .within::<SquaredEuclidean<f64>>(limit * TREE_MARGIN)
            .unsorted()
            .visit(|found| {
                let index = found.item as usize;
                if squared_distance(place_m, self.points[index]) <= limit {
                    visit(index);
                }
            });
    }

    /// Indices of the points within `radius_m` of `place_m`, ascending.
    pub fn within(&self, place_m: [T; 3], radius_m: f64) -> Vec<usize> {
        let mut found = Vec::new();
        self.for_each_within(place_m, radius_m, |index| found.push(index));
        found.sort_unstable();
        found
    }
}

fn build<T: Coordinate>(points: &[[T; 3]]) -> ImmutableKdTree<f64, 3> {
    let wide: Vec<[f64; 3]> = points.iter().map(|&p| wide(p)).collect();
    ImmutableKdTree::new_from_slice(&wide).expect("finite points, at most 2^31 - 1 of them")
}

/// The same answer as [`Neighbors::within`] by looking at every point: for tests and benches.
pub fn within_brute<T: Coordinate>(
    points: &[[T; 3]],
    place_m: [T; 3],
    radius_m: f64,
) -> Vec<usize> {
    let is_near = |&i: &usize| squared_distance(points[i], place_m) <= radius_m * radius_m;
    (0..points.len()).filter(is_near).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_boundary_belongs_to_the_ball() {
        let points = [[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [3.0, 4.0, 1e-7]];
        let search = Neighbors::new(&points).unwrap();
        assert_eq!(search.within([0.0; 3], 5.0), [0, 1]);
    }

    #[test]
    fn the_first_bad_point_is_named() {
        let points = [[0.0f32; 3], [0.0, f32::NAN, 0.0], [f32::INFINITY, 0.0, 0.0]];
        let error = Neighbors::new(&points).err().unwrap();
        assert!(matches!(error, ClusterError::NotFinite { index: 1, .. }));
    }

    #[test]
    fn an_empty_cloud_has_no_neighbours() {
        let search = Neighbors::<f32>::new(&[]).unwrap();
        assert!(search.within([0.0; 3], 1.0).is_empty());
    }

    #[test]
    fn a_hundred_thousand_equal_points_are_all_found() {
        let points = vec![[1.0f32, 2.0, 3.0]; 100_000];
        let search = Neighbors::new(&points).unwrap();
        assert_eq!(search.within([1.0, 2.0, 3.0], 1e-3).len(), 100_000);
    }

    proptest! {
        #[test]
        fn the_tree_agrees_with_looking_at_every_point(
            // Whole numbers put many pairs exactly onto the boundary; scales reach far.
            points in prop::collection::vec(prop::array::uniform3(-4i32..5), 1..120),
            power in -30i32..30,
            radius in 1u32..30,
        ) {
            let scale = 2f64.powi(power);
            let points: Vec<[f64; 3]> =
                points.iter().map(|p| p.map(|c| f64::from(c) * scale)).collect();
            let search = Neighbors::new(&points).unwrap();
            let radius_m = f64::from(radius).sqrt() * scale;
            for &p in &points {
                prop_assert_eq!(search.within(p, radius_m), within_brute(&points, p, radius_m));
            }
        }
    }
}
