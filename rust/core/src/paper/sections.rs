//! Step 11: sections by arc length from the tip, equation (15).

use super::curves::ContourCurve;
use crate::error::{FitError, InvalidValue};
use crate::fit::Fit;
use crate::fit::arc::{SpaceCurve, SpanAxis};
use crate::fit::polynomial::Polynomial;

/// Tolerance of arc lengths, metres: far below everything else in this method.
const TOLERANCE_M: f64 = 1e-4;

/// The line half-way between both contours: the chord's middle over z.
#[derive(Debug, Clone)]
pub struct MidLine(SpaceCurve);

impl MidLine {
    /// The line between two contours.
    ///
    /// # Errors
    /// [`InvalidValue`] where their coefficients are not finite.
    pub fn new(leading: &ContourCurve, trailing: &ContourCurve) -> Result<Self, InvalidValue> {
        let across = [
            mean(&leading.x, &trailing.x)?,
            mean(&leading.y, &trailing.y)?,
        ];
        Ok(Self(SpaceCurve {
            axis: SpanAxis::Z,
            across,
        }))
    }

    /// Its point at `z_m`, metres, world frame.
    pub fn point_m(&self, z_m: f64) -> [f64; 3] {
        self.0.point_m(z_m)
    }

    /// Arc length from `from_z_m` to `to_z_m`, metres, equation (15).
    ///
    /// # Errors
    /// [`FitError::NotConverged`] for ends that are not finite.
    pub fn length_m(&self, from_z_m: f64, to_z_m: f64) -> Result<f64, FitError> {
        self.0.arc_length_m(from_z_m, to_z_m, TOLERANCE_M)
    }

    /// The point `length_m` before `tip_z_m`, measured along the line.
    ///
    /// # Errors
    /// [`FitError::NotConverged`] for places that are not finite.
    pub fn before_tip_m(&self, tip_z_m: f64, length_m: f64) -> Result<[f64; 3], FitError> {
        let z_m = self.0.walk_m(tip_z_m, -length_m, TOLERANCE_M)?;
        Ok(self.point_m(z_m))
    }
}

/// Half-way between two polynomials of one degree.
fn mean(a: &Fit<Polynomial>, b: &Fit<Polynomial>) -> Result<Polynomial, InvalidValue> {
    let pairs = a.estimate.powers().into_iter().zip(b.estimate.powers());
    Polynomial::from_powers(pairs.map(|(a, b)| 0.5 * (a + b)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::curves::{Degrees, fit_contour};

    /// Both edges of a chord of 2 m on a straight line that leans by 3 in 4.
    fn contours() -> [ContourCurve; 2] {
        [1.0, -1.0].map(|side| {
            let samples: Vec<[f64; 3]> = (0..20)
                .map(f64::from)
                .map(|z| [0.75 * z + side, 2.0, z])
                .collect();
            fit_contour(&samples, Degrees::new(1, 2).unwrap()).unwrap()
        })
    }

    #[test]
    fn the_middle_lies_between_and_lengths_are_its_own() {
        let [leading, trailing] = contours();
        let line = MidLine::new(&leading, &trailing).unwrap();
        let point = line.point_m(8.0);
        assert!((point[0] - 6.0).abs() < 1e-9 && (point[1] - 2.0).abs() < 1e-9);
        // 3-4-5: 8 m of z are 10 m of line.
        assert!((line.length_m(0.0, 8.0).unwrap() - 10.0).abs() < 1e-6);
        let back = line.before_tip_m(8.0, 5.0).unwrap();
        assert!((back[2] - 4.0).abs() < 1e-4 && (back[0] - 3.0).abs() < 1e-4);
    }
}
