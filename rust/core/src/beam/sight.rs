//! A ray against the blade: where it meets the surface.

use nalgebra::{Matrix3, Vector3};

use super::axis::Axis;
use super::mesh::Mesh;
use super::table;
use crate::simd::{Kernel, vectorized};

/// Improvements of the arc length at which a ray meets the blade.
const STEPS: usize = 6;
/// The hit lies in the plane of its section to this, metres.
const CONVERGED_M: f64 = 1e-5;
/// Points of the outline that are held against a line at once.
const LANES: usize = 16;

/// Two states between which the blade is, and the share of the way.
#[derive(Debug, Clone, Copy)]
pub struct Instant<'a> {
    /// State before.
    pub before: &'a Axis,
    /// State after.
    pub after: &'a Axis,
    /// Share of the way between both.
    pub share: f64,
}

/// A section at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Section {
    /// Inner node of its element.
    pub node: usize,
    /// Place within the element.
    pub share: f64,
    /// World place of the axis, metres.
    pub place: Vector3<f64>,
    /// World directions of the section.
    pub turn: Matrix3<f64>,
    /// Curvature in the section's directions, rad/m.
    pub curvature: Vector3<f64>,
}

/// Where something meets the surface.
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// The section.
    pub section: Section,
    /// Point from the axis in the section's directions, metres.
    pub local: Vector3<f64>,
    /// World point, metres.
    pub point: Vector3<f64>,
    /// Place along the chord, and whether on the second half of the outline.
    pub x_c: f64,
    /// Index of the outline's point at or before the contact.
    pub vertex: usize,
    /// Outward normal, world, unit length.
    pub normal: Vector3<f64>,
}

/// A ray that meets the surface.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Where.
    pub contact: Contact,
    /// Distance along the ray, metres.
    pub range_m: f64,
    /// Cosine of the angle of incidence.
    pub cosine: f64,
}

impl Instant<'_> {
    /// The section at an arc length.
    pub fn section(&self, mesh: &Mesh, s_m: f64) -> Section {
        self.section_at(mesh, table::interval(&mesh.s_m, s_m))
    }

    /// The same of one that probably lies in the element beyond a node.
    pub fn section_near(&self, mesh: &Mesh, s_m: f64, node: usize) -> Section {
        self.section_at(mesh, table::interval_near(&mesh.s_m, s_m, node))
    }

    fn section_at(&self, mesh: &Mesh, (node, share): (usize, f64)) -> Section {
        let (inner, outer) = (self.turn(node), self.turn(node + 1));
        let (from, to) = (self.place(node), self.place(node + 1));
        // An element is an arc: it stands out beyond its chord.
        let bow = (outer - inner).column(2) * (0.5 * mesh.step_m(node) * share * (share - 1.0));
        Section {
            node,
            share,
            place: from + (to - from) * share + bow,
            turn: inner + (outer - inner) * share,
            curvature: self.before.curvature[node] * (1.0 - self.share)
                + self.after.curvature[node] * self.share,
        }
    }

    /// Way of a point of the surface from one state to the other, world, metres.
    pub fn way_m(&self, contact: &Contact) -> Vector3<f64> {
        let (section, local) = (&contact.section, &contact.local);
        let at = |axis: &Axis, node: usize| axis.place[node] + axis.turn[node] * local;
        let moved = |node: usize| at(self.after, node) - at(self.before, node);
        let (inner, outer) = (moved(section.node), moved(section.node + 1));
        inner + (outer - inner) * section.share
    }

    fn turn(&self, node: usize) -> Matrix3<f64> {
        let (a, b) = (&self.before.turn[node], &self.after.turn[node]);
        a + (b - a) * self.share
    }

    fn place(&self, node: usize) -> Vector3<f64> {
        let (a, b) = (&self.before.place[node], &self.after.place[node]);
        a + (b - a) * self.share
    }

    /// Arc length at which the blade passes nearest to a ray, by its nodes.
    pub fn nearest_s_m(&self, mesh: &Mesh, origin: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        let distance = |node: &usize| {
            let to = self.place(*node) - origin;
            (to - direction * to.dot(direction)).norm_squared()
        };
        let stride = 4;
        let coarse = (0..mesh.len())
            .step_by(stride)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let middle = coarse.unwrap_or(0);
        let near = middle.saturating_sub(stride)..(middle + stride).min(mesh.len());
        let node = near.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        mesh.s_m[node.unwrap_or(middle)]
    }

    /// Where a ray meets the surface first, searched from arc length `start_m`.
    pub fn hit(
        &self,
        mesh: &Mesh,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        start_m: f64,
    ) -> Option<Hit> {
        let (mut s_m, mut last) = (start_m, None);
        let mut node = table::interval(&mesh.s_m, s_m).0;
        for _ in 0..STEPS {
            let section = self.section_near(mesh, s_m, node);
            node = section.node;
            let from = section.turn.tr_mul(&(origin - section.place));
            let way = section.turn.tr_mul(direction);
            let line = Line {
                mesh,
                section: &section,
                from: &from,
                way: &way,
            };
            let (edge, along, range_m) = last
                .and_then(|edge| line.cross_near(edge))
                .or_else(|| line.cross())?;
            last = Some(edge);
            let ahead_m = from.z + way.z * range_m;
            if ahead_m.abs() < CONVERGED_M {
                let contact = contact(mesh, section, edge, along);
                let cosine = -contact.normal.dot(direction);
                return (cosine > 0.0).then_some(Hit {
                    contact,
                    range_m,
                    cosine,
                });
            }
            s_m += ahead_m;
            if !(0.0..=mesh.length_m()).contains(&s_m) {
                return None;
            }
        }
        None
    }
}

