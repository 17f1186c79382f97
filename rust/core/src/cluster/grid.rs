//! A cloud sorted into cells so small that all points of one cell are neighbours of each other.

use std::ops::Range;

use crate::neighbors::{Coordinate, wide};

/// Cells this many steps apart may hold neighbours: the radius is sqrt(3) edges.
const REACH: u64 = 2;
/// Rows of cells around a cell, itself included, by their steps along the two outer axes.
const ROWS: usize = 25;
/// Rows from the nearest to the farthest; the first is that of the cell.
const NEAR_FIRST: [usize; ROWS] = [
    12, 7, 11, 13, 17, 6, 8, 16, 18, 2, 10, 14, 22, 1, 3, 5, 9, 15, 19, 21, 23, 0, 4, 20, 24,
];
/// A hair under 1, so that rounding of a cell index cannot part the points of one cell too far.
const SHRINK: f64 = 1.0 - 1e-6;
/// Cells along one axis up to which indices are exact enough for `SHRINK`: 2^28 2^-51 < 1e-6.
const MOST_STEPS: f64 = (1u64 << 28) as f64;
/// Bits sorted in one pass.
const DIGIT_BITS: u32 = 11;
/// Points up to which sorting by comparison is faster.
const FEW: usize = 256;
/// Cells handed to a thread at once.
const BLOCK: usize = 2048;

/// Points sorted by cell, the cells by key; keys of neighbouring cells differ by known steps.
pub struct Grid<T> {
    /// The points, cell by cell, within a cell in the order of the cloud.
    pub points: Vec<[T; 3]>,
    /// Where each sorted point stands in the cloud.
    pub order: Vec<u32>,
    keys: Vec<u64>, // of the cells, ascending, and one above all at the end
    starts: Vec<u32>,
    row_steps: [i64; ROWS],
}

impl<T: Coordinate> Grid<T> {
    /// Sorts finite `points` into cells of edge `radius_m / sqrt(3)`; `None` where the cloud is so
    /// large against the radius that cells cannot be numbered.
    pub fn new(points: &[[T; 3]], radius_m: f64) -> Option<Self> {
        let lattice = Lattice::new(points, radius_m)?;
        let entry = |(i, p): (usize, &[T; 3])| (lattice.key(*p), i as u32);
        let mut entries: Vec<(u64, u32)> = points.iter().enumerate().map(entry).collect();
        sort_by_key(&mut entries, lattice.most_key());
        let (keys, starts) = cells(&entries);
        Some(Self {
            points: entries.iter().map(|e| points[e.1 as usize]).collect(),
            order: entries.iter().map(|e| e.1).collect(),
            keys,
            starts,
            row_steps: lattice.row_steps(),
        })
    }

    /// Number of cells that hold points.
    pub fn cells(&self) -> usize {
        self.keys.len() - 1
    }

    /// Sorted places of the points of a cell.
    #[inline]
    pub fn members(&self, cell: usize) -> Range<usize> {
        self.starts[cell] as usize..self.starts[cell + 1] as usize
    }

    /// Sorted places of the points of consecutive cells.
    #[inline]
    pub fn members_of(&self, cells: &Range<usize>) -> Range<usize> {
        self.starts[cells.start] as usize..self.starts[cells.end] as usize
    }

    /// What sorted points have, in the order in which the points came.
    pub fn unsorted(&self, sorted: &[i32]) -> Vec<i32> {
        let mut values = vec![0; sorted.len()];
        for (&place, value) in self.order.iter().zip(sorted) {
            values[place as usize] = *value;
        }
        values
    }

    /// The cells in pieces for threads.
    pub fn blocks(&self) -> Vec<Range<usize>> {
        let starts = (0..self.cells()).step_by(BLOCK);
        starts.map(|s| s..(s + BLOCK).min(self.cells())).collect()
    }

