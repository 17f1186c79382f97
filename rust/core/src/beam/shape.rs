//! The surface as built: chord, setting angle and waves against the drawing.

mod bends;
mod built;
mod forms;

use std::f64::consts::PI;

use self::forms::{FORMS, forms};
use super::mesh::Mesh;
use super::pairs::Knotted;
use super::sight::Contact;
use super::table;
use nalgebra::Vector3;

/// How well the surface is known beforehand, standard deviations.
#[derive(Debug, Clone, Copy)]
pub struct ShapeTrust {
    /// Of the chord as a whole, relative.
    pub chord: f64,
    /// Of the chord as it varies along the span, relative.
    pub chord_waves: f64,
    /// The same at the tip, where blades differ most, over that.
    pub tip: f64,
    /// Of the setting angle, rad.
    pub setting_rad: f64,
    /// Of the twist as it varies along the span, rad.
    pub twist_waves_rad: f64,
    /// Of second differences of the knots of chord and twist, over the two above; 0 where knots are independent, as
    /// with a drawing.
    pub bend: f64,
    /// Of the axis within the chord, chord lengths.
    pub axis_fraction: f64,
    /// Of each way in which contours of blades differ, as a share of what is usual; none
    /// where a drawing tells the contour.
    pub form: f64,
    /// Of each wave of the surface, metres.
    pub waves_m: f64,
    /// Distance between the knots of chord and twist, metres.
    pub slow_knot_m: f64,
    /// Distance between those of the waves, metres: what shorter waves leave over pulls the blade along
    /// itself, and what is not known to decimetres cannot bear more of them.
    pub wave_knot_m: f64,
}

impl Default for ShapeTrust {
    /// A blade built after a drawing.
    fn default() -> Self {
        Self {
            chord: 0.004,
            chord_waves: 0.001,
            tip: 1.0,
            setting_rad: 0.3f64.to_radians(),
            twist_waves_rad: 0.0005,
            bend: 0.0,
            axis_fraction: 0.002,
            form: 0.0,
            waves_m: 0.002,
            slow_knot_m: 9.0,
            wave_knot_m: 1.0,
        }
    }
}

/// Waves over the chord of each side.
const CHORD_WAVES: usize = 6;
/// Share of the chord beside an edge over which waves rise to their height.
const NEAR_EDGE: f64 = 0.04;
/// Chord from which on waves have their full height, metres.
const FULL_WAVES_M: f64 = 1.0;

/// Unknowns of the surface, in standard deviations.
#[derive(Debug, Clone)]
pub struct Shape {
    trust: ShapeTrust,
    from_m: f64,
    slow: usize,
    forms: Knots,
    waves: Knots,
}

/// Unknowns by knots along the span, so many in each.
#[derive(Debug, Clone)]
struct Knots {
    first: usize,
    count: usize,
    apart_m: f64,
    each: usize,
}

impl Knots {
    /// As many as a length needs, from an unknown on.
    fn over(length_m: f64, apart_m: f64, each: usize, first: usize) -> Self {
        Self {
            first,
            count: (length_m / apart_m).ceil() as usize + 1,
            apart_m,
            each,
        }
    }

    fn end(&self) -> usize {
        self.first + self.count * self.each
    }

    /// First unknown and share of both knots beside a place outboard of the first.
    fn beside(&self, x_m: f64) -> impl Iterator<Item = (usize, f64)> {
        let (first, each) = (self.first, self.each);
        let two = hats(x_m, self.apart_m, self.count);
        two.into_iter()
            .filter(|_| self.count > 0)
            .map(move |(knot, share)| (first + knot * each, share))
    }
}

impl Shape {
    /// Of the blade outboard of `from_m`; inboard of it nothing is seen.
    pub fn new(mesh: &Mesh, trust: ShapeTrust, from_m: f64) -> Self {
        let length = (mesh.length_m() - from_m).max(trust.wave_knot_m);
        let slow = (length / trust.slow_knot_m).ceil() as usize + 1;
        let mut forms = Knots::over(length, forms::KNOT_M, FORMS, 3 + 2 * slow);
        if trust.form == 0.0 {
            forms.count = 0;
        }
        Self {
            trust,
            from_m,
            slow,
            waves: Knots::over(length, trust.wave_knot_m, 2 * CHORD_WAVES, forms.end()),
            forms,
        }
    }

    /// Number of unknowns: chord, setting, axis, chord and twist by slow knots, contour, waves.
    pub fn len(&self) -> usize {
        self.waves.end()
    }

    /// Number of the first wave.
    pub fn waves_from(&self) -> usize {
        self.waves.first
    }

    /// The waves, where the surface's unknowns begin with `first`.
    pub fn wave_knots(&self, first: usize) -> Knotted {
        Knotted {
            all: first + self.waves.first..first + self.waves.end(),
            each: self.waves.each,
        }
    }