/// A line in the plane of a section, in its directions.
struct Line<'a> {
    mesh: &'a Mesh,
    section: &'a Section,
    from: &'a Vector3<f64>,
    way: &'a Vector3<f64>,
}

/// First point of a facet, the place on it, and the distance along a line that crosses it.
type Crossing = (usize, f64, f64);

impl Line<'_> {
    /// First facet of the outline that the line meets.
    fn cross(&self) -> Option<Crossing> {
        vectorized(Search(self))
    }

    /// The same among those beside a facet that it met a little farther along the span.
    fn cross_near(&self, edge: usize) -> Option<Crossing> {
        let count = self.mesh.outline[self.section.node].len();
        let before = if edge == 0 { count - 1 } else { edge - 1 };
        let next = after(edge, count);
        self.first([before, edge, next, after(next, count)].into_iter())
    }

    /// First facet that the line meets among those between neighbouring points.
    fn first(&self, points: impl Iterator<Item = usize>) -> Option<Crossing> {
        let way = self.way;
        let mut points = points.map(|i| (i, self.at(i)));
        let (mut index, mut last) = points.next()?;
        let mut last_side = self.side(last);
        let mut best: Option<Crossing> = None;
        for (next, point) in points {
            let this_side = self.side(point);
            if (last_side > 0.0) != (this_side > 0.0) {
                let along = last_side / (last_side - this_side);
                let x = last.0 + (point.0 - last.0) * along;
                let y = last.1 + (point.1 - last.1) * along;
                let range = (x * way.x + y * way.y) / (way.x * way.x + way.y * way.y);
                if range > 0.0 && best.is_none_or(|b| range < b.2) {
                    best = Some((index, along, range));
                }
            }
            (index, last, last_side) = (next, point, this_side);
        }
        best
    }

    /// A point of the outline from the start of the line.
    fn at(&self, i: usize) -> (f64, f64) {
        let node = self.section.node;
        self.between(&self.mesh.outline[node][i], &self.mesh.outline[node + 1][i])
    }

    /// The same by that point at both nodes.
    #[inline(always)]
    fn between(&self, a: &[f64; 2], b: &[f64; 2]) -> (f64, f64) {
        let share = self.section.share;
        (
            a[0] + (b[0] - a[0]) * share - self.from.x,
            a[1] + (b[1] - a[1]) * share - self.from.y,
        )
    }

    /// On which side of the line a point lies.
    #[inline(always)]
    fn side(&self, point: (f64, f64)) -> f64 {
        self.way.x * point.1 - self.way.y * point.0
    }

    /// Whether points, at most [`LANES`], given at both nodes, lie left of the line: a bit each.
    #[inline(always)]
    fn lies_left(&self, inner: &[[f64; 2]], outer: &[[f64; 2]]) -> u32 {
        let mut sides = [0.0; LANES];
        for ((side, a), b) in sides.iter_mut().zip(inner).zip(outer) {
            *side = self.side(self.between(a, b));
        }
        let bits = sides.iter().enumerate();
        bits.fold(0, |left, (i, side)| left | u32::from(*side > 0.0) << i)
    }
}

/// Looks for the first facet among all of them.
struct Search<'a>(&'a Line<'a>);

