//! Rays against the moving blade: skin, saddles and cables.
//!
//! A ray meets the blade near one arc length. There the section's outline is a polygon in a plane
//! that the ray crosses; the arc length is improved until the hit lies in that plane.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::blade::Blade;
use super::contour::CONTOUR_POINTS;
use super::rod::Node;
use super::terrain::{Hit, Ray, box_hit};

const REFLECTIVITY_BLADE: f64 = 0.7;
const REFLECTIVITY_SADDLE: f64 = 0.3;
const REFLECTIVITY_CABLE: f64 = 0.25;
/// Improvements of the arc length; each leaves a tenth of the error or less.
const ITERATIONS: usize = 5;
const CONVERGED_M: f64 = 1e-5;

/// A frame around the blade, and the cable from it.
#[derive(Debug, Clone, Copy)]
pub struct Saddle {
    /// Node that it clamps.
    pub node: usize,
    /// Middle of the frame from the axis, in the section's directions, metres.
    pub middle_m: Vector3<f64>,
    /// Half of its extents along chord, across, and along the span, metres.
    pub half_m: Vector3<f64>,
    /// Chord direction of the section, in the section's directions.
    pub chord: Vector3<f64>,
    /// Where the cable ends at the winch, world frame, metres.
    pub anchor_m: Vector3<f64>,
    /// Radius of the cable, metres; 0 = none.
    pub cable_radius_m: f64,
}

/// Skin and attachments in the section's directions; it moves with the nodes.
#[derive(Debug, Clone)]
pub struct Body {
    /// Arc lengths of the nodes, metres.
    pub arc_m: Vec<f64>,
    /// Saddles from the root to the tip.
    pub saddles: Vec<Saddle>,
    skins: Vec<[Vector2<f64>; CONTOUR_POINTS]>,
    reach_m: Vec<f64>,
}

/// The blade at one instant, between two states.
#[derive(Debug, Clone, Copy)]
pub struct Pose<'a> {
    /// The state before.
    pub before: &'a [Node],
    /// The state after.
    pub after: &'a [Node],
    /// Place between both, 0 to 1.
    pub share: f64,
}

impl Pose<'_> {
    fn axis_m(&self, node: usize) -> Vector3<f64> {
        let (a, b) = (&self.before[node].position_m, &self.after[node].position_m);
        a + (b - a) * self.share
    }

    fn rotation(&self, node: usize) -> Matrix3<f64> {
        let (a, b) = (
            self.before[node].rotation.matrix(),
            self.after[node].rotation.matrix(),
        );
        a + (b - a) * self.share // states are so close that the mean stays a rotation to 1e-7
    }
}

/// What lies in a ray's way at the blade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glance {
    /// The hit of the ray itself.
    pub hit: Option<Hit>,
    /// How far the ray passes inside (positive) or outside the outline's silhouette, metres.
    pub inside_m: f64,
    /// Range at which it passes there, metres.
    pub range_m: f64,
}

impl Body {
    /// Skin of `blade` at the nodes `arc_m`, with `saddles`.
    pub fn new(blade: &Blade, arc_m: &[f64], saddles: Vec<Saddle>) -> Self {
        let skins: Vec<_> = arc_m.iter().map(|s| blade.skin(*s)).collect();
        let reach = |skin: &[Vector2<f64>; CONTOUR_POINTS]| {
            skin.iter().map(Vector2::norm).fold(0.0, f64::max)
        };
        let mut reach_m: Vec<f64> = skins.iter().map(reach).collect();
        for saddle in &saddles {
            let size = saddle.middle_m.norm() + saddle.half_m.norm();
            for (reach, s) in reach_m.iter_mut().zip(arc_m) {
                if (s - arc_m[saddle.node]).abs() < saddle.half_m.z + 0.3 {
                    *reach = reach.max(size);
                }
            }
        }
        Self {
            arc_m: arc_m.to_vec(),
            saddles,
            skins,
            reach_m,
        }
    }

    /// A body of nothing.
    #[cfg(test)]
    pub(super) fn empty() -> Self {
        Self {
            arc_m: Vec::new(),
            saddles: Vec::new(),
            skins: Vec::new(),
            reach_m: Vec::new(),
        }
    }

