//! Where a shot points: sine and cosine turned on by small angles, azimuths brought into one turn.

use std::f64::consts::TAU;

/// Up to here sine and cosine of a small angle come from their series, to 3e-11.
const SMALL_RAD: f64 = 0.02;

/// Sine and cosine of an angle turned on by a mostly small one.
#[inline]
pub fn turn(sin_cos: (f64, f64), by_rad: f64) -> (f64, f64) {
    add(sin_cos, small_turn(by_rad))
}

/// Sine and cosine of a mostly small angle.
#[inline]
pub fn small_turn(by_rad: f64) -> (f64, f64) {
    if by_rad.abs() < SMALL_RAD {
        let square = by_rad * by_rad;
        let sin_by = by_rad * (1.0 - square / 6.0);
        (sin_by, 1.0 - square * (0.5 - square / 24.0))
    } else {
        by_rad.sin_cos()
    }
}

/// Sine and cosine of the sum of two angles.
#[inline]
pub fn add((sin, cos): (f64, f64), (sin_by, cos_by): (f64, f64)) -> (f64, f64) {
    (sin * cos_by + cos * sin_by, cos * cos_by - sin * sin_by)
}

/// An angle not far outside of one turn brought into [0, 2 pi) of `f32`.
#[inline(always)]
pub fn wrapped(angle_rad: f64) -> f32 {
    let once = if angle_rad >= TAU {
        angle_rad - TAU
    } else if angle_rad < 0.0 {
        angle_rad + TAU
    } else {
        angle_rad
    };
    let narrow = once as f32;
    // Just below a full turn rounds up to it.
    if narrow >= TAU as f32 { 0.0 } else { narrow }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_turns_keep_the_accuracy() {
        for by in [-0.0199, -1e-4, 0.0, 0.0113, 0.0199, 0.021, 1.0] {
            let (sin, cos) = turn(2.0_f64.sin_cos(), by);
            assert!((sin - (2.0 + by).sin()).abs() < 5e-11);
            assert!((cos - (2.0 + by).cos()).abs() < 5e-11);
        }
        assert_eq!(wrapped(TAU - 1e-9), 0.0);
        assert_eq!(wrapped(TAU + 0.5), 0.5);
    }
}
