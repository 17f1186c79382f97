//! The blade as built: the drawing with what the unknowns of the surface add to it.
//!
//! Chord and contour of a blade without a drawing differ from their start by decimetres, far beyond what
//! slopes can tell; so the adjustment moves the surface itself and takes its slopes there.

use nalgebra::{Rotation2, Vector2, Vector3};

use super::forms::forms;
use super::{CHORD_WAVES, Knots, Shape, hats, heights};
use crate::beam::mesh::Mesh;

/// What the unknowns add at one arc length.
struct Change<'a> {
    scale: f64,
    turn: Rotation2<f64>,
    shift_m: Vector2<f64>,
    /// Values of forms and waves at the knots beside the node, and their size, metres.
    forms: Vec<(&'a [f64], f64)>,
    waves: Vec<(&'a [f64], f64)>,
}

impl Shape {
    /// The blade that `values` of all unknowns of the surface, in standard deviations, make of a drawing.
    pub fn built(&self, drawn: &Mesh, values: &[f64]) -> Mesh {
        let mut mesh = drawn.clone();
        for node in 0..drawn.len() {
            let change = self.change(drawn, values, node);
            let raised = raised(drawn, node, &change);
            mesh.outline[node] = raised.iter().map(|p| change.carry(p).into()).collect();
            mesh.middle[node] = lifted(&change.carry(&drawn.middle[node].xy()));
            mesh.chord[node] = lifted(&(change.turn * drawn.chord[node].xy()));
            mesh.chord_m[node] *= change.scale;
        }
        mesh
    }

    fn change<'a>(&self, drawn: &Mesh, values: &'a [f64], node: usize) -> Change<'a> {
        let (trust, x) = (&self.trust, drawn.s_m[node] - self.from_m);
        let slow = hats(x, self.trust.slow_knot_m, self.slow);
        let twist: f64 = slow
            .map(|(k, w)| w * values[3 + self.slow + k])
            .iter()
            .sum();
        let twist = trust.setting_rad * values[1] + trust.twist_waves_rad * twist;
        let swell: f64 = slow
            .map(|(k, w)| w * self.chord_wave(k) * values[3 + k])
            .iter()
            .sum();
        let chord = drawn.chord[node].xy() * drawn.chord_m[node];
        let at = |knots: &Knots, size_m: f64| {
            let beside = knots.beside(x);
            beside
                .map(|(place, share)| (&values[place..][..knots.each], share * size_m))
                .collect()
        };
        Change {
            scale: (trust.chord * values[0] + swell).exp(),
            turn: Rotation2::new(drawn.hand * twist),
            shift_m: chord * (-trust.axis_fraction * values[2]),
            forms: at(&self.forms, self.form_m(drawn, node)),
            waves: at(&self.waves, self.waves_m(drawn, node)),
        }
    }
}

impl Change<'_> {
    fn carry(&self, point: &Vector2<f64>) -> Vector2<f64> {
        self.turn * point * self.scale + self.shift_m
    }

    /// How far a side stands out at a place along the chord, metres.
    fn height_m(&self, is_second: bool, x_c: f64) -> f64 {
        let side = usize::from(is_second) * CHORD_WAVES;
        sum(&self.forms, 0, &forms(x_c, is_second)) + sum(&self.waves, side, &heights(x_c))
    }
}

/// Heights times their values, from an offset in each knot.
fn sum(knots: &[(&[f64], f64)], offset: usize, heights: &[f64]) -> f64 {
    let of = |(values, size_m): &(&[f64], f64)| -> f64 {
        let pairs = values[offset..].iter().zip(heights);
        size_m * pairs.map(|(value, height)| value * height).sum::<f64>()
    };
    knots.iter().map(of).sum()
}

/// Outline of a node with its waves: each point follows the two facets that meet in it.
fn raised(drawn: &Mesh, node: usize, change: &Change) -> Vec<Vector2<f64>> {
    let (outline, x_c) = (&drawn.outline[node], &drawn.x_c[node]);
    let count = outline.len();
    let point = |i: usize| Vector2::from(outline[i % count]);
    let lift = |facet: usize, at: usize| {
        let along = point(facet + 1) - point(facet);
        let outward = Vector2::new(-along.y, along.x) * drawn.hand;
        let height_m = change.height_m(drawn.is_second_side(facet), x_c[at]);
        outward.try_normalize(1e-12).unwrap_or_default() * height_m
    };
    (0..count)
        .map(|i| point(i) + 0.5 * (lift((i + count - 1) % count, i) + lift(i, i)))
        .collect()
}

fn lifted(point: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(point.x, point.y, 0.0)
}