    /// Greatest distance of the blade's parts from the axis at a node, metres.
    pub fn reach_m(&self, node: usize) -> f64 {
        self.reach_m[node]
    }

    /// The skin as a ray meets it; `nodes` limits the search, `margin_m` widens it.
    pub fn glance(
        &self,
        pose: &Pose<'_>,
        ray: &Ray,
        nodes: (usize, usize),
        margin_m: f64,
    ) -> Option<Glance> {
        let (node, distance_m) = closest(pose, ray, nodes);
        if distance_m > self.reach_m[node] + margin_m + 0.3 {
            return None;
        }
        let along = |node: usize| {
            let offset = (ray.origin_m - pose.axis_m(node)).dot(&ray.direction);
            let at = ray.at(-offset) - pose.axis_m(node);
            at.dot(&pose.rotation(node).column(2))
        };
        let tip_m = self.arc_m[self.arc_m.len() - 1];
        let mut s_m = (self.arc_m[node] + along(node)).min(tip_m);
        let mut found = None;
        for _ in 0..ITERATIONS {
            let (glance, ahead_m) = self.section(pose, ray, s_m)?;
            found = Some(glance);
            let next_m = (s_m + ahead_m).min(tip_m);
            if (next_m - s_m).abs() < CONVERGED_M {
                break;
            }
            s_m = next_m;
        }
        found
    }

    /// Ray and outline in the plane of the section at `s_m`, and how far ahead of that plane the
    /// ray is where it hits or passes.
    fn section(&self, pose: &Pose<'_>, ray: &Ray, s_m: f64) -> Option<(Glance, f64)> {
        let last = self.arc_m.len() - 2;
        let tip_m = self.arc_m[last + 1];
        if s_m < 0.0 {
            return None;
        }
        let j = self
            .arc_m
            .partition_point(|s| *s <= s_m)
            .saturating_sub(1)
            .min(last);
        let share = ((s_m - self.arc_m[j]) / (self.arc_m[j + 1] - self.arc_m[j])).min(1.0);
        let blend = |a: Vector3<f64>, b: Vector3<f64>| a + (b - a) * share;
        let (turn_a, turn_b) = (pose.rotation(j), pose.rotation(j + 1));
        let rotation = turn_a + (turn_b - turn_a) * share;
        let length_m = self.arc_m[j + 1] - self.arc_m[j];
        let (start, end) = (pose.axis_m(j), pose.axis_m(j + 1));
        // An arc rises above its chord by the turn times the length over eight; a parabola does.
        let bow = (turn_b - turn_a).column(2) * (0.5 * length_m * share * (share - 1.0));
        let axis_m = blend(start, end) + bow;
        let origin = rotation.tr_mul(&(ray.origin_m - axis_m));
        let direction = rotation.tr_mul(&ray.direction);
        let outline = Outline::cut(
            &self.skins[j],
            &self.skins[j + 1],
            share,
            &origin,
            &direction,
        )?;
        let ahead_m = origin.z + direction.z * outline.range_m;
        let beyond_tip_m = s_m + ahead_m - tip_m;
        let inside_m = outline.inside_m.min(-beyond_tip_m);
        let hit = (outline.hit && beyond_tip_m <= 0.0).then_some(Hit {
            range_m: outline.range_m,
            cos_incidence: outline.cosine,
            reflectivity: REFLECTIVITY_BLADE,
        });
        let glance = Glance {
            hit,
            inside_m,
            range_m: outline.range_m,
        };
        Some((glance, ahead_m))
    }

    /// The nearest saddle or cable in a ray's way; the beam is `radius_m` wide per metre of range.
    pub fn attachments(&self, pose: &Pose<'_>, ray: &Ray, beam_rad: f64) -> Option<Hit> {
        let hits = self.saddles.iter().map(|saddle| {
            let axis_m = pose.axis_m(saddle.node);
            // Neither frame nor cable reaches far along the span.
            let along = (axis_m.z - ray.origin_m.z).abs() - 2.0;
            if along > 60.0 * ray.direction.z.abs() {
                return None;
            }
            let rotation = pose.rotation(saddle.node);
            let frame = saddle.frame_hit(&axis_m, &rotation, ray);
            Hit::nearer(frame, saddle.cable_hit(&axis_m, &rotation, ray, beam_rad))
        });
        hits.fold(None, Hit::nearer)
    }
}