    /// One value per sorted point, cut at the same places as the blocks of cells.
    pub fn split<'v, V>(
        &self,
        mut values: &'v mut [V],
        blocks: &[Range<usize>],
    ) -> Vec<&'v mut [V]> {
        let cut = |block: &Range<usize>| {
            let count = self.members_of(block).len();
            let (piece, rest) = std::mem::take(&mut values).split_at_mut(count);
            values = rest;
            piece
        };
        blocks.iter().map(cut).collect()
    }

    /// A walk over the neighbourhoods of cells from `first` on.
    pub fn walk(&self, first: usize) -> Walk<'_> {
        let cursor = |step: &i64| {
            let row_start = self.keys[first].wrapping_add_signed(*step) - REACH;
            self.keys.partition_point(|&key| key < row_start)
        };
        Walk {
            keys: &self.keys,
            row_steps: &self.row_steps,
            cursors: std::array::from_fn(|row| cursor(&self.row_steps[row])),
            runs: Vec::with_capacity(ROWS),
        }
    }
}

/// Neighbourhoods of one cell after the other: keys ascend, so each row's start only moves forward.
pub struct Walk<'g> {
    keys: &'g [u64],
    row_steps: &'g [i64; ROWS],
    cursors: [usize; ROWS],
    runs: Vec<Range<usize>>,
}

impl Walk<'_> {
    /// Runs of cells that may hold neighbours of `cell`, nearest rows first, the cell itself in the
    /// first. Calls must name later and later cells.
    #[inline]
    pub fn rows(&mut self, cell: usize) -> impl Iterator<Item = Range<usize>> {
        NEAR_FIRST.into_iter().map(move |row| self.row(row, cell))
    }

    /// The same, put aside for several passes, without empty runs.
    #[inline]
    pub fn around(&mut self, cell: usize) -> &[Range<usize>] {
        self.runs.clear();
        for row in NEAR_FIRST {
            let run = self.row(row, cell);
            if !run.is_empty() {
                self.runs.push(run);
            }
        }
        &self.runs
    }

    /// Runs of the cells after `cell`, so that each pair of cells is met once, in the order of the cells.
    #[inline]
    pub fn after(&mut self, cell: usize) -> impl Iterator<Item = Range<usize>> {
        let own = ROWS / 2; // steps ascend, the middle one is the row of the cell
        (own..ROWS).map(move |row| {
            let run = self.row(row, cell);
            run.start.max(cell + 1)..run.end
        })
    }

    #[inline(always)]
    fn row(&mut self, row: usize, cell: usize) -> Range<usize> {
        let middle = self.keys[cell].wrapping_add_signed(self.row_steps[row]);
        let (first, last) = (middle.wrapping_sub(REACH), middle.wrapping_add(REACH));
        let mut start = self.cursors[row];
        while self.keys[start] < first {
            start += 1;
        }
        self.cursors[row] = start;
        let mut end = start;
        while self.keys[end] <= last {
            end += 1;
        }
        start..end
    }
}

/// How places become keys: cell index along x, then y, then z, with room for the reach around.
struct Lattice {
    min: [f64; 3],
    per_edge: f64,
    counts: [u64; 3],
}

impl Lattice {
    fn new<T: Coordinate>(points: &[[T; 3]], radius_m: f64) -> Option<Self> {
        let (min, max) = bounds(points);
        let per_edge = 3f64.sqrt() / (radius_m * SHRINK);
        let steps: [f64; 3] = std::array::from_fn(|k| (max[k] - min[k]) * per_edge);
        if !steps.iter().all(|&s| s < MOST_STEPS) {
            return None;
        }
        let counts = steps.map(|s| s as u64 + 1 + 2 * REACH);
        let cells = counts[0].checked_mul(counts[1])?.checked_mul(counts[2])?;
        (cells < 1 << 63).then_some(Self {
            min,
            per_edge,
            counts,
        })
    }

    #[inline]
    fn key<T: Coordinate>(&self, point: [T; 3]) -> u64 {
        let p = wide(point);
        let index = |k: usize| ((p[k] - self.min[k]) * self.per_edge) as u64 + REACH;
        (index(0) * self.counts[1] + index(1)) * self.counts[2] + index(2)
    }

    fn most_key(&self) -> u64 {
        self.counts.iter().product::<u64>() - 1
    }

    fn row_steps(&self) -> [i64; ROWS] {
        let [_, ny, nz] = self.counts.map(|n| n as i64);
        std::array::from_fn(|row| {
            let (dx, dy) = (row as i64 / 5 - 2, row as i64 % 5 - 2);
            (dx * ny + dy) * nz
        })
    }
}

