//! Step 11: sections by arc length from the tip, equation (15).

use super::curves::ContourCurve;
use crate::fit::arc::{arc_length, walk_arc};

/// Tolerance of arc lengths, metres: a tenth of a millimetre is far below everything else here.
const TOLERANCE_M: f64 = 1e-4;

/// The line half-way between both contours: the chord's middle over z.
#[derive(Debug, Clone)]
pub struct MidLine<'a> {
    leading: &'a ContourCurve,
    trailing: &'a ContourCurve,
}

impl<'a> MidLine<'a> {
    /// The line between two contours.
    pub fn new(leading: &'a ContourCurve, trailing: &'a ContourCurve) -> Self {
        Self { leading, trailing }
    }

    /// Its point at `z_m`, metres, world frame.
    pub fn point_m(&self, z_m: f64) -> [f64; 3] {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        [
            mean(self.leading.x.estimate.eval(z_m), self.trailing.x.estimate.eval(z_m)),
            mean(self.leading.y.estimate.eval(z_m), self.trailing.y.estimate.eval(z_m)),
            z_m,
        ]
    }

    /// Leading minus trailing edge at `z_m`, metres; along z it is nothing by construction.
    pub fn chord_m(&self, z_m: f64) -> [f64; 3] {
        let (a, b) = (self.leading, self.trailing);
        [
            a.x.estimate.eval(z_m) - b.x.estimate.eval(z_m),
            a.y.estimate.eval(z_m) - b.y.estimate.eval(z_m),
            0.0,
        ]
    }

    /// Arc length per metre of z: the integrand of (15) with t = z.
    fn stretch(&self, z_m: f64) -> f64 {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let dx = mean(self.leading.x.estimate.slope(z_m), self.trailing.x.estimate.slope(z_m));
        let dy = mean(self.leading.y.estimate.slope(z_m), self.trailing.y.estimate.slope(z_m));
        (1.0 + dx * dx + dy * dy).sqrt()
    }

    /// Arc length from `from_z_m` to `to_z_m`, metres, equation (15).
    pub fn length_m(&self, from_z_m: f64, to_z_m: f64) -> f64 {
        arc_length(|z| self.stretch(z), from_z_m, to_z_m, TOLERANCE_M)
    }

    /// The point `length_m` before `tip_z_m`, measured along the line.
    pub fn before_tip_m(&self, tip_z_m: f64, length_m: f64) -> [f64; 3] {
        self.point_m(walk_arc(|z| self.stretch(z), tip_z_m, -length_m, TOLERANCE_M))
    }
}
