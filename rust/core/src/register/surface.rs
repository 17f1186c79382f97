//! Ground and walls: a surveyed plane, its low-order bend, and its roughness.

use nalgebra::{Unit, Vector3};

use super::field::{Around, Field};

/// Number of coefficients of the smooth part: 1, u, v, u^2, uv, v^2.
pub const COEFFICIENTS: usize = 6;

/// The layer of roughness of the survey and of all lidars that do not turn freely.
pub const SHARED: usize = 0;

/// Where a surface lies, to within what the adjustment finds: u and v along it, h along its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceFrame {
    /// A point on it, world frame, metres.
    pub origin_m: Vector3<f64>,
    /// Normal, world frame.
    pub normal: Unit<Vector3<f64>>,
    /// First direction along it, world frame.
    pub along: Unit<Vector3<f64>>,
    /// Half of its extent along u and v, metres.
    pub half_m: [f64; 2],
}

impl SurfaceFrame {
    /// A frame whose u follows the world's z as well as the plane allows.
    pub fn new(origin_m: Vector3<f64>, normal: Unit<Vector3<f64>>, half_m: [f64; 2]) -> Self {
        let upright = normal.z.abs() > 0.9;
        let wanted = if upright { Vector3::x() } else { Vector3::z() };
        let along = Unit::new_normalize(wanted - normal.into_inner() * normal.dot(&wanted));
        Self {
            origin_m,
            normal,
            along,
            half_m,
        }
    }

    /// Second direction along it.
    pub fn across(&self) -> Vector3<f64> {
        self.normal.cross(&self.along)
    }

    /// Coordinates u, v, h of a point of the world, metres.
    pub fn local(&self, point_m: &Vector3<f64>) -> [f64; 3] {
        let from = point_m - self.origin_m;
        [
            self.along.dot(&from),
            self.across().dot(&from),
            self.normal.dot(&from),
        ]
    }
}

/// A surface as it is taken to be.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Where it lies.
    pub frame: SurfaceFrame,
    /// Height h as a polynomial in u / half, v / half, metres.
    pub coefficients: [f64; COEFFICIENTS],
    /// Roughness on top; None while it is not known.
    pub field: Option<Field>,
}

/// Height and gradient of a surface above a place, and how they follow from its unknowns.
#[derive(Debug, Clone, Copy)]
pub struct Height {
    /// Height above the frame's plane, metres.
    pub height_m: f64,
    /// Derivatives of its smooth part along u and v.
    pub slope: [f64; 2],
    /// Derivatives by the coefficients.
    pub basis: [f64; COEFFICIENTS],
    /// Nodes of the roughness.
    pub around: Option<Around>,
}

impl Surface {
    /// The flat surface of a frame.
    pub fn flat(frame: SurfaceFrame) -> Self {
        Self {
            frame,
            coefficients: [0.0; COEFFICIENTS],
            field: None,
        }
    }

    /// Nodes of one layer of the roughness around a point of the world, None where there are none.
    pub fn around(&self, layer: usize, point_m: &Vector3<f64>) -> Option<Around> {
        let [u, v, _] = self.frame.local(point_m);
        self.field.as_ref()?.around(layer, &[u, v])
    }

    /// Its height above the place (u, v), of whose roughness the nodes `around` tell.
    pub fn height(&self, u: f64, v: f64, around: Option<Around>) -> Height {
        let [a, b] = self.frame.half_m;
        let (x, y) = (u / a, v / b);
        let basis = [1.0, x, y, x * x, x * y, y * y];
        let by_u = [0.0, 1.0 / a, 0.0, 2.0 * x / a, y / a, 0.0];
        let by_v = [0.0, 0.0, 1.0 / b, 0.0, x / b, 2.0 * y / b];
        let sum = |terms: &[f64; COEFFICIENTS]| -> f64 {
            terms
                .iter()
                .zip(&self.coefficients)
                .map(|(t, c)| t * c)
                .sum()
        };
        let mut height = Height {
            height_m: sum(&basis),
            slope: [sum(&by_u), sum(&by_v)],
            basis,
            around,
        };
        if let (Some(field), Some(around)) = (&self.field, &height.around) {
            let nodes = around.nodes.iter().zip(around.weights);
            height.height_m += nodes.map(|(k, w)| w * field.heights_m[*k]).sum::<f64>();
        }
        height
    }

