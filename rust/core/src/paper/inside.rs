//! Points of a lidar that stands still, carried into the world side by side: which of them lie in a box.

use crate::frame::WorldFromSensor;
use crate::simd::{Kernel, vectorized};

/// Points that are worked out side by side.
const ABREAST: usize = 16;

/// A pose, and a box in the world.
#[derive(Debug, Clone, Copy)]
pub struct BoxView {
    turn: [f64; 3], // the quaternion's vector
    scalar: f64,
    at_m: [f64; 3],
    min_m: [f32; 3],
    max_m: [f32; 3],
}

/// Points that lie in a box.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inside {
    /// Positions, metres, world frame.
    pub points_m: Vec<[f32; 3]>,
    /// Their places among all.
    pub places: Vec<u32>,
}

impl BoxView {
    /// The box between two corners of the world, for a lidar with this pose.
    pub fn new(pose: &WorldFromSensor, min_m: [f32; 3], max_m: [f32; 3]) -> Self {
        let (turn, scalar) = pose.quaternion();
        Self {
            turn,
            scalar,
            at_m: pose.translation_m().into(),
            min_m,
            max_m,
        }
    }

    /// The points, sensor frame, that lie in the box, in their order.
    pub fn inside(&self, xyz_m: &[[f32; 3]]) -> Inside {
        let mut inside = Inside::default();
        vectorized(Carry {
            view: self,
            xyz_m,
            inside: &mut inside,
        });
        inside
    }
}

struct Carry<'a> {
    view: &'a BoxView,
    xyz_m: &'a [[f32; 3]],
    inside: &'a mut Inside,
}

impl Kernel for Carry<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let (groups, rest) = self.xyz_m.as_chunks::<ABREAST>();
        for (number, points) in groups.iter().enumerate() {
            let (world_m, bits) = self.view.carry(points);
            self.inside.keep(&world_m, bits, number * ABREAST);
        }
        let mut last = [[0.0; 3]; ABREAST];
        last[..rest.len()].copy_from_slice(rest);
        let (world_m, bits) = self.view.carry(&last);
        let own = (1 << rest.len()) - 1;
        self.inside
            .keep(&world_m, bits & own, groups.len() * ABREAST);
    }
}

impl BoxView {
    /// Positions in the world, to the bit those of [`WorldFromSensor::transform`], and a bit for each in the box.
    #[inline(always)]
    fn carry(&self, points: &[[f32; 3]; ABREAST]) -> ([[f32; 3]; ABREAST], u32) {
        let ([a, b, c], [at_x, at_y, at_z]) = (self.turn, self.at_m);
        let mut world_m = [[0.0; 3]; ABREAST];
        let mut is_inside = [false; ABREAST];
        for k in 0..ABREAST {
            let [x, y, z] = points[k].map(f64::from);
            let twice = [
                (b * z - c * y) * 2.0,
                (c * x - a * z) * 2.0,
                (a * y - b * x) * 2.0,
            ];
            let across = [
                b * twice[2] - c * twice[1],
                c * twice[0] - a * twice[2],
                a * twice[1] - b * twice[0],
            ];
            let point = [
                (twice[0] * self.scalar + across[0] + x + at_x) as f32,
                (twice[1] * self.scalar + across[1] + y + at_y) as f32,
                (twice[2] * self.scalar + across[2] + z + at_z) as f32,
            ];
            is_inside[k] = (self.min_m[0] <= point[0])
                & (point[0] <= self.max_m[0])
                & (self.min_m[1] <= point[1])
                & (point[1] <= self.max_m[1])
                & (self.min_m[2] <= point[2])
                & (point[2] <= self.max_m[2]);
            world_m[k] = point;
        }
        let bits = is_inside.iter().enumerate();
        let bits = bits.fold(0, |bits, (k, inside)| bits | (u32::from(*inside) << k));
        (world_m, bits)
    }
}

impl Inside {
    #[inline(always)]
    fn keep(&mut self, world_m: &[[f32; 3]; ABREAST], mut bits: u32, first: usize) {
        while bits != 0 {
            let k = bits.trailing_zeros() as usize % ABREAST;
            self.points_m.push(world_m[k]);
            self.places.push((first + k) as u32);
            bits &= bits - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::passthrough::PassThrough;
    use nalgebra::{Point3, Rotation3, Vector3};

    #[test]
    fn points_in_the_box_are_those_carried_over_one_by_one() {
        let turn = Rotation3::from_euler_angles(0.3, -0.2, 2.0);
        let pose = WorldFromSensor::new(turn, Vector3::new(3.0, -7.0, 95.0));
        let pass = PassThrough::new([0.0, -2.0, 90.0], [4.0, 1.5, 99.0]).unwrap();
        let back = pose.inverse();
        let seen = |k: usize| {
            let step = |prime: usize| (k * prime % 1009) as f64 / 1009.0;
            let (x, y, z) = (
                8.0 * step(7) - 2.0,
                6.0 * step(31) - 3.0,
                85.0 + 20.0 * step(57),
            );
            let point = back.transform(&Point3::new(x, y, z));
            [point.x as f32, point.y as f32, point.z as f32]
        };
        let carried = |point: &[f32; 3]| {
            let point = pose.transform(&Point3::from(point.map(f64::from)));
            [point.x as f32, point.y as f32, point.z as f32]
        };
        for count in [0, 1, 16, 1003] {
            let mut points: Vec<[f32; 3]> = (0..count).map(seen).collect();
            points.extend([[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]]);
            let found = pass.view(&pose).inside(&points);
            let places = (0..points.len()).filter(|k| pass.contains(&carried(&points[*k])));
            let places: Vec<u32> = places.map(|k| k as u32).collect();
            let points_m = places
                .iter()
                .map(|k| carried(&points[*k as usize]))
                .collect();
            assert!(count < 1000 || places.len() > 100);
            assert_eq!(found, Inside { points_m, places });
        }
    }
}
