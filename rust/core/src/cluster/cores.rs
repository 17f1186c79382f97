//! The cores of one cell: where they lie, and how near those of another may be.

use std::ops::Range;

use crate::neighbors::{Coordinate, squared_distance, wide};

/// Cores of a cell.
#[derive(Debug, Clone, Copy)]
pub struct CellCores<T> {
    /// Sorted place of the first, which is that of lowest index in the cloud; 2^32 - 1 without any.
    pub first: u32,
    /// The box around them, metres.
    low: [T; 3],
    high: [T; 3],
}

const NO_CORE: u32 = u32::MAX;

impl<T: Coordinate> CellCores<T> {
    /// Of a cell with these sorted places, of which there is one at least.
    pub fn of(points: &[[T; 3]], members: Range<usize>, cores: &[bool]) -> Self {
        let mut found = Self {
            first: NO_CORE,
            low: points[members.start],
            high: points[members.start],
        };
        for i in members.filter(|&i| cores[i]) {
            let point = points[i];
            if !found.has_any() {
                (found.first, found.low, found.high) = (i as u32, point, point);
            }
            for (k, c) in point.into_iter().enumerate() {
                found.low[k] = if c < found.low[k] { c } else { found.low[k] };
                found.high[k] = if c > found.high[k] { c } else { found.high[k] };
            }
        }
        found
    }

    /// Whether there is a core.
    #[inline(always)]
    pub fn has_any(&self) -> bool {
        self.first != NO_CORE
    }

    /// Least squared distance from the cores of another cell that it may have.
    #[inline(always)]
    pub fn squared_gap(&self, other: &Self) -> f64 {
        self.squared_distance(other.low, other.high)
    }

    /// Least squared distance from a point that a core may have.
    #[inline(always)]
    pub fn squared_gap_to(&self, point: [T; 3]) -> f64 {
        self.squared_distance(point, point)
    }

    /// Least squared distance of two points in two boxes. Rounded, it is at most that of any two points, rounded:
    /// differences, squares and sums are rounded in their order.
    #[inline(always)]
    fn squared_distance(&self, low: [T; 3], high: [T; 3]) -> f64 {
        let ([own_low, own_high], [low, high]) =
            ([wide(self.low), wide(self.high)], [wide(low), wide(high)]);
        let gap = |k: usize| {
            let (before, behind) = (own_low[k] - high[k], low[k] - own_high[k]);
            let far = if before > behind { before } else { behind };
            if far > 0.0 { far } else { 0.0 }
        };
        squared_distance([gap(0), gap(1), gap(2)], [0.0; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_those_of_the_boxes_around_the_cores_alone() {
        let points = [
            [0.0f32, 0.0, 0.0],
            [1.0, 2.0, 0.0],
            [9.0; 3],
            [4.0, 2.0, 4.0],
        ];
        let cores = [true, true, false, true];
        let one = CellCores::of(&points, 0..3, &cores);
        let other = CellCores::of(&points, 3..4, &cores);
        assert_eq!((one.first, other.first), (0, 3));
        assert_eq!(one.squared_gap(&other), 9.0 + 16.0);
        assert_eq!(other.squared_gap_to([4.0, 0.0, 4.0]), 4.0);
        assert!(!CellCores::of(&points, 2..3, &cores).has_any());
    }
}