    /// Whether there is none: never.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// How far each unknown moves a point of the surface along `along` (world, any length), appended
    /// with its number from `first`.
    pub fn slopes(
        &self,
        mesh: &Mesh,
        contact: &Contact,
        along: &Vector3<f64>,
        first: usize,
        out: &mut Vec<(usize, f64)>,
    ) {
        let local = contact.section.turn.tr_mul(along);
        let swell = local.dot(&contact.local);
        let twist = mesh.hand * (local.y * contact.local.x - local.x * contact.local.y);
        let chord = mesh.chord[contact.section.node] * mesh.chord_m[contact.section.node];
        out.push((first, self.trust.chord * swell));
        out.push((first + 1, self.trust.setting_rad * twist));
        out.push((first + 2, -self.trust.axis_fraction * local.dot(&chord)));
        let s_m = self.arc_m(mesh, contact);
        let slow = hats(s_m - self.from_m, self.trust.slow_knot_m, self.slow);
        let first = first + 3;
        out.extend(slow.map(|(knot, share)| (first + knot, self.chord_wave(knot) * share * swell)));
        let first = first + self.slow;
        let twist = self.trust.twist_waves_rad * twist;
        out.extend(slow.map(|(knot, share)| (first + knot, share * twist)));
    }

    /// The same for the waves, which stand out along the normal.
    pub fn waves(
        &self,
        mesh: &Mesh,
        contact: &Contact,
        along: &Vector3<f64>,
        first: usize,
        out: &mut Vec<(usize, f64)>,
    ) {
        let outward = along.dot(&contact.normal);
        let x_m = self.arc_m(mesh, contact) - self.from_m;
        let node = contact.section.node;
        let is_second = mesh.is_second_side(contact.vertex);
        let mut add = |knots: &Knots, offset: usize, size_m: f64, heights: &[f64]| {
            if heights.iter().all(|height| *height == 0.0) {
                return; // an edge, where no wave stands
            }
            for (place, share) in knots.beside(x_m) {
                let slope = outward * size_m * share;
                let each = heights.iter().enumerate();
                out.extend(each.map(|(k, height)| (first + place + offset + k, slope * height)));
            }
        };
        let (form_m, wave_m) = (self.form_m(mesh, node), self.waves_m(mesh, node));
        if self.forms.count > 0 {
            add(&self.forms, 0, form_m, &forms(contact.x_c, is_second));
        }
        let side = usize::from(is_second) * CHORD_WAVES;
        add(&self.waves, side, wave_m, &heights(contact.x_c));
    }

    /// Relative standard deviation of the chord at a knot.
    fn chord_wave(&self, knot: usize) -> f64 {
        let is_tip = knot + 2 >= self.slow;
        self.trust.chord_waves * if is_tip { self.trust.tip } else { 1.0 }
    }

    /// Size of the forms at a node, metres.
    fn form_m(&self, mesh: &Mesh, node: usize) -> f64 {
        self.trust.form * mesh.chord_m[node]
    }

    /// Standard deviation of a wave at a node: a chord of centimetres has none of millimetres.
    fn waves_m(&self, mesh: &Mesh, node: usize) -> f64 {
        self.trust.waves_m * (mesh.chord_m[node] / FULL_WAVES_M).min(1.0)
    }

    fn arc_m(&self, mesh: &Mesh, contact: &Contact) -> f64 {
        let section = &contact.section;
        mesh.s_m[section.node] + section.share * mesh.step_m(section.node)
    }
}

/// Heights of the waves at a place along the chord: none at both edges, which chord and axis place.
fn heights(x_c: f64) -> [f64; CHORD_WAVES] {
    let nose = (x_c / NEAR_EDGE).clamp(0.0, 1.0).sqrt();
    let tail = ((1.0 - x_c) / NEAR_EDGE).clamp(0.0, 1.0);
    // cos(k t) by the two before it.
    let turn = (PI * x_c).cos();
    let (mut last, mut now) = (turn, 1.0);
    std::array::from_fn(|_| {
        let height = nose * tail * now;
        (last, now) = (now, 2.0 * turn * now - last);
        height
    })
}

/// Two hat functions that are not zero at `x`, and their values; constant beyond the ends.
fn hats(x: f64, knot_m: f64, count: usize) -> [(usize, f64); 2] {
    let knots = count.max(2) - 1;
    let place = (x / knot_m).clamp(0.0, knots as f64);
    let first = (place.floor() as usize).min(knots - 1);
    let share = place - first as f64;
    [(first, 1.0 - share), (first + 1, share)]
}

/// Cubic B-splines with even knots: the four that are not zero, and their values.
pub fn splines(x: f64, count: usize) -> (usize, [f64; 4]) {
    let place = x.clamp(0.0, (count - 3) as f64);
    let first = (place.floor() as usize).min(count - 4);
    let t = place - first as f64;
    let r = 1.0 - t;
    let values = [
        r * r * r / 6.0,
        (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
        (3.0 * r * r * r - 6.0 * r * r + 4.0) / 6.0,
        t * t * t / 6.0,
    ];
    (first, values)
}

/// A value of a table at a contact's arc length.
pub fn at_arc(mesh: &Mesh, values: &[f64], s_m: f64) -> f64 {
    table::linear(&mesh.s_m, values, s_m)
}
