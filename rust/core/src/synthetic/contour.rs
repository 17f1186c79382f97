//! Contours of sections: the FFA-W3 family blended to any thickness.

use super::reference::numbers;

/// Points of one side, both ends included.
const SIDE_POINTS: usize = 41;
/// Points of a contour: leading edge, suction side, trailing edge, pressure side.
pub const CONTOUR_POINTS: usize = 2 * (SIDE_POINTS - 1);

/// One section in chord lengths: from the leading edge (0, 0) over the suction side to the
/// trailing edge (1, 0) and back, open; x along the chord, y towards the suction side.
pub type Contour = [[f64; 2]; CONTOUR_POINTS];

/// Airfoils from thick to thin, resampled at equal places along the chord.
#[derive(Debug, Clone)]
pub struct Airfoils {
    x_c: Vec<f64>,
    /// Suction and pressure side by airfoil, and its greatest thickness.
    sides: Vec<(Vec<f64>, Vec<f64>, f64)>,
}

impl Default for Airfoils {
    /// The FFA-W3 airfoils of the IEA 15 MW reference blade, and a circle.
    fn default() -> Self {
        let rows = numbers(include_str!("data/airfoils.csv"));
        let column = |i: usize| rows.iter().map(|row| row[i]).collect::<Vec<f64>>();
        let sides = (0..8).map(|airfoil| {
            let (upper, lower) = (column(1 + 2 * airfoil), column(2 + 2 * airfoil));
            let thickness = thickness(&upper, &lower);
            (upper, lower, thickness)
        });
        Self {
            x_c: column(0),
            sides: sides.collect(),
        }
    }
}

fn thickness(upper: &[f64], lower: &[f64]) -> f64 {
    let pairs = upper.iter().zip(lower);
    pairs.map(|(u, l)| u - l).fold(0.0, f64::max)
}

impl Airfoils {
    /// The contour of thickness over chord `rel_thickness`: the two neighbours of the family
    /// blended, the thickness then made exact.
    pub fn contour(&self, rel_thickness: f64) -> Contour {
        let thinner = self
            .sides
            .iter()
            .skip(1)
            .position(|side| side.2 <= rel_thickness);
        let thick = thinner.unwrap_or(self.sides.len() - 2);
        let (a, b) = (&self.sides[thick], &self.sides[thick + 1]);
        let share = ((rel_thickness - b.2) / (a.2 - b.2)).clamp(0.0, 1.0);
        let blend = |x: &[f64], y: &[f64]| -> Vec<f64> {
            let pairs = x.iter().zip(y);
            pairs.map(|(x, y)| share * x + (1.0 - share) * y).collect()
        };
        let (upper, lower) = (blend(&a.0, &b.0), blend(&a.1, &b.1));
        let scale = rel_thickness / thickness(&upper, &lower);
        self.outline(&upper, &lower, scale)
    }

    fn outline(&self, upper: &[f64], lower: &[f64], scale: f64) -> Contour {
        let mut contour = [[0.0; 2]; CONTOUR_POINTS];
        let last = SIDE_POINTS - 1;
        contour[last] = [1.0, 0.0];
        for i in 1..last {
            contour[i] = [self.x_c[i], upper[i] * scale];
            contour[CONTOUR_POINTS - i] = [self.x_c[i], lower[i] * scale];
        }
        contour
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thickness_is_exact_and_the_order_is_the_interface_s() {
        let airfoils = Airfoils::default();
        for t in [0.18, 0.211, 0.25, 0.36, 0.45, 0.7, 1.0] {
            let contour = airfoils.contour(t);
            let found = (1..40).map(|i| contour[i][1] - contour[CONTOUR_POINTS - i][1]);
            assert!((found.fold(0.0, f64::max) - t).abs() < 1e-12);
            assert_eq!((contour[0], contour[40]), ([0.0, 0.0], [1.0, 0.0]));
            assert!(contour[20][1] > 0.0 && contour[60][1] < 0.0);
        }
    }

    #[test]
    fn the_root_is_a_circle() {
        for [x, y] in Airfoils::default().contour(1.0) {
            assert!(((x - 0.5).hypot(y) - 0.5).abs() < 1e-5);
        }
    }
}
