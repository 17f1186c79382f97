//! The point of the blade nearest to a measured one: what tells where a blade lies that is not yet found.
//!
//! A ray against the blade tells nothing where it misses, and too much where it grazes: a blade that is
//! elsewhere would turn away from its own echoes. The distance of a point from the side that its lidar sees
//! does neither.

use nalgebra::{Vector2, Vector3};

use super::mesh::Mesh;
use super::sight::{Contact, Instant, Section, contact, local};

/// Improvements of the arc length of the section in which the point lies.
const STEPS: usize = 4;

/// The nearest point of the side that a lidar sees.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    /// Where it is.
    pub contact: Contact,
    /// From it towards the measured point or away from it, world, unit length.
    pub towards: Vector3<f64>,
    /// How far the measured point lies off along `towards`, metres.
    pub off_m: f64,
}

impl Instant<'_> {
    /// The point of the blade nearest to a point that was seen in a direction; none where no facet of its
    /// section faces the lidar.
    pub fn near(
        &self,
        mesh: &Mesh,
        point: &Vector3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<Near> {
        let mut s_m = self.nearest_s_m(mesh, point, &Vector3::zeros());
        for _ in 0..STEPS {
            let section = self.section(mesh, s_m);
            s_m += section.turn.column(2).dot(&(point - section.place));
            s_m = s_m.clamp(0.0, mesh.length_m());
        }
        let section = self.section(mesh, s_m);
        let from = section.turn.tr_mul(&(point - section.place)).xy();
        let way = section.turn.tr_mul(direction).xy();
        let facets = 0..mesh.outline[0].len();
        let seen = facets.filter_map(|vertex| facet(mesh, &section, vertex, &from, &way));
        let (_, vertex, along) = seen.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Near::new(
            contact(mesh, section, vertex, along),
            point,
            along,
        ))
    }
}

/// Square of the distance of a point from a facet that faces the lidar, the facet, and the place on it.
fn facet(
    mesh: &Mesh,
    section: &Section,
    vertex: usize,
    from: &Vector2<f64>,
    way: &Vector2<f64>,
) -> Option<(f64, usize, f64)> {
    let next = (vertex + 1) % mesh.outline[0].len();
    let [start, end] = [vertex, next].map(|i| local(mesh, section, i, 0.0).xy());
    let side = end - start;
    let faces = mesh.hand * (side.x * way.y - side.y * way.x) < 0.0;
    let along = ((from - start).dot(&side) / side.norm_squared()).clamp(0.0, 1.0);
    let square = (from - start - side * along).norm_squared();
    (faces && square.is_finite()).then_some((square, vertex, along))
}

impl Near {
    fn new(contact: Contact, point: &Vector3<f64>, along: f64) -> Self {
        let off = point - contact.point;
        let is_inside = along > 0.0 && along < 1.0;
        // A point on a corner is off in no direction.
        let aside = off.try_normalize(0.0).filter(|_| !is_inside);
        let towards = aside.unwrap_or(contact.normal);
        let off_m = off.dot(&towards);
        Self {
            contact,
            towards,
            off_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample;

    #[test]
    fn a_point_off_the_side_that_is_seen_is_as_far_as_it_was_moved() {
        let adjustment = sample::adjustment(0.0);
        let (mesh, posed) = (&adjustment.problem.mesh, adjustment.posed(0));
        let (blade, origin) = (posed.at(0), adjustment.rig.lidar(0).origin);
        let mut seen = 0;
        for direction in sample::directions() {
            let start_m = blade.nearest_s_m(mesh, &origin, &direction);
            let Some(hit) = blade.hit(mesh, &origin, &direction, start_m) else {
                continue;
            };
            let moved = |by_m: f64| hit.contact.point + hit.contact.normal * by_m;
            let off_m = |by_m| blade.near(mesh, &moved(by_m), &direction).unwrap().off_m;
            assert!(off_m(0.0).abs() < 1e-6);
            assert!((off_m(0.2) - 0.2).abs() < 2e-3, "{}", off_m(0.2));
            // Behind the side that is seen a point is off by no more than to that side.
            assert!((-0.021..0.0).contains(&off_m(-0.02)), "{}", off_m(-0.02));
            seen += 1;
        }
        assert!(seen > 100, "{seen}");
    }
}
