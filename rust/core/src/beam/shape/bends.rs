//! Chord and twist of a blade without a drawing vary smoothly, but towards the tip.

use super::Shape;
use crate::beam::smooth::Small;

/// A blade ends like an ellipse, the logarithm of whose chord bends by this over the square of the distance left;
/// blades differ by as much.
const ELLIPSE: f64 = 0.5;

impl Shape {
    /// Second differences of the knots of chord and twist, by number among the unknowns of the surface.
    pub(in crate::beam) fn bends(&self) -> impl Iterator<Item = Small> {
        let inner = match self.trust.bend > 0.0 {
            true => 0..self.slow.saturating_sub(2),
            false => 0..0,
        };
        inner.flat_map(|knot| [self.chord_bend(knot), self.twist_bend(knot)])
    }

    fn chord_bend(&self, knot: usize) -> Small {
        let left = (self.slow - 2 - knot) as f64;
        let share = |k: usize| self.chord_wave(knot + k) / self.trust.chord_waves;
        Small {
            first: 3 + knot,
            weights: vec![share(0), -2.0 * share(1), share(2)],
            sigma: self
                .trust
                .bend
                .hypot(ELLIPSE / (left * left) / self.trust.chord_waves),
        }
    }

    fn twist_bend(&self, knot: usize) -> Small {
        Small {
            first: 3 + self.slow + knot,
            weights: vec![1.0, -2.0, 1.0],
            sigma: self.trust.bend,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ShapeTrust;
    use super::*;
    use crate::beam::sample;

    fn shape(bend: f64) -> Shape {
        let trust = ShapeTrust {
            bend,
            slow_knot_m: 0.8,
            ..ShapeTrust::default()
        };
        let mesh = &sample::adjustment(0.0).problem.mesh;
        Shape::new(mesh, trust, 0.5 * mesh.length_m())
    }

    #[test]
    fn a_chord_may_bend_more_the_nearer_the_tip() {
        let shape = shape(0.02);
        let chord: Vec<Small> = shape
            .bends()
            .filter(|bend| bend.first < 3 + shape.slow)
            .collect();
        assert_eq!(chord.len(), shape.slow - 2);
        assert!(chord.windows(2).all(|two| two[0].sigma < two[1].sigma));
        assert!(chord[0].sigma > 0.02);
    }

    #[test]
    fn with_a_drawing_knots_are_independent() {
        assert_eq!(shape(0.0).bends().count(), 0);
    }
}
