//! What stands around the blade: sloped rough ground, a wall, boxes.

use nalgebra::Vector3;

use super::random::{Stream, Subject};
use super::target::Target;

/// A ray in the world frame; the direction has length one.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Start, metres.
    pub origin_m: Vector3<f64>,
    /// Direction of unit length.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// The point at a range, metres.
    pub fn at(&self, range_m: f64) -> Vector3<f64> {
        self.origin_m + self.direction * range_m
    }
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, metres.
    pub range_m: f64,
    /// Cosine of the angle between ray and normal, 0 to 1.
    pub cos_incidence: f64,
    /// Share of the light that a matt surface sends back.
    pub reflectivity: f64,
}

impl Hit {
    /// The nearer of two hits.
    pub fn nearer(a: Option<Hit>, b: Option<Hit>) -> Option<Hit> {
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.range_m < a.range_m { b } else { a }),
            (a, b) => a.or(b),
        }
    }
}

/// Slope and roughness of the ground.
#[derive(Debug, Clone, Copy)]
pub struct GroundPlan {
    /// Height at x = z = 0, metres.
    pub height_m: f64,
    /// Rise per metre along x and along z.
    pub slope: [f64; 2],
    /// Standard deviation of the heights, metres.
    pub roughness_m: f64,
    /// Distance over which heights are alike, metres.
    pub correlation_m: f64,
    /// Standard deviation of wider swells, eight times as long, metres.
    pub swell_m: f64,
}

const REFLECTIVITY_GROUND: f64 = 0.2;
const REFLECTIVITY_WALL: f64 = 0.45;
const REFLECTIVITY_BOX: f64 = 0.35;
/// Swells are so many times as long as the roughness.
const SWELL: f64 = 8.0;
/// Cells of the height field before it repeats.
const CELLS: usize = 256;

/// The ground as it is.
#[derive(Debug, Clone)]
pub struct Ground {
    plan: GroundPlan,
    fields: Vec<Field>,
}

/// Smooth heights over a grid.
#[derive(Debug, Clone)]
struct Field {
    cell_m: f64,
    heights_m: Vec<f32>,
}

impl Ground {
    /// Draws the heights from `seed`.
    pub fn new(plan: GroundPlan, seed: u64) -> Self {
        let mut stream = Stream::new(seed, Subject::Ground, [0, 0]);
        let scales = [
            (plan.roughness_m, plan.correlation_m),
            (plan.swell_m, SWELL * plan.correlation_m),
        ];
        let scales = scales.into_iter().filter(|(sigma_m, _)| *sigma_m > 0.0);
        Self {
            plan,
            fields: scales
                .map(|(sigma_m, cell_m)| Field::new(&mut stream, sigma_m, cell_m))
                .collect(),
        }
    }

    fn plane_m(&self, x: f64, z: f64) -> f64 {
        self.plan.height_m + self.plan.slope[0] * x + self.plan.slope[1] * z
    }

    fn rough_m(&self, x: f64, z: f64) -> f64 {
        self.fields.iter().map(|field| field.height_m(x, z)).sum()
    }

    /// Height at a place, metres.
    pub fn height_m(&self, x: f64, z: f64) -> f64 {
        self.plane_m(x, z) + self.rough_m(x, z)
    }

    /// Where a ray from above meets the ground within `limit_m`.
    pub fn hit(&self, ray: &Ray, limit_m: f64) -> Option<Hit> {
        let (o, d) = (&ray.origin_m, &ray.direction);
        let sink = self.plan.slope[0] * d.x + self.plan.slope[1] * d.z - d.y;
        let above = o.y - self.plane_m(o.x, o.z);
        if sink * limit_m < above {
            return None;
        }
        let mut range_m = above / sink;
        for _ in 0..if self.fields.is_empty() { 0 } else { 3 } {
            let at = ray.at(range_m);
            range_m = (above - self.rough_m(at.x, at.z)) / sink;
        }
        let normal = Vector3::new(-self.plan.slope[0], 1.0, -self.plan.slope[1]).normalize();
        (range_m > 0.0 && range_m < limit_m).then(|| Hit {
            range_m,
            cos_incidence: -normal.dot(d),
            reflectivity: REFLECTIVITY_GROUND,
        })
    }
}

