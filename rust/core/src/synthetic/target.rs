//! Surveyed targets: retroreflecting sheets and spheres.

use nalgebra::Vector3;

use super::terrain::{Hit, Ray};

/// A retroreflector sends back so many times the light of a white matt surface.
pub const RETROREFLECTIVITY: f64 = 30.0;

/// A target as it stands.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Middle of the sheet or of the sphere, metres.
    pub middle_m: Vector3<f64>,
    /// Half of the edge of a sheet, or the radius of a sphere, metres.
    pub half_m: f64,
    /// Where a sheet faces, unit length; `None`: a sphere.
    pub facing: Option<Vector3<f64>>,
}

impl Target {
    /// Where a ray meets it.
    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        let between = self.middle_m - ray.origin_m;
        let ahead_m = between.dot(&ray.direction);
        let apart_m = (between - ray.direction * ahead_m).norm();
        // Most rays pass by far.
        if ahead_m <= 0.0 || apart_m > self.half_m * std::f64::consts::SQRT_2 + 0.01 * ahead_m {
            return None;
        }
        let met = match &self.facing {
            Some(facing) => self.sheet(ray, facing),
            None => self.sphere(ahead_m, apart_m),
        };
        met.map(|(range_m, cos_incidence)| Hit {
            range_m,
            cos_incidence,
            reflectivity: RETROREFLECTIVITY,
        })
    }

    fn sheet(&self, ray: &Ray, facing: &Vector3<f64>) -> Option<(f64, f64)> {
        let steep = -ray.direction.dot(facing);
        if steep <= 1e-6 {
            return None;
        }
        let range_m = (ray.origin_m - self.middle_m).dot(facing) / steep;
        let from = ray.at(range_m) - self.middle_m;
        let level = Vector3::y().cross(facing);
        let level = if level.norm() < 1e-6 {
            Vector3::x()
        } else {
            level.normalize()
        };
        let up = facing.cross(&level);
        let is_inside = from.dot(&level).abs().max(from.dot(&up).abs()) <= self.half_m;
        (range_m > 0.0 && is_inside).then_some((range_m, steep))
    }

    fn sphere(&self, ahead_m: f64, apart_m: f64) -> Option<(f64, f64)> {
        let deep_m = self.half_m * self.half_m - apart_m * apart_m;
        (deep_m > 0.0).then(|| (ahead_m - deep_m.sqrt(), deep_m.sqrt() / self.half_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(x: f64) -> Ray {
        Ray {
            origin_m: Vector3::new(x, 0.0, 0.0),
            direction: Vector3::z(),
        }
    }

    #[test]
    fn a_sheet_is_met_inside_of_its_edges_and_from_its_front() {
        let sheet = Target {
            middle_m: Vector3::z() * 10.0,
            half_m: 0.1,
            facing: Some(Vector3::new(0.0, 0.6, -0.8)),
        };
        let hit = sheet.hit(&ray(0.09)).unwrap();
        assert!((hit.range_m - 10.0).abs() < 1e-12 && (hit.cos_incidence - 0.8).abs() < 1e-12);
        assert!(sheet.hit(&ray(0.11)).is_none());
        let behind = Target {
            facing: Some(Vector3::z()),
            ..sheet
        };
        assert!(behind.hit(&ray(0.0)).is_none());
    }

    #[test]
    fn a_sphere_is_met_on_its_near_side() {
        let sphere = Target {
            middle_m: Vector3::z() * 10.0,
            half_m: 0.1,
            facing: None,
        };
        assert!((sphere.hit(&ray(0.06)).unwrap().range_m - 9.92).abs() < 1e-12);
        assert!(sphere.hit(&ray(0.101)).is_none());
    }
}
