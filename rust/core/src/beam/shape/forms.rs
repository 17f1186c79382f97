//! How contours of blades differ from one another: thickness, nose, rear, camber and load at the rear.
//!
//! Sizes are those between the four-digit family and the sections of large blades.

/// Ways in which contours differ.
pub(super) const FORMS: usize = 5;
/// Distance between the knots of each, metres: a contour is drawn by few sections.
pub(super) const KNOT_M: f64 = 25.0;

/// How far the contour stands out by one standard deviation of each, at a place along the chord, chord
/// lengths.
pub(super) fn forms(x_c: f64, is_second_side: bool) -> [f64; FORMS] {
    let half = half(x_c);
    let nose = (1.0 - x_c / 0.3).max(0.0).powi(2);
    let up = if is_second_side { -1.0 } else { 1.0 };
    let bow = up * x_c * (1.0 - x_c);
    [
        0.1 * half,
        0.15 * nose * half,
        0.5 * x_c.powi(3) * half,
        0.05 * bow,
        0.1 * x_c * x_c * bow,
    ]
}

/// Half of the thickness of a section of a quarter of its chord.
fn half(x_c: f64) -> f64 {
    let thick = 0.2969 * x_c.sqrt() - 0.126 * x_c - 0.3516 * x_c.powi(2) + 0.2843 * x_c.powi(3)
        - 0.1015 * x_c.powi(4);
    1.25 * thick
}
