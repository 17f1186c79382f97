//! Step 5: the pass-through filter, one box for the whole test.

use nalgebra::Point3;

use super::inside::BoxView;
use super::near::NearBox;
use crate::angle::{Arc, wrap_turn};
use crate::error::InvalidValue;
use crate::frame::WorldFromSensor;
use crate::stand::Stands;

/// A box that comes nearer to the spin axis than this may be seen in any direction, metres.
const NEAR_M: f64 = 0.5;
/// So much farther than the box points may lie that rounding brings into it, metres and relative.
const ROUNDING: f64 = 1e-3;
/// The same of a direction.
const ROUNDING_RAD: f64 = 1e-3;

/// An axis-aligned box in the world frame, metres; its faces belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassThrough {
    min_m: [f32; 3],
    max_m: [f32; 3],
}

impl PassThrough {
    /// The box between two corners.
    ///
    /// # Errors
    /// [`InvalidValue`] where a side is not longer than zero.
    pub fn new(min_m: [f64; 3], max_m: [f64; 3]) -> Result<Self, InvalidValue> {
        if !min_m.iter().zip(&max_m).all(|(min, max)| min < max) {
            return Err(InvalidValue {
                name: "box_m",
                expected: "a lower and a higher bound on every axis".into(),
                found: format!("{min_m:?} to {max_m:?}"),
            });
        }
        Ok(Self {
            min_m: min_m.map(|v| v as f32),
            max_m: max_m.map(|v| v as f32),
        })
    }

    /// Bearings, from x towards y in the frame of a lidar, outside of which no point of the box lies wherever the
    /// lidar stands; `None` where it may see the box all around.
    pub fn bearings(&self, stands: &Stands) -> Option<Arc> {
        let views = stands.iter().map(|stand| stand.pose.inverse());
        let corners: Vec<Point3<f64>> = views
            .flat_map(|view| self.corners().map(|corner| view.transform(&corner)))
            .collect();
        let bearings: Vec<f64> = corners.iter().map(|p| p.y.atan2(p.x)).collect();
        let arc = Arc::around(&bearings)?;
        let (sin, cos) = (arc.from_rad + 0.5 * arc.width_rad).sin_cos();
        let is_clear = corners.iter().all(|p| p.x * cos + p.y * sin > NEAR_M);
        is_clear.then(|| Arc {
            from_rad: wrap_turn(arc.from_rad - ROUNDING_RAD),
            width_rad: arc.width_rad + 2.0 * ROUNDING_RAD,
        })
    }

    /// What tells quickly which points of a lidar may lie in the box.
    pub fn near(&self, pose: &WorldFromSensor) -> NearBox {
        NearBox::new(pose, &self.min_m, &self.max_m)
    }

    /// What carries the points of a lidar that lie in the box into the world.
    pub fn view(&self, pose: &WorldFromSensor) -> BoxView {
        BoxView::new(pose, self.min_m, self.max_m)
    }

    /// The eight corners of the box, a little farther out.
    fn corners(&self) -> [Point3<f64>; 8] {
        std::array::from_fn(|corner| {
            Point3::from(std::array::from_fn(|axis| {
                let (end, sign) = match (corner >> axis) & 1 {
                    0 => (self.min_m[axis], -1.0),
                    _ => (self.max_m[axis], 1.0),
                };
                let end = f64::from(end);
                end + sign * ROUNDING * (1.0 + ROUNDING * end.abs())
            }))
        })
    }

    /// Which points lie in the box.
    pub fn mask(&self, points_m: &[[f32; 3]]) -> Vec<bool> {
        points_m.iter().map(|point| self.contains(point)).collect()
    }

    /// Whether a point lies in the box.
    pub fn contains(&self, point_m: &[f32; 3]) -> bool {
        (0..3).all(|axis| (self.min_m[axis]..=self.max_m[axis]).contains(&point_m[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    #[test]
    fn faces_belong_to_the_box_and_nan_does_not() {
        let pass = PassThrough::new([0.0; 3], [1.0, 2.0, 3.0]).unwrap();
        assert!(pass.contains(&[0.0, 2.0, 1.5]));
        assert!(!pass.contains(&[0.0, 2.1, 1.5]));
        assert!(!pass.contains(&[f32::NAN, 1.0, 1.0]));
    }

    #[test]
    fn bearings_hold_all_of_the_box_and_a_box_around_the_lidar_has_none() {
        let turn = Rotation3::from_euler_angles(0.01, -0.02, 2.0);
        let pose = WorldFromSensor::new(turn, Vector3::new(3.0, -7.0, 90.0));
        let seen = PassThrough::new([-5.0, -4.0, 70.0], [12.0, 6.0, 111.0]).unwrap();
        let arc = seen.bearings(&Stands::still(0, pose)).unwrap();
        for k in 0..1000 {
            let share = |k: i32| f64::from(k % 10) / 9.0;
            let (x, y, z) = (
                17.0 * share(k) - 5.0,
                10.0 * share(k / 10) - 4.0,
                41.0 * share(k / 100) + 70.0,
            );
            let p = pose.inverse().transform(&Point3::new(x, y, z));
            assert!(wrap_turn(p.y.atan2(p.x) - arc.from_rad) <= arc.width_rad);
        }
        let around = PassThrough::new([-5.0, -9.0, 70.0], [12.0, 6.0, 111.0]).unwrap();
        assert_eq!(around.bearings(&Stands::still(0, pose)), None);
    }

    #[test]
    fn an_empty_box_is_refused() {
        assert!(PassThrough::new([0.0; 3], [1.0, 0.0, 1.0]).is_err());
        assert!(PassThrough::new([0.0; 3], [1.0, f64::NAN, 1.0]).is_err());
    }
}