impl Field {
    fn new(stream: &mut Stream, sigma_m: f64, cell_m: f64) -> Self {
        // Bilinear blending averages; the factor gives the deviation back in the mean over a cell.
        let scale = sigma_m * 1.5;
        let heights_m = (0..CELLS * CELLS)
            .map(|_| (scale * stream.normal()) as f32)
            .collect();
        Self { cell_m, heights_m }
    }

    fn height_m(&self, x: f64, z: f64) -> f64 {
        let (u, v) = (x / self.cell_m, z / self.cell_m);
        let (i, j) = (u.floor(), v.floor());
        // Smooth weights, so that no crease follows the grid.
        let ease = |t: f64| t * t * (3.0 - 2.0 * t);
        let (a, b) = (ease(u - i), ease(v - j));
        let row = |i: f64| (i.rem_euclid(CELLS as f64) as usize % CELLS) * CELLS;
        let column = |j: f64| j.rem_euclid(CELLS as f64) as usize % CELLS;
        let height = |row: usize, column: usize| f64::from(self.heights_m[row + column]);
        let (r0, r1, c0, c1) = (row(i), row(i + 1.0), column(j), column(j + 1.0));
        (1.0 - a) * ((1.0 - b) * height(r0, c0) + b * height(r0, c1))
            + a * ((1.0 - b) * height(r1, c0) + b * height(r1, c1))
    }
}

/// An upright wall, of which one side is seen.
#[derive(Debug, Clone, Copy)]
pub struct Wall {
    /// x at z = 0, metres.
    pub x_m: f64,
    /// Change of x per metre of z.
    pub slope: f64,
    /// From and to along z, metres.
    pub z_m: [f64; 2],
    /// Height of its top, metres.
    pub top_m: f64,
    /// By how much its middle stands out against its ends, metres.
    pub bow_m: f64,
    /// By how much it leans at its top, metres per metre of height over y = 0.
    pub lean: f64,
}

impl Wall {
    /// x of the wall at a height and a place along the blade, metres.
    pub fn at(&self, y: f64, z: f64) -> f64 {
        let [from, to] = self.z_m;
        let place = 2.0 * (z - from) / (to - from) - 1.0;
        self.plane(y, z) + self.bow_m * (1.0 - place * place)
    }

    fn plane(&self, y: f64, z: f64) -> f64 {
        self.x_m + self.slope * z + self.lean * y
    }

    /// Where a ray meets the wall, whatever lies below.
    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        let (o, d) = (&ray.origin_m, &ray.direction);
        let closing = d.x - self.slope * d.z - self.lean * d.y;
        let mut range_m = (self.plane(o.y, o.z) - o.x) / closing;
        for _ in 0..if self.bow_m == 0.0 { 0 } else { 4 } {
            let at = ray.at(range_m);
            range_m += (self.at(at.y, at.z) - at.x) / closing;
        }
        let at = ray.at(range_m);
        let seen = range_m > 0.0 && at.y < self.top_m && (self.z_m[0]..self.z_m[1]).contains(&at.z);
        seen.then(|| Hit {
            range_m,
            cos_incidence: (closing / (1.0 + self.slope.powi(2) + self.lean.powi(2)).sqrt()).abs(),
            reflectivity: REFLECTIVITY_WALL,
        })
    }
}

/// Where a ray meets a box with sides along the axes of its own frame, in that frame.
pub fn box_hit(
    origin_m: &Vector3<f64>,
    direction: &Vector3<f64>,
    half_m: &Vector3<f64>,
) -> Option<(f64, f64)> {
    let (mut near, mut far, mut cosine) = (f64::NEG_INFINITY, f64::INFINITY, 0.0);
    for axis in 0..3 {
        let (o, d) = (origin_m[axis], direction[axis]);
        let (a, b) = ((-half_m[axis] - o) / d, (half_m[axis] - o) / d);
        if a.min(b) > near {
            (near, cosine) = (a.min(b), d.abs());
        }
        far = far.min(a.max(b));
    }
    (near > 0.0 && near < far).then_some((near, cosine))
}

/// A box standing about, sides along the world's axes.
#[derive(Debug, Clone, Copy)]
pub struct Crate {
    /// Middle, metres.
    pub middle_m: Vector3<f64>,
    /// Half of its extents, metres.
    pub half_m: Vector3<f64>,
}

/// All that stands still.
#[derive(Debug, Clone)]
pub struct Terrain {
    /// The ground.
    pub ground: Ground,
    /// A wall, where there is one.
    pub wall: Option<Wall>,
    /// Boxes.
    pub boxes: Vec<Crate>,
    /// Targets.
    pub targets: Vec<Target>,
}

