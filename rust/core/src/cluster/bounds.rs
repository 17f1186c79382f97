//! The box around some points, and how near another one may be.

use crate::neighbors::{Coordinate, squared_distance, wide};

/// A box along the axes, metres; its faces belong to it.
#[derive(Debug, Clone, Copy)]
pub struct Bounds<T> {
    low: [T; 3],
    high: [T; 3],
}

impl<T: Coordinate> Bounds<T> {
    /// Around one point.
    #[inline(always)]
    pub fn at(point: [T; 3]) -> Self {
        Self {
            low: point,
            high: point,
        }
    }

    /// Around another point, too.
    #[inline(always)]
    pub fn add(&mut self, point: [T; 3]) {
        for (k, c) in point.into_iter().enumerate() {
            self.low[k] = if c < self.low[k] { c } else { self.low[k] };
            self.high[k] = if c > self.high[k] { c } else { self.high[k] };
        }
    }

    /// Least squared distance of two points in two boxes. Rounded, it is at most that of any two points, rounded:
    /// differences, squares and sums are rounded in their order.
    #[inline(always)]
    pub fn squared_gap(&self, other: &Self) -> f64 {
        let [own_low, own_high] = [wide(self.low), wide(self.high)];
        let [low, high] = [wide(other.low), wide(other.high)];
        let gap = |k: usize| {
            let (before, behind) = (own_low[k] - high[k], low[k] - own_high[k]);
            let far = if before > behind { before } else { behind };
            if far > 0.0 { far } else { 0.0 }
        };
        squared_distance([gap(0), gap(1), gap(2)], [0.0; 3])
    }
}
