//! The silhouette of the blade in a scan plane: where a scan line passes its edge, and how firm that edge is.

use nalgebra::{Matrix3, Vector3};

use super::mesh::Mesh;
use super::sight::{Contact, Instant, Section, contact, local, span_slope};
use super::table;
use crate::simd::{Kernel, vectorized};

/// Improvements of the arc length at which a scan plane meets the axis: at most so many, ...
const STEPS: usize = 6;
/// ... as none that is smaller moves the silhouette, which is improved by itself, metres.
const SMALLEST_M: f64 = 1e-10;
/// Points of the outline that are seen at once.
const LANES: usize = 8;
/// Facets seen at a flatter angle than this lose their echoes, cosine of incidence.
const GRAZING_COSINE: f64 = 0.17;

/// The silhouette of the blade in a scan plane, on one side.
#[derive(Debug, Clone, Copy)]
pub struct Silhouette {
    /// Its point.
    pub contact: Contact,
    /// Angle from the plane's first direction, rad.
    pub angle_rad: f64,
    /// Distance from the origin of the scan plane, metres.
    pub range_m: f64,
    /// Width of the strip beside it that is seen at a grazing angle, metres across the view.
    pub soft_m: f64,
    /// Cosine of incidence on the strip beside it: a blade seen edge-on has no edge that echoes tell.
    pub cosine: f64,
    /// World direction of the silhouette along the span, per metre of arc length.
    pub slope: Vector3<f64>,
}

/// A plane that a scan line sweeps.
#[derive(Debug, Clone, Copy)]
pub struct ScanPlane {
    /// Optical centre, world, metres.
    pub origin: Vector3<f64>,
    /// Direction of angle zero.
    pub ahead: Vector3<f64>,
    /// Direction of a quarter turn, away from the blade.
    pub aside: Vector3<f64>,
}

impl Instant<'_> {
    /// The outermost point of the blade in a scan plane, searched from arc length `start_m`.
    pub fn silhouette(&self, mesh: &Mesh, plane: &ScanPlane, start_m: f64) -> Option<Silhouette> {
        let across = plane.ahead.cross(&plane.aside);
        let (mut s_m, mut node) = (start_m, table::interval(&mesh.s_m, start_m).0);
        for _ in 0..STEPS {
            let section = self.section_near(mesh, s_m, node);
            node = section.node;
            let off = across.dot(&(section.place - plane.origin));
            let step_m = off / across.dot(&section.turn.column(2));
            s_m -= step_m;
            if step_m.abs() < SMALLEST_M {
                break;
            }
        }
        if !(0.0..=mesh.length_m()).contains(&s_m) {
            return None;
        }
        let count = mesh.outline[0].len();
        let cut = Cut::new(mesh, plane, self.section_near(mesh, s_m, node), s_m);
        let views = vectorized(Views(&cut));
        let widths: Vec<f64> = views.iter().map(View::width).collect();
        let outermost = (0..count).max_by(|a, b| widths[*a].total_cmp(&widths[*b]))?;
        let near = [count - 1, 0, 1].map(|step| (outermost + step) % count);
        let refined = near.map(|vertex| {
            let view = self.refine(&cut, plane, vertex, views[vertex].s_m);
            (vertex, view)
        });
        let best = refined
            .iter()
            .max_by(|a, b| a.1.width().total_cmp(&b.1.width()))?;
        if !(0.0..=mesh.length_m()).contains(&best.1.s_m) {
            return None;
        }
        let section = self.section_near(mesh, best.1.s_m, node);
        let contact = contact(mesh, section, best.0, 0.0);
        let step = if is_seen_ahead(&views, best.0) {
            1
        } else {
            count - 1
        };
        Some(Silhouette {
            contact,
            angle_rad: best.1.aside_m.atan2(best.1.ahead_m),
            range_m: (contact.point - plane.origin).norm(),
            soft_m: softness_m(&views, best.0, step),
            cosine: steepness(&views, best.0, step),
            slope: section.turn * span_slope(mesh, &section, best.0, 0.0, &contact.local),
        })
    }

    fn refine(&self, near: &Cut, plane: &ScanPlane, vertex: usize, s_m: f64) -> View {
        let section = |s_m| self.section_near(near.mesh, s_m, near.section.node);
        let view = |s_m| Cut::new(near.mesh, plane, section(s_m), s_m).view(vertex);
        view(view(s_m).s_m)
    }
}

/// A scan plane in the directions of a section.
struct Cut<'a> {
    mesh: &'a Mesh,
    section: Section,
    s_m: f64,
    /// Across the plane, ahead and aside in it: a line each.
    axes: Matrix3<f64>,
    /// The section's place along these from the plane's origin, metres.
    place: Vector3<f64>,
}

impl<'a> Cut<'a> {
    fn new(mesh: &'a Mesh, plane: &ScanPlane, section: Section, s_m: f64) -> Self {
        let across = plane.ahead.cross(&plane.aside);
        let axes = Matrix3::from_columns(&[across, plane.ahead, plane.aside]).transpose();
        Self {
            mesh,
            s_m,
            place: axes * (section.place - plane.origin),
            axes: axes * section.turn,
            section,
        }
    }

