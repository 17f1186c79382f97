//! Where a shot points: sine and cosine turned on by small angles, azimuths brought into one turn.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use std::f64::consts::{PI as HALF_TURN, TAU};
use std::sync::LazyLock;

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

/// Any angle brought into [0, 2 pi) of `f32`; quickly where it is not far outside of one turn.
#[inline(always)]
pub fn wrapped_far(angle_rad: f64) -> f32 {
    let is_near = (-TAU..2.0 * TAU).contains(&angle_rad);
    wrapped(if is_near {
        angle_rad
    } else {
        angle_rad.rem_euclid(TAU)
    })
}

/// The same direction, at most half a turn away.
pub fn within_half_turn(angle_rad: f64) -> f64 {
    if angle_rad.abs() <= HALF_TURN {
        angle_rad
    } else {
        (angle_rad + HALF_TURN).rem_euclid(TAU) - HALF_TURN
    }
}

/// Radians of a hundredth of a degree.
pub const RAD_PER_CENTIDEG: f64 = HALF_TURN / 18_000.0;

/// Sine and cosine of whole hundredths of a degree as rotors tell them.
static TOLD: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    let angle = |number: u32| (f64::from(number) * RAD_PER_CENTIDEG).sin_cos();
    (0..36_000).map(angle).collect()
});

/// Sine and cosine of an angle, [0, 2 pi), to the bit; looked up where it is a whole number of
/// [`RAD_PER_CENTIDEG`], as most rotors tell it.
#[inline]
pub fn told(angle_rad: f64) -> (f64, f64) {
    let number = (angle_rad * (1.0 / RAD_PER_CENTIDEG) + 0.5) as u32;
    let is_whole = f64::from(number) * RAD_PER_CENTIDEG == angle_rad;
    let known = TOLD.get(number as usize).filter(|_| is_whole);
    known.copied().unwrap_or_else(|| angle_rad.sin_cos())
}

/// Sine and cosine of whole hundredths of a degree.
static CENTIDEGREES: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    let angle = |number: u32| (f64::from(number) / 100.0).to_radians().sin_cos();
    (0..36_000).map(angle).collect()
});

/// Sines and cosines of hundredths of a degree.
#[derive(Debug, Clone, Copy)]
pub struct Centidegrees(&'static [(f64, f64)]);

impl Centidegrees {
    /// The table, made when it is first asked for.
    pub fn table() -> Self {
        Self(CENTIDEGREES.as_slice())
    }

    /// Sine and cosine of an angle of so many hundredths of a degree, of whatever turn.
    #[inline(always)]
    pub fn sin_cos(self, angle: i32) -> (f64, f64) {
        let place = if (0..36_000).contains(&angle) {
            angle
        } else {
            angle.rem_euclid(36_000)
        };
        self.0.get(place as usize).copied().unwrap_or((0.0, 1.0))
    }

    /// The angle in radians, [0, 2 pi) of `f32`.
    #[inline(always)]
    pub fn wrapped(self, angle: i32) -> f32 {
        wrapped(f64::from(angle.rem_euclid(36_000)) * (TAU / 36_000.0))
    }
}

/// Angle of a direction from the first axis towards the second, [0, 2 pi); 0 for no direction. Within
/// 3e-7 of the exact one.
///
/// The arc tangent of the smaller over the larger number, brought below tan(pi/8), by the polynomial of
/// the Cephes library (S. L. Moshier).
#[inline(always)]
pub fn bearing(x: f32, y: f32) -> f32 {
    const TAN_PI_8: f32 = 0.414_213_57;
    let (ahead, aside) = (x.abs(), y.abs());
    let (large, small) = (ahead.max(aside), ahead.min(aside));
    let is_wide = small > TAN_PI_8 * large;
    let (up, down) = if is_wide {
        (small - large, small + large)
    } else {
        (small, large)
    };
    // The smallest number keeps no direction from becoming none at all; to others it adds nothing.
    let ratio = up / (down + f32::MIN_POSITIVE);
    let square = ratio * ratio;
    let series = ((8.053_744_5e-2 * square - 1.387_768_6e-1) * square + 1.997_771_1e-1) * square;
    let arc = (series - 3.333_295e-1) * square * ratio + ratio;
    let arc = arc + if is_wide { FRAC_PI_4 } else { 0.0 };
    let quadrant = if aside > ahead { FRAC_PI_2 - arc } else { arc };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    let whole = if y < 0.0 { 2.0 * PI - half } else { half };
    if whole >= TAU as f32 { 0.0 } else { whole }
}

/// Distance of a position from the origin.
#[inline(always)]
pub fn reach(position: [f32; 3]) -> f32 {
    let [x, y, z] = position.map(f64::from);
    (x * x + y * y + z * z).sqrt() as f32
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
        assert_eq!(within_half_turn(-3.0), -3.0);
        assert!((within_half_turn(100.0 * TAU + 4.0) - (4.0 - TAU)).abs() < 1e-12);
        for step in -4000..4000 {
            let angle = f64::from(step) * 0.01;
            assert_eq!(wrapped_far(angle), wrapped(angle.rem_euclid(TAU)));
        }
    }

    #[test]
    fn angles_that_are_looked_up_have_the_bits_of_all_others() {
        for number in 0..40_000 {
            for angle_rad in [
                f64::from(number) * RAD_PER_CENTIDEG,
                f64::from(number).to_radians() / 100.0,
                f64::from(number) * 1e-4,
            ] {
                assert_eq!(told(angle_rad), angle_rad.sin_cos());
            }
        }
    }

    #[test]
    fn bearings_are_those_of_the_arc_tangent() {
        for step in 0..100_000 {
            let angle = f64::from(step) * TAU / 100_000.0;
            let (x, y) = ((30.0 * angle.cos()) as f32, (30.0 * angle.sin()) as f32);
            let exact = f64::from(y).atan2(f64::from(x)).rem_euclid(TAU);
            let off = (f64::from(bearing(x, y)) - exact + 1.0).rem_euclid(TAU) - 1.0;
            assert!(off.abs() < 6e-7, "{angle}: {off}");
        }
        assert_eq!(bearing(0.0, 0.0), 0.0);
        assert!(bearing(1.0, -1e-20) < TAU as f32);
        assert!(bearing(f32::MAX, f32::MAX).is_finite());
    }

    #[test]
    fn hundredths_of_a_degree_of_any_turn() {
        let table = Centidegrees::table();
        for angle in [-36_001, -1, 0, 9_000, 35_999, 36_000, 65_535] {
            let (sin, cos) = (f64::from(angle) / 100.0).to_radians().sin_cos();
            let found = table.sin_cos(angle);
            assert!((found.0 - sin).abs() < 1e-12 && (found.1 - cos).abs() < 1e-12);
        }
        assert_eq!(
            (table.wrapped(36_000), table.wrapped(-9_000)),
            (0.0, 4.712_389)
        );
    }
}