    /// How far a point of the world lies above the surface along the normal, metres; the gradient of
    /// that by the point, world frame; and the height it was taken from.
    ///
    /// The gradient is that of the smooth part: the slopes of the roughness are as uncertain as they
    /// are steep, and a derivative that follows them takes noise for leverage.
    pub fn above(&self, point_m: &Vector3<f64>) -> (f64, Vector3<f64>, Height) {
        self.above_nodes(point_m, self.around(SHARED, point_m))
    }

    /// How slantwise a ray from `origin_m` meets it at a place: 1 / cos(incidence) - 1.
    pub fn slant(&self, origin_m: &Vector3<f64>, point_m: &Vector3<f64>) -> f64 {
        let (ray, gradient) = (point_m - origin_m, self.above(point_m).1);
        let cosine = gradient.dot(&ray).abs() / (gradient.norm() * ray.norm());
        1.0 / cosine.max(LEAST_COSINE) - 1.0
    }

    fn above_nodes(
        &self,
        point_m: &Vector3<f64>,
        around: Option<Around>,
    ) -> (f64, Vector3<f64>, Height) {
        let [u, v, h] = self.frame.local(point_m);
        let height = self.height(u, v, around);
        let gradient = self.frame.normal.into_inner()
            - self.frame.along.into_inner() * height.slope[0]
            - self.frame.across() * height.slope[1];
        (h - height.height_m, gradient, height)
    }

    /// Range at which a ray meets the surface, metres, with the gradient and height there.
    ///
    /// The roughness is that of the nodes `around` the place where the ray ended. A ray that follows it
    /// from place to place wanders where it is flatter than the roughness is steep, and ends somewhere
    /// else with every step of the adjustment.
    ///
    /// None where the ray runs along the surface or the search does not settle.
    pub fn meet(
        &self,
        origin_m: &Vector3<f64>,
        direction: &Vector3<f64>,
        near_m: f64,
        around: Option<Around>,
    ) -> Option<(f64, Vector3<f64>, Height)> {
        let mut range_m = near_m;
        for _ in 0..MEET_STEPS {
            let (above, gradient, height) =
                self.above_nodes(&(origin_m + direction * range_m), around);
            let closing = gradient.dot(direction);
            if closing.abs() < LEAST_COSINE {
                return None;
            }
            let step = above / closing;
            range_m -= step;
            if step.abs() < MEET_TOLERANCE_M {
                return Some((range_m, gradient, height));
            }
        }
        None
    }
}

/// The bend of a surface needs two or three.
const MEET_STEPS: usize = 10;
const MEET_TOLERANCE_M: f64 = 1e-6;
/// Rays flatter than this against the surface meet it nowhere in particular.
const LEAST_COSINE: f64 = 0.01;

#[cfg(test)]
mod tests {
    use super::*;

    fn bent() -> Surface {
        let normal = Unit::new_normalize(Vector3::new(-0.02, 1.0, 0.0123));
        let frame = SurfaceFrame::new(Vector3::new(0.0, -8.0, 95.0), normal, [20.0, 15.0]);
        Surface {
            coefficients: [0.01, 0.02, -0.01, 0.03, 0.01, -0.02],
            ..Surface::flat(frame)
        }
    }

    #[test]
    fn the_frame_is_right_handed_along_the_plane() {
        let frame = bent().frame;
        let point = frame.origin_m + frame.along.into_inner() * 2.0 - frame.across() * 3.0
            + frame.normal.into_inner() * 0.1;
        let local = frame.local(&point);
        for (found, expected) in local.iter().zip([2.0, -3.0, 0.1]) {
            assert!((found - expected).abs() < 1e-12);
        }
        assert!(frame.along.z > 0.99);
    }

    #[test]
    fn a_ray_meets_the_surface_where_nothing_is_above_it() {
        let surface = bent();
        let origin = Vector3::new(3.0, -6.8, 86.0);
        let direction = Vector3::new(-0.7, -0.2, 0.3).normalize();
        let (range_m, ..) = surface.meet(&origin, &direction, 5.0, None).unwrap();
        let (above, ..) = surface.above(&(origin + direction * range_m));
        assert!(above.abs() < 1e-9);
        let along = Vector3::new(-1.0, -0.0201, 0.0).normalize();
        assert!(surface.meet(&origin, &along, 5.0, None).is_none());
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        let surface = bent();
        let point = Vector3::new(3.0, -7.0, 90.0);
        let (above, gradient, _) = surface.above(&point);
        for k in 0..3 {
            let mut moved = point;
            moved[k] += 1e-5;
            let numeric = (surface.above(&moved).0 - above) / 1e-5;
            assert!((numeric - gradient[k]).abs() < 1e-6);
        }
    }
}
