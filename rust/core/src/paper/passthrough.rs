//! Step 5: the pass-through filter, one box for the whole test.

use crate::error::InvalidValue;

/// An axis-aligned box in the world frame, metres; its faces belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassThrough {
    min_m: [f32; 3],
    max_m: [f32; 3],
}

impl PassThrough {
    /// The box between two corners.
    ///
    /// # Errors
    /// [`InvalidValue`] where a side is not longer than zero.
    pub fn new(min_m: [f64; 3], max_m: [f64; 3]) -> Result<Self, InvalidValue> {
        if !min_m.iter().zip(&max_m).all(|(min, max)| min < max) {
            return Err(InvalidValue {
                name: "box_m",
                expected: "a lower and a higher bound on every axis".into(),
                found: format!("{min_m:?} to {max_m:?}"),
            });
        }
        Ok(Self {
            min_m: min_m.map(|v| v as f32),
            max_m: max_m.map(|v| v as f32),
        })
    }

    /// Which points lie in the box.
    pub fn mask(&self, points_m: &[[f32; 3]]) -> Vec<bool> {
        points_m.iter().map(|point| self.contains(point)).collect()
    }

    /// Whether a point lies in the box.
    pub fn contains(&self, point_m: &[f32; 3]) -> bool {
        (0..3).all(|axis| (self.min_m[axis]..=self.max_m[axis]).contains(&point_m[axis]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_belong_to_the_box_and_nan_does_not() {
        let pass = PassThrough::new([0.0; 3], [1.0, 2.0, 3.0]).unwrap();
        assert!(pass.contains(&[0.0, 2.0, 1.5]));
        assert!(!pass.contains(&[0.0, 2.1, 1.5]));
        assert!(!pass.contains(&[f32::NAN, 1.0, 1.0]));
    }

    #[test]
    fn an_empty_box_is_refused() {
        assert!(PassThrough::new([0.0; 3], [1.0, 0.0, 1.0]).is_err());
        assert!(PassThrough::new([0.0; 3], [1.0, f64::NAN, 1.0]).is_err());
    }
}
