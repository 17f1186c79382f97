//! Which cell of a lattice a place lies in, as a number.

use super::bricks::{PLACES, SIDE};
use crate::neighbors::{Coordinate, wide};

/// A hair under 1, so that rounding of a cell index cannot part the points of one cell too far.
const SHRINK: f64 = 1.0 - 1e-6;
/// Cells along one axis up to which indices are exact enough for `SHRINK`: 2^28 2^-51 < 1e-6.
const MOST_STEPS: f64 = (1u64 << 28) as f64;

/// How places become keys: the brick along x, then y, then z, with an empty one all around; then the cell
/// within the brick in the same order.
pub struct Lattice {
    min: [f64; 3],
    per_edge: f64,
    bricks: [u64; 3],
}

impl Lattice {
    /// Cells of edge `radius_m / sqrt(3)` for finite `points`; `None` where the cloud is so large against the
    /// radius that cells cannot be numbered.
    pub fn new<T: Coordinate>(points: &[[T; 3]], radius_m: f64) -> Option<Self> {
        let (min, max) = bounds(points);
        let per_edge = 3f64.sqrt() / (radius_m * SHRINK);
        let steps: [f64; 3] = std::array::from_fn(|k| (max[k] - min[k]) * per_edge);
        if !steps.iter().all(|&s| s < MOST_STEPS) {
            return None;
        }
        let bricks = steps.map(|s| s as u64 / SIDE + 3);
        let all = bricks[0].checked_mul(bricks[1])?.checked_mul(bricks[2])?;
        (all < (1 << 63) / PLACES).then_some(Self {
            min,
            per_edge,
            bricks,
        })
    }

    /// Key of the cell of a point: number of the brick times [`PLACES`], plus the place of the cell in it.
    #[inline(always)]
    pub fn key<T: Coordinate>(&self, point: [T; 3]) -> u64 {
        let p = wide(point);
        let index = |k: usize| u64::from(((p[k] - self.min[k]) * self.per_edge) as u32) + SIDE;
        let (x, y, z) = (index(0), index(1), index(2));
        let brick = (x / SIDE * self.bricks[1] + y / SIDE) * self.bricks[2] + z / SIDE;
        brick * PLACES + (x % SIDE * SIDE + y % SIDE) * SIDE + z % SIDE
    }

    /// Bits of the largest key.
    pub fn key_bits(&self) -> u32 {
        let keys = self.bricks.iter().product::<u64>() * PLACES;
        u64::BITS - (keys - 1).leading_zeros()
    }

    /// From the number of a brick to those of the nine rows of bricks along z around it.
    pub fn row_steps(&self) -> [i64; 9] {
        let [_, ny, nz] = self.bricks.map(|n| n as i64);
        std::array::from_fn(|row| {
            let (dx, dy) = (row as i64 / 3 - 1, row as i64 % 3 - 1);
            (dx * ny + dy) * nz
        })
    }
}

fn bounds<T: Coordinate>(points: &[[T; 3]]) -> ([f64; 3], [f64; 3]) {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &point in points {
        for (k, c) in wide(point).into_iter().enumerate() {
            // Plain comparisons: points are finite.
            min[k] = if c < min[k] { c } else { min[k] };
            max[k] = if c > max[k] { c } else { max[k] };
        }
    }
    (min, max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_far_too_wide_for_its_radius_has_no_cells() {
        assert!(Lattice::new(&[[0.0; 3], [1e9, 0.0, 0.0]], 1.0).is_none());
        assert!(Lattice::new(&[[-1e308; 3], [1e308; 3]], 1.0).is_none());
        assert!(Lattice::new(&[[0.0; 3], [1e8, 1e8, 1e8]], 2.0).is_none());
    }

    #[test]
    fn the_outermost_cells_have_bricks_around_them() {
        let edge = 3f64.sqrt() * 1.000_001;
        for steps in [0.5, 3.5, 4.5, 7.5] {
            let ends = [[0.0; 3], [steps; 3]];
            let lattice = Lattice::new(&ends, edge).unwrap();
            let bricks = ends.map(|end| lattice.key(end) / PLACES);
            let [_, ny, nz] = lattice.bricks;
            let all = lattice.bricks.iter().product::<u64>();
            assert!(
                bricks
                    .iter()
                    .all(|brick| brick % nz > 0 && brick % nz < nz - 1)
            );
            assert!(bricks[0] > ny * nz && bricks[1] + ny * nz + nz < all);
            assert!(lattice.key(ends[1]) >> lattice.key_bits() == 0);
        }
    }
}
