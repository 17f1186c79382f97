//! A cloud sorted into cells so small that all points of one cell are neighbours of each other.

use std::ops::Range;

use super::bricks::{AFTER, PLACES, TOUCHED, Touched};
use super::lattice::Lattice;
use super::radix::sort_by_key;
use crate::neighbors::Coordinate;

/// Bricks handed to a thread at once.
const BLOCK: usize = 512;

/// Points sorted by cell, cells by brick.
pub struct Grid<T> {
    /// The points, cell by cell, within a cell in the order of the cloud.
    pub points: Vec<[T; 3]>,
    /// Where each sorted point stands in the cloud.
    pub order: Vec<u32>,
    starts: Vec<u32>, // of the cells, and the end of the last
    bricks: Bricks,
    row_steps: [i64; 9],
}

/// Bricks that hold points, column by column; behind them one without points.
#[derive(Default)]
struct Bricks {
    numbers: Vec<u64>,  // ascending; that of the last is above all
    occupied: Vec<u64>, // which cells hold points
    firsts: Vec<u32>,   // first cell
}

/// A cell that holds points.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    /// Its number among those that hold points.
    pub number: usize,
    place: u32, // in its brick
}

impl<T: Coordinate> Grid<T> {
    /// Sorts finite `points` into cells of edge `radius_m / sqrt(3)`; `None` where the cloud is so
    /// large against the radius that cells cannot be numbered.
    pub fn new(points: &[[T; 3]], radius_m: f64) -> Option<Self> {
        let lattice = Lattice::new(points, radius_m)?;
        let bits = lattice.key_bits();
        let index_bits = usize::BITS - points.len().leading_zeros();
        let keys = || points.iter().map(|&point| lattice.key(point));
        if bits + index_bits > u64::BITS {
            let mut entries: Vec<(u64, u32)> = keys().zip(0..).collect();
            sort_by_key(&mut entries, bits, |entry| entry.0);
            return Some(Self::gather(points, &lattice, &entries, |entry| *entry));
        }
        // Key and index share a word: half the memory to move.
        let mut entries: Vec<u64> = keys()
            .zip(0..)
            .map(|(key, i)| key << index_bits | i)
            .collect();
        sort_by_key(&mut entries, bits, |entry| entry >> index_bits);
        let parts = |entry: &u64| {
            (
                entry >> index_bits,
                (entry & ((1 << index_bits) - 1)) as u32,
            )
        };
        Some(Self::gather(points, &lattice, &entries, parts))
    }

    /// Takes sorted entries apart into key and index.
    fn gather<E>(
        points: &[[T; 3]],
        lattice: &Lattice,
        entries: &[E],
        parts: impl Fn(&E) -> (u64, u32),
    ) -> Self {
        let cells = || entries.chunk_by(|a, b| parts(a).0 == parts(b).0);
        let bricks = entries
            .chunk_by(|a, b| parts(a).0 / PLACES == parts(b).0 / PLACES)
            .count();
        let mut grid = Self {
            points: entries
                .iter()
                .map(|entry| points[parts(entry).1 as usize])
                .collect(),
            order: entries.iter().map(|entry| parts(entry).1).collect(),
            starts: Vec::with_capacity(cells().count() + 1),
            bricks: Bricks::with_capacity(bricks + 1),
            row_steps: lattice.row_steps(),
        };
        let mut start = 0;
        for cell in cells() {
            grid.bricks
                .push(parts(&cell[0]).0, grid.starts.len() as u32);
            grid.starts.push(start);
            start += cell.len() as u32;
        }
        grid.bricks.close(grid.starts.len() as u32);
        grid.starts.push(start);
        grid
    }

    /// Number of cells that hold points.
    pub fn cells(&self) -> usize {
        self.starts.len() - 1
    }

    /// Sorted places of the points of a cell.
    #[inline(always)]
    pub fn members(&self, cell: usize) -> Range<usize> {
        self.starts[cell] as usize..self.starts[cell + 1] as usize
    }