fn bounds<T: Coordinate>(points: &[[T; 3]]) -> ([f64; 3], [f64; 3]) {
    let nothing = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    points.iter().fold(nothing, |(min, max), &p| {
        let p = wide(p);
        (
            std::array::from_fn(|k| min[k].min(p[k])),
            std::array::from_fn(|k| max[k].max(p[k])),
        )
    })
}

/// Sorts by key, equal keys staying in order: digits from the lowest up.
fn sort_by_key(entries: &mut Vec<(u64, u32)>, most_key: u64) {
    if entries.len() < FEW {
        entries.sort_unstable();
        return;
    }
    let bits = u64::BITS - most_key.leading_zeros();
    let mut sorted = vec![(0, 0); entries.len()];
    for shift in (0..bits).step_by(DIGIT_BITS as usize) {
        sort_by_digit(entries, &mut sorted, shift);
        std::mem::swap(entries, &mut sorted);
    }
}

fn sort_by_digit(from: &[(u64, u32)], to: &mut [(u64, u32)], shift: u32) {
    let digit = |entry: &(u64, u32)| (entry.0 >> shift) as usize & ((1 << DIGIT_BITS) - 1);
    let mut places = [0u32; 1 << DIGIT_BITS];
    for entry in from {
        places[digit(entry)] += 1;
    }
    let mut next = 0;
    for place in &mut places {
        next += std::mem::replace(place, next);
    }
    for entry in from {
        let place = &mut places[digit(entry)];
        to[*place as usize] = *entry;
        *place += 1;
    }
}

/// Keys of the cells and where each begins, with the end of the last.
fn cells(entries: &[(u64, u32)]) -> (Vec<u64>, Vec<u32>) {
    let (mut keys, mut starts) = (Vec::new(), vec![0]);
    for cell in entries.chunk_by(|a, b| a.0 == b.0) {
        keys.push(cell[0].0);
        starts.push(starts[starts.len() - 1] + cell.len() as u32);
    }
    keys.push(u64::MAX);
    (keys, starts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_comes_back_at_its_place() {
        let points: Vec<[f32; 3]> = (0..5000u32)
            .map(|i| [i.wrapping_mul(7919) % 100, i % 37, i % 11].map(|c| c as f32 * 0.3))
            .collect();
        let grid = Grid::new(&points, 0.5).unwrap();
        assert!((0..5000).all(|i| grid.points[i] == points[grid.order[i] as usize]));
        let mut order = grid.order.clone();
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(i, &o)| i == o as usize));
        assert!((0..grid.cells()).all(|c| grid.order[grid.members(c)].is_sorted()));
        assert!(grid.keys.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn the_neighbourhood_of_a_cell_is_five_by_five_by_five() {
        let edge = |i: u32| f64::from(i % 7) + 0.5;
        let points: Vec<[f64; 3]> = (0..343)
            .map(|i| [edge(i), edge(i / 7), edge(i / 49)])
            .collect();
        let grid = Grid::new(&points, 3f64.sqrt() * 1.000_001).unwrap();
        assert_eq!(grid.cells(), 343);
        let mut walk = grid.walk(0);
        let mut after = grid.walk(0);
        let (mut met, mut pairs) = (0, 0);
        for cell in 0..343 {
            met += walk.around(cell).iter().map(Range::len).sum::<usize>();
            pairs += after.after(cell).map(|run| run.len()).sum::<usize>();
        }
        let along = 3 + 4 + 5 + 5 + 5 + 4 + 3; // neighbours of 7 cells in a line
        assert_eq!(met, along * along * along);
        assert_eq!(pairs, (met - 343) / 2);
    }

    #[test]
    fn a_cloud_far_too_wide_for_its_radius_has_no_grid() {
        assert!(Grid::new(&[[0.0; 3], [1e9, 0.0, 0.0]], 1.0).is_none());
        assert!(Grid::new(&[[-1e308; 3], [1e308; 3]], 1.0).is_none());
        assert!(Grid::new(&[[0.0; 3], [1e8, 1e8, 1e8]], 2.0).is_none());
    }
}
