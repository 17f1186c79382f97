//! Which points may lie in a box or next to a direction: told side by side and generously, so that few are left to
//! be looked at one by one.

use crate::frame::WorldFromSensor;
use crate::simd::{Kernel, vectorized};

/// So much farther than the box points are taken that rounding may bring into it, metres.
const MARGIN_M: f64 = 1e-3;
/// Points that are worked out side by side.
const ABREAST: usize = 16;

/// A box as a lidar that stands still sees it.
#[derive(Debug, Clone, Copy)]
pub struct NearBox {
    turn: [[f64; 3]; 3],
    low_m: [f64; 3],
    high_m: [f64; 3],
}

impl NearBox {
    /// The box between two corners of the world, seen from `pose`.
    pub fn new(pose: &WorldFromSensor, min_m: &[f32; 3], max_m: &[f32; 3]) -> Self {
        let (turn, at_m) = (pose.rotation(), pose.translation_m());
        let bound = |axis: usize, end: f32, sign: f64| {
            f64::from(end) + sign * MARGIN_M * (1.0 + MARGIN_M * f64::from(end).abs()) - at_m[axis]
        };
        Self {
            turn: std::array::from_fn(|row| std::array::from_fn(|column| turn[(row, column)])),
            low_m: std::array::from_fn(|axis| bound(axis, min_m[axis], -1.0)),
            high_m: std::array::from_fn(|axis| bound(axis, max_m[axis], 1.0)),
        }
    }

    /// Tells the places of the points, sensor frame, that may lie in the box, in their order.
    pub fn places(&self, xyz_m: &[[f32; 3]], mut take: impl FnMut(usize)) {
        let (groups, rest) = xyz_m.as_chunks::<ABREAST>();
        for (number, points) in groups.iter().enumerate() {
            let mut inside = vectorized(Inside { near: self, points });
            while inside != 0 {
                take(number * ABREAST + inside.trailing_zeros() as usize);
                inside &= inside - 1;
            }
        }
        (xyz_m.len() - rest.len()..xyz_m.len()).for_each(take);
    }
}

/// One bit for each point that may lie inside.
struct Inside<'a> {
    near: &'a NearBox,
    points: &'a [[f32; 3]; ABREAST],
}

impl Kernel for Inside<'_> {
    type Out = u32;

    #[inline(always)]
    fn run(self) -> u32 {
        let Self { near, points } = self;
        let column =
            |axis: usize| -> [f64; ABREAST] { std::array::from_fn(|k| f64::from(points[k][axis])) };
        let (x, y, z) = (column(0), column(1), column(2));
        let mut is_inside = [true; ABREAST];
        for axis in 0..3 {
            let [along_x, along_y, along_z] = near.turn[axis];
            let (low_m, high_m) = (near.low_m[axis], near.high_m[axis]);
            for k in 0..ABREAST {
                let place_m = along_x * x[k] + along_y * y[k] + along_z * z[k];
                is_inside[k] &= low_m <= place_m && place_m <= high_m;
            }
        }
        let bits = is_inside.iter().enumerate();
        bits.fold(0, |bits, (k, inside)| bits | (u32::from(*inside) << k))
    }
}

/// Squares of cosines that differ by less may be ordered otherwise by numbers of single precision.
const SAME: f64 = 1e-5;

/// Places of the points whose direction from the origin may be the nearest to `direction`, a unit vector.
pub fn nearest_to(direction: [f64; 3], xyz_m: &[[f32; 3]]) -> Vec<usize> {
    let (groups, rest) = xyz_m.as_chunks::<ABREAST>();
    let along = |points: &[[f32; 3]; ABREAST]| vectorized(Along { direction, points });
    let last: Vec<f64> = rest
        .iter()
        .map(|point| along_one(direction, point))
        .collect();
    let highest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let most = groups.iter().map(|points| highest(&along(points)));
    let limit = most.fold(highest(&last), f64::max) - SAME;
    let mut places = Vec::new();
    let mut take = |from: usize, values: &[f64]| {
        let near = values.iter().enumerate().filter(|(_, v)| **v >= limit);
        places.extend(near.map(|(k, _)| from + k));
    };
    for (number, points) in groups.iter().enumerate() {
        take(number * ABREAST, &along(points));
    }
    take(xyz_m.len() - rest.len(), &last);
    places
}

/// Square of the cosine between directions, with the sign of the cosine.
struct Along<'a> {
    direction: [f64; 3],
    points: &'a [[f32; 3]; ABREAST],
}

impl Kernel for Along<'_> {
    type Out = [f64; ABREAST];

    #[inline(always)]
    fn run(self) -> Self::Out {
        std::array::from_fn(|k| along_one(self.direction, &self.points[k]))
    }
}

#[inline(always)]
fn along_one(direction: [f64; 3], point: &[f32; 3]) -> f64 {
    let [x, y, z] = point.map(f64::from);
    let along = x * direction[0] + y * direction[1] + z * direction[2];
    along * along.abs() / (x * x + y * y + z * z).max(1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    #[test]
    fn no_point_of_the_box_is_left_out_and_few_others_are_taken() {
        let turn = Rotation3::from_euler_angles(0.3, -0.2, 2.0);
        let pose = WorldFromSensor::new(turn, Vector3::new(3.0, -7.0, 95.0));
        let (min_m, max_m) = ([0.0, -2.0, 90.0], [4.0, 1.5, 99.0]);
        let world = |k: usize| {
            let step = |prime: usize| (k * prime % 101) as f64 / 101.0;
            [
                8.0 * step(7) - 2.0,
                6.0 * step(31) - 3.0,
                85.0 + 20.0 * step(57),
            ]
        };
        let back = pose.inverse();
        let seen = |k: usize| {
            let point = back.transform(&world(k).into());
            [point.x as f32, point.y as f32, point.z as f32]
        };
        let points: Vec<[f32; 3]> = (0..101).map(seen).collect();
        let mut taken = Vec::new();
        NearBox::new(&pose, &min_m, &max_m).places(&points, |place| taken.push(place));
        let away_m = |k: &usize, axis: usize| {
            let x = world(*k)[axis];
            (f64::from(min_m[axis]) - x).max(x - f64::from(max_m[axis]))
        };
        let inside = |k: &usize| (0..3).all(|axis| away_m(k, axis) <= 0.0);
        assert!((0..101).filter(inside).all(|k| taken.contains(&k)));
        // 96 points are looked at side by side; what is beyond the margin there is not taken.
        let near = |k: &usize| (0..3).all(|axis| away_m(k, axis) <= 2e-3);
        assert!(taken.iter().filter(|k| **k < 96).all(near) && taken.is_sorted());
    }

    #[test]
    fn the_point_straight_below_is_among_the_nearest() {
        let point = |k: usize| {
            let turned = 0.3 * k as f32;
            [
                3.0 * turned.cos(),
                2.0 - k as f32 / 10.0,
                3.0 * turned.sin(),
            ]
        };
        let mut points: Vec<[f32; 3]> = (0..40).map(point).collect();
        points.extend([
            [0.0, -5.0, 0.01],
            [1.0, -4.0, 0.0],
            [0.0, -9.0, 0.02],
            [0.0; 3],
        ]);
        // 0.002 rad from the vertical both: which is the nearer is for others to say.
        assert_eq!(nearest_to([0.0, -1.0, 0.0], &points), [40, 42]);
        assert!(nearest_to([0.0, -1.0, 0.0], &[]).is_empty());
    }
}