    /// What sorted points have, in the order in which the points came.
    pub fn unsorted(&self, sorted: &[i32]) -> Vec<i32> {
        let mut values = vec![0; sorted.len()];
        for (&place, value) in self.order.iter().zip(sorted) {
            values[place as usize] = *value;
        }
        values
    }

    /// The bricks in pieces for threads.
    pub fn blocks(&self) -> Vec<Range<usize>> {
        let count = self.bricks.numbers.len() - 1;
        let starts = (0..count).step_by(BLOCK);
        starts.map(|s| s..(s + BLOCK).min(count)).collect()
    }

    /// Sorted places of the points of consecutive bricks.
    pub fn members_of(&self, bricks: &Range<usize>) -> Range<usize> {
        let start = |brick: usize| self.starts[self.bricks.firsts[brick] as usize] as usize;
        start(bricks.start)..start(bricks.end)
    }

    /// One value per sorted point, cut at the same places as the blocks of bricks.
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

    /// Calls `visit` with the cells of consecutive bricks and what tells their neighbourhoods.
    #[inline(always)]
    pub fn walk(&self, bricks: Range<usize>, mut visit: impl FnMut(Cell, &Around<'_>)) {
        let mut around = Around::new(&self.bricks, &self.row_steps, bricks.start);
        for brick in bricks {
            around.enter(brick);
            let first = self.bricks.firsts[brick] as usize;
            let (mut number, mut left) = (first, self.bricks.occupied[brick]);
            while left != 0 {
                let place = left.trailing_zeros();
                visit(Cell { number, place }, &around);
                left &= left - 1;
                number += 1;
            }
        }
    }
}

impl Bricks {
    fn with_capacity(count: usize) -> Self {
        Self {
            numbers: Vec::with_capacity(count),
            occupied: Vec::with_capacity(count),
            firsts: Vec::with_capacity(count),
        }
    }

    /// Adds a cell by its key; keys ascend.
    fn push(&mut self, key: u64, cell: u32) {
        let number = key / PLACES;
        if self.numbers.last() != Some(&number) {
            self.numbers.push(number);
            self.occupied.push(0);
            self.firsts.push(cell);
        }
        if let Some(occupied) = self.occupied.last_mut() {
            *occupied |= 1 << (key % PLACES);
        }
    }

    fn close(&mut self, cells: u32) {
        self.numbers.push(u64::MAX);
        self.occupied.push(0);
        self.firsts.push(cells);
    }
}

/// The bricks around one: keys ascend, so that each row's start only moves forward.
pub struct Around<'g> {
    bricks: &'g Bricks,
    row_steps: &'g [i64; 9],
    cursors: [usize; 9],
    occupied: [u64; 27],
    firsts: [u32; 27],
}

impl<'g> Around<'g> {
    fn new(bricks: &'g Bricks, row_steps: &'g [i64; 9], first: usize) -> Self {
        let cursor = |step: &i64| {
            let row_start = bricks.numbers[first]
                .wrapping_add_signed(*step)
                .wrapping_sub(1);
            bricks.numbers.partition_point(|&number| number < row_start)
        };
        Self {
            bricks,
            row_steps,
            cursors: std::array::from_fn(|row| cursor(&row_steps[row])),
            occupied: [0; 27],
            firsts: [0; 27],
        }
    }

    /// Looks around another brick; calls must name later and later ones.
    #[inline(always)]
    fn enter(&mut self, brick: usize) {
        let numbers = &self.bricks.numbers[..];
        for row in 0..9 {
            let middle = numbers[brick].wrapping_add_signed(self.row_steps[row]);
            let mut at = self.cursors[row];
            while numbers[at] < middle.wrapping_sub(1) {
                at += 1;
            }
            self.cursors[row] = at;
            for (place, wanted) in (0..3).zip(middle.wrapping_sub(1)..) {
                let is_there = numbers[at] == wanted;
                let occupied = if is_there {
                    self.bricks.occupied[at]
                } else {
                    0
                };
                self.occupied[3 * row + place] = occupied;
                self.firsts[3 * row + place] = self.bricks.firsts[at];
                at += usize::from(is_there);
            }
        }
    }