    /// Where a point of the outline passes through the plane, by its slope in the section.
    fn view(&self, vertex: usize) -> View {
        let local = local(self.mesh, &self.section, vertex, 0.0);
        let slope = self.axes * span_slope(self.mesh, &self.section, vertex, 0.0, &local);
        let point = self.place + self.axes * local;
        let step = -point.x / slope.x;
        View {
            s_m: self.s_m + step,
            ahead_m: point.y + slope.y * step,
            aside_m: point.z + slope.z * step,
        }
    }
}

/// Looks at all points of the outline.
struct Views<'a>(&'a Cut<'a>);

impl Kernel for Views<'_> {
    type Out = Vec<View>;

    #[inline(always)]
    fn run(self) -> Vec<View> {
        let Self(cut) = self;
        let node = cut.section.node;
        let (inner, outer) = (&cut.mesh.outline[node], &cut.mesh.outline[node + 1]);
        let mut views = Vec::with_capacity(inner.len());
        let mut ends = [[0.0; LANES]; 4];
        for (a, b) in inner.chunks(LANES).zip(outer.chunks(LANES)) {
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                (ends[0][i], ends[1][i], ends[2][i], ends[3][i]) = (a[0], a[1], b[0], b[1]);
            }
            let block = cut.block(&ends).into_iter();
            views.extend(block.take(a.len()));
        }
        views
    }
}

impl Cut<'_> {
    /// The same as [`Cut::view`] of points side by side: x and y at the inner node and at the outer one.
    #[inline(always)]
    fn block(&self, ends: &[[f64; LANES]; 4]) -> [View; LANES] {
        let length = self.mesh.step_m(self.section.node);
        let (share, axes, bend) = (self.section.share, &self.axes, &self.section.curvature);
        let mut parts = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let (wide, high) = (ends[2][i] - ends[0][i], ends[3][i] - ends[1][i]);
            let (x, y) = (ends[0][i] + wide * share, ends[1][i] + high * share);
            let (u, v) = (wide / length - bend.z * y, high / length + bend.z * x);
            let w = 1.0 + (bend.x * y - bend.y * x);
            let point = |k: usize| self.place[k] + (axes[(k, 0)] * x + axes[(k, 1)] * y);
            let slope = |k: usize| axes[(k, 0)] * u + axes[(k, 1)] * v + axes[(k, 2)] * w;
            let step = -point(0) / slope(0);
            parts[0][i] = self.s_m + step;
            parts[1][i] = point(1) + slope(1) * step;
            parts[2][i] = point(2) + slope(2) * step;
        }
        std::array::from_fn(|i| View {
            s_m: parts[0][i],
            ahead_m: parts[1][i],
            aside_m: parts[2][i],
        })
    }
}

/// A point of the outline as a scan plane sees it.
#[derive(Debug, Clone, Copy)]
struct View {
    s_m: f64,
    ahead_m: f64,
    aside_m: f64,
}

impl View {
    /// Tangent of the angle from ahead; the blade is in front of the sensor.
    fn width(&self) -> f64 {
        self.aside_m / self.ahead_m
    }
}

/// Cosine of incidence on the strip beside the silhouette, on the side that is seen.
fn steepness(views: &[View], outermost: usize, step: usize) -> f64 {
    const STRIP_M: f64 = 0.05;
    let count = views.len();
    let inward = (1..count / 2).map(|k| views[(outermost + k * step) % count]);
    let from = views[outermost];
    let cosine = |to: View| {
        let wide = from.aside_m - to.aside_m;
        (wide, wide / wide.hypot(from.ahead_m - to.ahead_m).max(1e-9))
    };
    let mut strip = inward.map(cosine).skip_while(|found| found.0 < STRIP_M);
    strip.next().map_or(0.0, |found| found.1)
}

/// Width across the view of the facets beside the silhouette that are seen at a grazing angle.
fn softness_m(views: &[View], outermost: usize, step: usize) -> f64 {
    let count = views.len();
    let mut width_m = 0.0;
    let mut a = outermost;
    for _ in 0..count / 2 {
        let b = (a + step) % count;
        let deep = views[a].ahead_m - views[b].ahead_m;
        let wide = views[a].aside_m - views[b].aside_m;
        if wide < 0.0 || wide > GRAZING_COSINE * deep.hypot(wide) {
            break;
        }
        width_m += wide;
        a = b;
    }
    width_m
}

/// Whether the side of the outline after its outermost point is the one that faces the sensor: the
/// nearer one of the two where both are a little farther in.
fn is_seen_ahead(views: &[View], outermost: usize) -> bool {
    const INWARD_M: f64 = 0.02;
    let count = views.len();
    let depth = |step: usize| {
        let mut at = outermost;
        for _ in 0..count / 2 {
            at = (at + step) % count;
            if views[at].aside_m < views[outermost].aside_m - INWARD_M {
                break;
            }
        }
        views[at].ahead_m
    };
    depth(1) < depth(count - 1)
}