impl Terrain {
    /// The nearest thing that a ray meets within `limit_m`.
    pub fn hit(&self, ray: &Ray, limit_m: f64) -> Option<Hit> {
        let mut nearest = self.ground.hit(ray, limit_m);
        if let Some(wall) = &self.wall {
            nearest = Hit::nearer(nearest, wall.hit(ray).filter(|hit| hit.range_m < limit_m));
        }
        for item in &self.boxes {
            let hit = box_hit(
                &(ray.origin_m - item.middle_m),
                &ray.direction,
                &item.half_m,
            );
            let hit = hit.map(|(range_m, cos_incidence)| Hit {
                range_m,
                cos_incidence,
                reflectivity: REFLECTIVITY_BOX,
            });
            nearest = Hit::nearer(nearest, hit.filter(|hit| hit.range_m < limit_m));
        }
        for target in &self.targets {
            let hit = target.hit(ray).filter(|hit| hit.range_m < limit_m);
            nearest = Hit::nearer(nearest, hit);
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(direction: [f64; 3]) -> Ray {
        Ray {
            origin_m: Vector3::new(0.0, 2.0, 0.0),
            direction: Vector3::from(direction).normalize(),
        }
    }

    fn ground(roughness_m: f64) -> Ground {
        let plan = GroundPlan {
            height_m: 0.0,
            slope: [0.1, 0.0],
            roughness_m,
            correlation_m: 0.7,
            swell_m: 0.0,
        };
        Ground::new(plan, 5)
    }

    #[test]
    fn a_plane_is_met_where_algebra_says() {
        // y = 2 - r / sqrt 2 and 0.1 x = 0.1 r / sqrt 2 meet at r = 2 sqrt 2 / 1.1.
        let hit = ground(0.0).hit(&ray([1.0, -1.0, 0.0]), 100.0).unwrap();
        assert!((hit.range_m - 2.0 * 2f64.sqrt() / 1.1).abs() < 1e-12);
        assert!(ground(0.0).hit(&ray([-1.0, 0.2, 0.0]), 100.0).is_none());
    }

    #[test]
    fn a_hit_lies_on_the_rough_ground() {
        let ground = ground(0.02);
        let mut squares = 0.0;
        for i in 0..400 {
            let ray = ray([0.05 * f64::from(i % 20), -1.0, 0.05 * f64::from(i / 20)]);
            let at = ray.at(ground.hit(&ray, 100.0).unwrap().range_m);
            assert!((at.y - ground.height_m(at.x, at.z)).abs() < 1e-4);
            squares += ground.rough_m(at.x * 40.0, at.z * 40.0).powi(2) / 400.0;
        }
        assert!(
            (0.015..0.026).contains(&squares.sqrt()),
            "{}",
            squares.sqrt()
        );
    }

    #[test]
    fn walls_and_boxes_are_met_from_outside() {
        let wall = Wall {
            x_m: -10.0,
            slope: 0.0,
            z_m: [-5.0, 5.0],
            top_m: 4.0,
            bow_m: 0.0,
            lean: 0.0,
        };
        assert_eq!(wall.hit(&ray([-1.0, 0.0, 0.0])).unwrap().range_m, 10.0);
        assert!(wall.hit(&ray([-1.0, 0.5, 0.0])).is_none());
        let half = Vector3::repeat(0.5);
        let hit = box_hit(&Vector3::new(-3.0, 0.2, 0.0), &Vector3::x(), &half);
        assert_eq!(hit, Some((2.5, 1.0)));
        assert!(box_hit(&Vector3::new(-3.0, 0.6, 0.0), &Vector3::x(), &half).is_none());
    }

    #[test]
    fn a_bent_wall_is_met_on_its_surface() {
        let wall = Wall {
            x_m: -20.0,
            slope: 0.02,
            z_m: [60.0, 140.0],
            top_m: 5.0,
            bow_m: 0.3,
            lean: 0.01,
        };
        let ray = Ray {
            origin_m: Vector3::new(0.0, -5.0, 90.0),
            direction: Vector3::new(-0.9, 0.2, 0.3).normalize(),
        };
        let at = ray.at(wall.hit(&ray).unwrap().range_m);
        assert!((at.x - wall.at(at.y, at.z)).abs() < 1e-6);
        assert!((wall.at(0.0, 100.0) - wall.at(0.0, 60.0) - 0.3 - 0.8).abs() < 1e-12);
    }
}
