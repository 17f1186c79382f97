//! The cores of one cell: where they lie, and how near those of another may be.

use std::ops::Range;

use super::bounds::Bounds;
use crate::neighbors::Coordinate;

/// Cores of a cell.
#[derive(Debug, Clone, Copy)]
pub struct CellCores<T> {
    /// Sorted place of the first, which is that of lowest index in the cloud; 2^32 - 1 without any.
    pub first: u32,
    around: Bounds<T>,
}

const NO_CORE: u32 = u32::MAX;

impl<T: Coordinate> CellCores<T> {
    /// Of a cell with these sorted places, of which there is one at least.
    pub fn of(points: &[[T; 3]], members: Range<usize>, cores: &[bool]) -> Self {
        let mut found = Self {
            first: NO_CORE,
            around: Bounds::at(points[members.start]),
        };
        for i in members.filter(|&i| cores[i]) {
            if !found.has_any() {
                (found.first, found.around) = (i as u32, Bounds::at(points[i]));
            }
            found.around.add(points[i]);
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
        self.around.squared_gap(&other.around)
    }

    /// Least squared distance from a point that a core may have.
    #[inline(always)]
    pub fn squared_gap_to(&self, point: [T; 3]) -> f64 {
        self.around.squared_gap(&Bounds::at(point))
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