    /// Whether `stop` says so of a cell that touches `cell`, or of one of the others within reach after them.
    #[inline(always)]
    pub fn any(&self, cell: Cell, mut stop: impl FnMut(usize) -> bool) -> bool {
        let all = &TOUCHED[cell.place as usize];
        self.any_of(all, |t| t.touching, &mut stop) || self.any_of(all, |t| t.farther, &mut stop)
    }

    /// Calls `visit` with every other cell within reach.
    #[inline(always)]
    pub fn each(&self, cell: Cell, mut visit: impl FnMut(usize)) {
        let all = &TOUCHED[cell.place as usize];
        self.any_of(all, |t| t.touching | t.farther, &mut |other| {
            visit(other);
            false
        });
    }

    /// Calls `visit` with those of the cells within `reach` that have a higher number, so that each pair of
    /// cells is met once.
    #[inline(always)]
    pub fn each_after(&self, cell: Cell, reach: Reach, mut visit: impl FnMut(usize)) {
        let reached = |t: &Touched| match reach {
            Reach::Touching => t.touching,
            Reach::Farther => t.farther,
        };
        self.any_of(&AFTER[cell.place as usize], reached, &mut |other| {
            visit(other);
            false
        });
    }

    #[inline(always)]
    fn any_of(
        &self,
        touched: &[Touched],
        wanted: impl Fn(&Touched) -> u64,
        stop: &mut impl FnMut(usize) -> bool,
    ) -> bool {
        for t in touched {
            let occupied = self.occupied[t.brick];
            let mut found = occupied & wanted(t);
            while found != 0 {
                let before = occupied & (found ^ (found - 1)) >> 1;
                if stop((self.firsts[t.brick] + before.count_ones()) as usize) {
                    return true;
                }
                found &= found - 1;
            }
        }
        false
    }
}

/// Some of the cells that may hold neighbours of a cell.
#[derive(Debug, Clone, Copy)]
pub enum Reach {
    /// Those that touch it.
    Touching,
    /// The others.
    Farther,
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
        assert!(grid.bricks.numbers.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn keys_that_fill_a_word_are_sorted_as_well() {
        // 2^26 cells on two axes and many on the third: no room for an index beside the key.
        let points: Vec<[f64; 3]> = (0..600u32)
            .map(|i| [i % 7, i.wrapping_mul(7919) % 11, i % 5].map(|c| f64::from(c) * 1e6))
            .collect();
        let grid = Grid::new(&points, 6.0).unwrap();
        assert!((0..600).all(|i| grid.points[i] == points[grid.order[i] as usize]));
        assert_eq!(grid.cells(), 7 * 11 * 5);
        assert!((0..grid.cells()).all(|c| grid.order[grid.members(c)].is_sorted()));
    }

    #[test]
    fn the_neighbourhood_of_a_cell_is_five_by_five_by_five() {
        let edge = |i: u32| f64::from(i % 7) + 0.5;
        let points: Vec<[f64; 3]> = (0..343)
            .map(|i| [edge(i), edge(i / 7), edge(i / 49)])
            .collect();
        let grid = Grid::new(&points, 3f64.sqrt() * 1.000_001).unwrap();
        assert_eq!(grid.cells(), 343);
        let (mut met, mut asked, mut pairs) = (0, 0, 0);
        for block in grid.blocks() {
            grid.walk(block, |cell, around| {
                let place = |number: usize| grid.points[grid.members(number).start];
                let (mut count, own) = (0, place(cell.number));
                around.each(cell, |other| {
                    let other = place(other);
                    assert!((0..3).all(|k| (other[k] - own[k]).abs() < 2.5));
                    count += 1;
                });
                met += count;
                around.any(cell, |_| {
                    asked += 1;
                    false
                });
                for reach in [Reach::Touching, Reach::Farther] {
                    around.each_after(cell, reach, |other| {
                        pairs += usize::from(other > cell.number);
                    });
                }
            });
        }
        let along = 3 + 4 + 5 + 5 + 5 + 4 + 3; // neighbours of 7 cells in a line
        assert_eq!(met, along * along * along - 343);
        assert_eq!((asked, pairs), (met, met / 2));
    }
}
