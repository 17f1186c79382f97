//! The blade as built: the drawing with what the unknowns of the surface add to it.
//!
//! Chord and contour of a blade without a drawing differ from their start by decimetres, far beyond what
//! slopes can tell; so the adjustment moves the surface itself and takes its slopes there.

use nalgebra::{Rotation2, Vector2, Vector3};

use super::{CHORD_WAVES, Shape, hats};
use crate::beam::mesh::Mesh;

/// What the unknowns add at one arc length.
struct Change<'a> {
    scale: f64,
    turn: Rotation2<f64>,
    shift_m: Vector2<f64>,
    waves: [(&'a [f64], f64); 4],
    waves_m: f64,
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
        let sum = |first: usize| -> f64 { slow.map(|(k, w)| w * values[first + k]).iter().sum() };
        let twist = trust.setting_rad * values[1] + trust.twist_waves_rad * sum(3 + self.slow);
        let chord = drawn.chord[node].xy() * drawn.chord_m[node];
        let waves = &values[3 + 2 * self.slow..];
        let side = CHORD_WAVES * self.knots;
        let [one, two] = hats(x, trust.wave_knot_m, self.knots);
        let at = |side_of: usize, (knot, weight): (usize, f64)| {
            let first = side_of * side + knot * CHORD_WAVES;
            (&waves[first..][..CHORD_WAVES], weight)
        };
        Change {
            scale: (trust.chord * values[0] + trust.chord_waves * sum(3)).exp(),
            turn: Rotation2::new(drawn.hand * twist),
            shift_m: chord * (-trust.axis_fraction * values[2]),
            waves: [at(0, one), at(0, two), at(1, one), at(1, two)],
            waves_m: self.waves_m(drawn, node),
        }
    }
}

impl Change<'_> {
    fn carry(&self, point: &Vector2<f64>) -> Vector2<f64> {
        self.turn * point * self.scale + self.shift_m
    }

    /// How far a side stands out at a place along the chord, metres.
    fn height_m(&self, side: usize, x_c: f64) -> f64 {
        let heights = super::heights(x_c);
        let of = |(values, weight): &(&[f64], f64)| -> f64 {
            let waves = values.iter().zip(&heights);
            weight * waves.map(|(value, height)| value * height).sum::<f64>()
        };
        self.waves_m * self.waves[2 * side..][..2].iter().map(of).sum::<f64>()
    }
}

/// Outline of a node with its waves: each point follows the two facets that meet in it.
fn raised(drawn: &Mesh, node: usize, change: &Change) -> Vec<Vector2<f64>> {
    let (outline, x_c) = (&drawn.outline[node], &drawn.x_c[node]);
    let count = outline.len();
    let point = |i: usize| Vector2::from(outline[i % count]);
    let lift = |facet: usize, at: usize| {
        let along = point(facet + 1) - point(facet);
        let outward = Vector2::new(-along.y, along.x) * drawn.hand;
        let side = usize::from(drawn.is_second_side(facet));
        let height_m = change.height_m(side, x_c[at]);
        outward.try_normalize(1e-12).unwrap_or_default() * height_m
    };
    (0..count)
        .map(|i| point(i) + 0.5 * (lift((i + count - 1) % count, i) + lift(i, i)))
        .collect()
}

fn lifted(point: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(point.x, point.y, 0.0)
}