impl Saddle {
    fn frame_hit(&self, axis_m: &Vector3<f64>, turn: &Matrix3<f64>, ray: &Ray) -> Option<Hit> {
        let across = Vector3::z().cross(&self.chord);
        let own = turn * Matrix3::from_columns(&[self.chord, across, Vector3::z()]);
        let origin = own.tr_mul(&(ray.origin_m - axis_m - turn * self.middle_m));
        let hit = box_hit(&origin, &own.tr_mul(&ray.direction), &self.half_m);
        hit.map(|(range_m, cos_incidence)| Hit {
            range_m,
            cos_incidence,
            reflectivity: REFLECTIVITY_SADDLE,
        })
    }

    fn cable_hit(
        &self,
        axis_m: &Vector3<f64>,
        turn: &Matrix3<f64>,
        ray: &Ray,
        beam_rad: f64,
    ) -> Option<Hit> {
        if self.cable_radius_m <= 0.0 {
            return None;
        }
        let start = axis_m + turn * self.middle_m;
        let cable = self.anchor_m - start;
        let normal = ray.direction.cross(&cable);
        let apart_m = (start - ray.origin_m).dot(&normal).abs() / normal.norm();
        let between = start - ray.origin_m;
        let range_m = between.cross(&cable).dot(&normal) / normal.norm_squared();
        let along = between.cross(&ray.direction).dot(&normal) / normal.norm_squared();
        let near = self.cable_radius_m + 0.3 * beam_rad * range_m;
        let met = apart_m < near && range_m > 0.5 && (0.0..1.0).contains(&along);
        met.then_some(Hit {
            range_m,
            cos_incidence: (1.0 - (apart_m / near).powi(2)).sqrt(),
            reflectivity: REFLECTIVITY_CABLE,
        })
    }
}

/// The node among `nodes` whose axis is nearest to a ray, and how near.
fn closest(pose: &Pose<'_>, ray: &Ray, (first, last): (usize, usize)) -> (usize, f64) {
    let distance = |node: usize| {
        let between = pose.axis_m(node) - ray.origin_m;
        (between - ray.direction * between.dot(&ray.direction)).norm_squared()
    };
    let mut best = (first, f64::INFINITY);
    let look = |node: usize, best: &mut (usize, f64)| {
        let found = distance(node);
        if found < best.1 {
            *best = (node, found);
        }
    };
    let stride = 8;
    (first..=last)
        .step_by(stride)
        .for_each(|node| look(node, &mut best));
    let around = best.0;
    let (low, high) = (
        around.saturating_sub(stride).max(first),
        (around + stride).min(last),
    );
    (low..=high).for_each(|node| look(node, &mut best));
    (best.0, best.1.sqrt())
}

/// A line against a polygon, both in the plane of a section.
struct Outline {
    hit: bool,
    range_m: f64,
    inside_m: f64,
    cosine: f64,
}