impl Kernel for Search<'_> {
    type Out = Option<Crossing>;

    #[inline(always)]
    fn run(self) -> Self::Out {
        let Self(line) = self;
        let node = line.section.node;
        let (inner, outer) = (&line.mesh.outline[node], &line.mesh.outline[node + 1]);
        let count = inner.len();
        let mut best: Option<Crossing> = None;
        let mut before = line.lies_left(&inner[count - 1..], &outer[count - 1..]);
        for first in (0..count).step_by(LANES) {
            let block = first..count.min(first + LANES);
            let left = line.lies_left(&inner[block.clone()], &outer[block.clone()]);
            let mut changes = (left ^ (left << 1 | before)) & ((1 << block.len()) - 1);
            before = left >> (block.len() - 1);
            while changes != 0 {
                let next = first + changes.trailing_zeros() as usize;
                let last = if next == 0 { count - 1 } else { next - 1 };
                let crossing = line.first([last, next].into_iter());
                let is_nearer = |c: &Crossing| best.is_none_or(|b| c.2 < b.2);
                best = crossing.filter(is_nearer).or(best);
                changes &= changes - 1;
            }
        }
        best
    }
}

/// The point of an outline after another one.
fn after(point: usize, count: usize) -> usize {
    if point + 1 == count { 0 } else { point + 1 }
}

/// Point of the outline at a vertex and a share of the way to the next one.
fn outline_at(mesh: &Mesh, node: usize, vertex: usize, along: f64) -> [f64; 2] {
    let outline = &mesh.outline[node];
    let (a, b) = (outline[vertex], outline[after(vertex, outline.len())]);
    [a[0] + (b[0] - a[0]) * along, a[1] + (b[1] - a[1]) * along]
}

/// Point of the outline in the section's directions, metres.
pub(super) fn local(mesh: &Mesh, section: &Section, vertex: usize, along: f64) -> Vector3<f64> {
    let inner = outline_at(mesh, section.node, vertex, along);
    let outer = outline_at(mesh, section.node + 1, vertex, along);
    let blend = |k: usize| inner[k] + (outer[k] - inner[k]) * section.share;
    Vector3::new(blend(0), blend(1), 0.0)
}

pub(super) fn contact(mesh: &Mesh, section: Section, vertex: usize, along: f64) -> Contact {
    let local = local(mesh, &section, vertex, along);
    let count = mesh.outline[0].len();
    let (x, next) = (&mesh.x_c[section.node], after(vertex, count));
    let normal = outward(mesh, &section, vertex, along, &local);
    Contact {
        section,
        local,
        point: section.place + section.turn * local,
        x_c: x[vertex] + (x[next] - x[vertex]) * along,
        vertex,
        normal: section.turn * normal,
    }
}

/// How a point of the surface moves along the span, in the section's directions.
pub(super) fn span_slope(
    mesh: &Mesh,
    section: &Section,
    vertex: usize,
    along: f64,
    local: &Vector3<f64>,
) -> Vector3<f64> {
    let inner = outline_at(mesh, section.node, vertex, along);
    let outer = outline_at(mesh, section.node + 1, vertex, along);
    let length = mesh.step_m(section.node);
    let taper = Vector3::new(
        (outer[0] - inner[0]) / length,
        (outer[1] - inner[1]) / length,
        1.0,
    );
    taper + section.curvature.cross(local)
}

fn outward(
    mesh: &Mesh,
    section: &Section,
    vertex: usize,
    along: f64,
    local: &Vector3<f64>,
) -> Vector3<f64> {
    let count = mesh.outline[0].len();
    let end = |i: usize| {
        let (a, b) = (
            mesh.outline[section.node][i],
            mesh.outline[section.node + 1][i],
        );
        [0, 1].map(|k| a[k] + (b[k] - a[k]) * section.share)
    };
    let (a, b) = (end(vertex), end(after(vertex, count)));
    let facet = Vector3::new(b[0] - a[0], b[1] - a[1], 0.0);
    let slope = span_slope(mesh, section, vertex, along, local);
    // The outline runs round the section in the sense that the hand of the blade gives it.
    (slope.cross(&facet) * mesh.hand).normalize()
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn the_facet_beside_the_last_one_is_the_one_that_a_search_of_all_finds() {
        let adjustment = sample::adjustment(0.0);
        let (mesh, posed) = (&adjustment.problem.mesh, adjustment.posed(0));
        let (blade, origin) = (posed.at(0), adjustment.rig.lidar(0).origin);
        let mut hits = 0;
        for direction in sample::directions() {
            let start_m = blade.nearest_s_m(mesh, &origin, &direction);
            let Some(hit) = blade.hit(mesh, &origin, &direction, start_m) else {
                continue;
            };
            let section = hit.contact.section;
            let line = Line {
                mesh,
                from: &section.turn.tr_mul(&(origin - section.place)),
                way: &section.turn.tr_mul(&direction),
                section: &section,
            };
            let (vertex, _, range_m) = line.cross().unwrap();
            assert_eq!(vertex, hit.contact.vertex);
            assert!((range_m - hit.range_m).abs() < 1e-9);
            hits += 1;
        }
        assert!(hits > 100, "{hits}");
    }
}
