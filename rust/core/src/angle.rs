//! Azimuths that wrap: differences and intervals over the seam.

use std::f64::consts::{PI, TAU};

/// `angle_rad` brought into [0, 2 pi).
#[inline]
pub fn wrap_turn(angle_rad: f64) -> f64 {
    // Mostly not far outside of it: the same to the bit without the division.
    let wrapped = if (0.0..TAU).contains(&angle_rad) {
        return angle_rad;
    } else if -TAU < angle_rad && angle_rad < 0.0 {
        angle_rad + TAU
    } else if (TAU..2.0 * TAU).contains(&angle_rad) {
        angle_rad - TAU
    } else {
        angle_rad.rem_euclid(TAU)
    };
    // rem_euclid of a tiny negative number rounds up to the modulus itself.
    if wrapped >= TAU { 0.0 } else { wrapped }
}

/// `angle_rad` brought into [-pi, pi).
pub fn wrap_half_turn(angle_rad: f64) -> f64 {
    wrap_turn(angle_rad + PI) - PI
}

/// An interval of azimuth, from `from_rad` on in the sense of rotation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Arc {
    /// Start, [0, 2 pi).
    pub from_rad: f64,
    /// Width, from 0.
    pub width_rad: f64,
}

impl Arc {
    /// The smallest arc that holds all angles, where they lie within less than half a turn.
    pub fn around(angles_rad: &[f64]) -> Option<Self> {
        let first = *angles_rad.first()?;
        let aside = |angle: &f64| wrap_half_turn(angle - first);
        let ends = |pick: fn(f64, f64) -> f64| angles_rad.iter().map(aside).fold(0.0, pick);
        let (low, high) = (ends(f64::min), ends(f64::max));
        (high - low < PI).then(|| Self {
            from_rad: wrap_turn(first + low),
            width_rad: high - low,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_has_one_seam() {
        assert_eq!(wrap_turn(TAU), 0.0);
        assert_eq!(wrap_turn(-1e-18), 0.0);
        assert!((wrap_turn(-0.1) - (TAU - 0.1)).abs() < 1e-15);
    }

    #[test]
    fn angles_near_a_turn_are_wrapped_as_all_others() {
        let plain = |angle_rad: f64| match angle_rad.rem_euclid(TAU) {
            wrapped if wrapped >= TAU => 0.0,
            wrapped => wrapped,
        };
        let ends = [0.0, TAU, 2.0 * TAU].into_iter().flat_map(|end| {
            let (up, down) = (f64::from_bits(end.to_bits() + 1), end.next_down());
            [end, -end, up, -up, down, -down]
        });
        let between = (-4000..4000).map(|step| f64::from(step) * 0.005_432_1);
        for angle_rad in ends.chain(between) {
            let (found, expected) = (wrap_turn(angle_rad), plain(angle_rad));
            assert_eq!(found.to_bits(), expected.to_bits(), "{angle_rad}");
        }
    }

    #[test]
    fn an_arc_around_angles_may_lie_over_the_seam() {
        let arc = Arc::around(&[0.2, TAU - 0.1, 0.05]).unwrap();
        assert!((arc.from_rad - (TAU - 0.1)).abs() < 1e-12 && (arc.width_rad - 0.3).abs() < 1e-12);
        assert_eq!(Arc::around(&[0.0, 2.0, 4.0]), None);
        assert_eq!(Arc::around(&[]), None);
    }

    #[test]
    fn differences_over_the_seam_are_short() {
        let difference = wrap_half_turn(0.01 - (TAU - 0.01));
        assert!((difference - 0.02).abs() < 1e-15);
        assert_eq!(wrap_half_turn(PI), -PI);
    }
}