impl Outline {
    /// `None` where the ray runs along the span.
    fn cut(
        inner: &[Vector2<f64>; CONTOUR_POINTS],
        outer: &[Vector2<f64>; CONTOUR_POINTS],
        share: f64,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<Self> {
        let flat = direction.xy().norm();
        if flat < 0.2 {
            return None;
        }
        let (o, d) = (origin.xy(), direction.xy());
        let normal = Vector2::new(-d.y, d.x) / flat;
        let level = normal.dot(&o);
        let mut points = [Vector2::zeros(); CONTOUR_POINTS];
        let mut offsets = [0.0; CONTOUR_POINTS];
        for (i, point) in points.iter_mut().enumerate() {
            *point = inner[i] + (outer[i] - inner[i]) * share;
            offsets[i] = normal.dot(point) - level;
        }
        let (mut low, mut high) = ((0, f64::INFINITY), (0, f64::NEG_INFINITY));
        let mut nearest: Option<(f64, usize)> = None;
        for (i, &offset) in offsets.iter().enumerate() {
            low = if offset < low.1 { (i, offset) } else { low };
            high = if offset > high.1 { (i, offset) } else { high };
            let next = (i + 1) % CONTOUR_POINTS;
            if (offset < 0.0) != (offsets[next] < 0.0) {
                let t = offset / (offset - offsets[next]);
                let along =
                    (points[i] + (points[next] - points[i]) * t - o).dot(&d) / (flat * flat);
                if nearest.is_none_or(|(range, _)| along < range) {
                    nearest = Some((along, i));
                }
            }
        }
        let inside_m = high.1.min(-low.1);
        let Some((range_m, i)) = nearest else {
            let edge = if high.1 < 0.0 { high.0 } else { low.0 };
            return Some(Self {
                hit: false,
                range_m: (points[edge] - o).dot(&d) / (flat * flat),
                inside_m,
                cosine: 0.0,
            });
        };
        let facet = points[(i + 1) % CONTOUR_POINTS] - points[i];
        Some(Self {
            hit: range_m > 0.0,
            range_m,
            inside_m,
            cosine: (facet.x * d.y - facet.y * d.x).abs() / facet.norm().max(1e-12),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::blade::{BuildErrors, Orientation};
    use super::super::reference::Stations;
    use super::*;
    use nalgebra::Rotation3;

    /// A straight cylinder of radius 1 m, 20 m long along z.
    fn cylinder() -> (Body, Vec<Node>) {
        let mut nominal = Stations::reference("iea15-110m", None).unwrap();
        let rows = nominal.s_m.len();
        nominal.chord_m = vec![2.0; rows];
        nominal.rel_thickness = vec![1.0; rows];
        nominal.axis_fraction = vec![0.5; rows];
        let orientation = Orientation {
            leading_edge: -Vector3::x(),
            suction_side: Vector3::y(),
        };
        let blade = Blade::build(nominal, &orientation, &BuildErrors::default(), 1).unwrap();
        let arc_m: Vec<f64> = (0..=80).map(|i| f64::from(i) * 0.25).collect();
        let nodes = arc_m
            .iter()
            .map(|s| Node {
                rotation: Rotation3::identity(),
                position_m: Vector3::z() * *s,
            })
            .collect();
        (Body::new(&blade, &arc_m, Vec::new()), nodes)
    }

    #[test]
    fn a_cylinder_is_met_where_algebra_says() {
        let (body, nodes) = cylinder();
        let pose = Pose {
            before: &nodes,
            after: &nodes,
            share: 0.3,
        };
        for (x, rise) in [(0.0, 0.0), (0.5, 0.1), (-0.9, -0.25), (0.7, 0.0)] {
            let direction = Vector3::new(0.0, 1.0, rise).normalize();
            let ray = Ray {
                origin_m: Vector3::new(x, -10.0, 10.0),
                direction,
            };
            let glance = body.glance(&pose, &ray, (0, 80), 0.0).unwrap();
            let truth = (10.0 - (1.0 - x * x).sqrt()) / direction.y;
            // Eighty facets lie up to 0.8 mm inside the circle, more along a slanting ray.
            let found = glance.hit.unwrap().range_m;
            assert!((found - truth).abs() < 3e-3, "{x} {rise}: {found} {truth}");
            assert!((glance.inside_m - (1.0 - x.abs())).abs() < 2e-3);
        }
    }

    #[test]
    fn the_tip_ends() {
        let (body, nodes) = cylinder();
        let pose = Pose {
            before: &nodes,
            after: &nodes,
            share: 0.0,
        };
        let ray = |z: f64| Ray {
            origin_m: Vector3::new(0.0, -10.0, z),
            direction: Vector3::y(),
        };
        let glance = |z| body.glance(&pose, &ray(z), (0, 80), 0.0);
        assert!(glance(19.99).unwrap().hit.is_some());
        let beyond = glance(20.02).unwrap();
        assert!(beyond.hit.is_none() && (beyond.inside_m + 0.02).abs() < 1e-9);
    }
}
