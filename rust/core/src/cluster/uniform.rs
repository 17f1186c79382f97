//! Clusters where all points have the same radius, on a grid of cells.

use std::ops::Range;

use rayon::prelude::*;

use super::NOISE;
use super::components::Components;
use super::grid::{Grid, Walk};
use crate::neighbors::{Coordinate, squared_distance};

/// Distances computed between two looks at whether the count is full.
const BATCH: usize = 16;
/// Pairs of points up to which two cells are compared without looking at their boxes first.
const FEW_PAIRS: usize = 64;

/// Labels of `points`, finite all; `None` where the cloud is too large against the radius for a grid.
///
/// The points of one cell are neighbours of each other. So a full cell is all core, the cores of a
/// cell are in one cluster, and only cells need to be joined.
pub fn dbscan_uniform<T: Coordinate>(
    points: &[[T; 3]],
    radius_m: f64,
    needed: usize,
) -> Option<Vec<i32>> {
    if points.is_empty() {
        return Some(Vec::new());
    }
    let scene = Scene {
        grid: Grid::new(points, radius_m)?,
        limit: radius_m * radius_m,
        needed,
    };
    let cores = scene.find_cores();
    let cell_labels = scene.number(&scene.connect(&cores), &cores);
    let sorted_labels = scene.label(&cores, &cell_labels);
    Some(scene.grid.unsorted(&sorted_labels))
}

struct Scene<T> {
    grid: Grid<T>,
    limit: f64,
    needed: usize,
}

impl<T: Coordinate> Scene<T> {
    /// Fills one value per sorted point, blocks of cells in parallel.
    fn per_point<V: Send + Clone>(
        &self,
        empty: V,
        fill: impl Fn(Range<usize>, &mut [V]) + Sync,
    ) -> Vec<V> {
        let mut values = vec![empty; self.grid.points.len()];
        let blocks = self.grid.blocks();
        let pieces = self.grid.split(&mut values, &blocks);
        let work: Vec<_> = blocks.into_iter().zip(pieces).collect();
        work.into_par_iter()
            .for_each(|(block, piece)| fill(block, piece));
        values
    }

    /// Whether each sorted point is a core.
    fn find_cores(&self) -> Vec<bool> {
        self.per_point(false, |block, cores| {
            let first = self.grid.members(block.start).start;
            let mut walk = self.grid.walk(block.start);
            let mut counts = Vec::new();
            for cell in block {
                let members = self.grid.members(cell);
                if members.len() < self.needed {
                    self.count_around(cell, &mut walk, &mut counts);
                } else {
                    counts.clear();
                    counts.resize(members.len(), self.needed);
                }
                for (i, count) in members.zip(&counts) {
                    cores[i - first] = *count >= self.needed;
                }
            }
        })
    }

    /// Counts the neighbours of the points of a cell, nearest rows first, until all have enough.
    fn count_around(&self, cell: usize, walk: &mut Walk<'_>, counts: &mut Vec<usize>) {
        let members = self.grid.members(cell);
        counts.clear();
        counts.resize(members.len(), members.len()); // all of the cell, and the point itself
        let mut rows = walk.rows(cell);
        let own = rows.next().unwrap_or(cell..cell + 1);
        let runs = [own.start..cell, cell + 1..own.end].into_iter().chain(rows);
        for run in runs.filter(|run| !run.is_empty()) {
            let others = &self.grid.points[self.grid.members_of(&run)];
            let mut all_full = true;
            for (i, count) in members.clone().zip(counts.iter_mut()) {
                self.count_among(self.grid.points[i], others, count);
                all_full &= *count >= self.needed;
            }
            if all_full {
                return;
            }
        }
    }

    fn count_among(&self, point: [T; 3], others: &[[T; 3]], count: &mut usize) {
        for batch in others.chunks(BATCH) {
            if *count >= self.needed {
                return;
            }
            let is_near = |q: &&[T; 3]| squared_distance(point, **q) <= self.limit;
            *count += batch.iter().filter(is_near).count();
        }
    }

    /// Joins cells that have cores within the radius of each other.
    fn connect(&self, cores: &[bool]) -> Components {
        let components = Components::new(self.grid.cells());
        let has_core: Vec<bool> = (0..self.grid.cells())
            .map(|cell| self.grid.members(cell).any(|i| cores[i]))
            .collect();
        self.grid.blocks().into_par_iter().for_each(|block| {
            let mut walk = self.grid.walk(block.start);
            for cell in block.filter(|&cell| has_core[cell]) {
                let mut root = components.root(cell as u32);
                for run in walk.after(cell) {
                    for other in run.filter(|&other| has_core[other]) {
                        let is_new = !components.is_under(root, other as u32);
                        if is_new && self.cells_touch(cell, other, cores) {
                            components.join(cell as u32, other as u32);
                            root = components.root(root);
                        }
                    }
                }
            }
        });
        components
    }

    /// Whether two cells have a pair of cores within the radius.
    fn cells_touch(&self, a: usize, b: usize, cores: &[bool]) -> bool {
        let (a, b) = (self.grid.members(a), self.grid.members(b));
        let is_near = |i: usize, j: usize| {
            squared_distance(self.grid.points[i], self.grid.points[j]) <= self.limit
        };
        if a.len() * b.len() <= FEW_PAIRS {
            return a
                .filter(|&i| cores[i])
                .any(|i| b.clone().any(|j| cores[j] && is_near(i, j)));
        }
        // Only points that are near the box of the other cell's cores can be in such a pair.
        let a_near = self.near_box(&a, &b, cores);
        let b_near = self.near_box(&b, &a, cores);
        a_near
            .iter()
            .any(|&i| b_near.iter().any(|&j| is_near(i, j)))
    }

    /// Cores among `points` within the radius of the box around the cores among `others`.
    fn near_box(&self, points: &Range<usize>, others: &Range<usize>, cores: &[bool]) -> Vec<usize> {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for j in others.clone().filter(|&j| cores[j]) {
            for k in 0..3 {
                low[k] = low[k].min(self.grid.points[j][k].into());
                high[k] = high[k].max(self.grid.points[j][k].into());
            }
        }
        let is_near = |&i: &usize| {
            let p = crate::neighbors::wide(self.grid.points[i]);
            let on_box = std::array::from_fn(|k| p[k].clamp(low[k], high[k]));
            squared_distance(p, on_box) <= self.limit
        };
        points
            .clone()
            .filter(|&i| cores[i])
            .filter(is_near)
            .collect()
    }

    /// Label of the cores of every cell: components in the order of their smallest core index.
    fn number(&self, components: &Components, cores: &[bool]) -> Vec<i32> {
        let cells = 0..self.grid.cells();
        let first_core = |cell: usize| self.grid.members(cell).find(|&i| cores[i]);
        let first_of_root = {
            let mut first = vec![u32::MAX; cells.len()];
            for cell in cells.clone() {
                if let Some(i) = first_core(cell) {
                    let root = components.root(cell as u32) as usize;
                    first[root] = first[root].min(self.grid.order[i]);
                }
            }
            first
        };
        let is_root = |&cell: &usize| first_of_root[cell] != u32::MAX;
        let mut roots: Vec<usize> = cells.clone().filter(is_root).collect();
        roots.sort_unstable_by_key(|&root| first_of_root[root]);
        let mut labels = vec![NOISE; cells.len()];
        for (label, &root) in roots.iter().enumerate() {
            labels[root] = label as i32;
        }
        // A root is the smallest cell of its component, so its label is never overwritten too early.
        for cell in cells {
            labels[cell] = labels[components.root(cell as u32) as usize];
        }
        labels
    }

    /// Label of every sorted point: that of its cell for a core, else of the lowest cluster in reach.
    fn label(&self, cores: &[bool], cell_labels: &[i32]) -> Vec<i32> {
        self.per_point(NOISE, |block, labels| {
            let first = self.grid.members(block.start).start;
            let mut walk = self.grid.walk(block.start);
            for cell in block {
                let members = self.grid.members(cell);
                if members.clone().all(|i| cores[i]) {
                    labels[members.start - first..members.end - first].fill(cell_labels[cell]);
                    continue;
                }
                let rows = walk.around(cell);
                for i in members {
                    labels[i - first] = match cores[i] {
                        true => cell_labels[cell],
                        false => self.reached_by(i, rows, cores, cell_labels),
                    };
                }
            }
        })
    }

    fn reached_by(
        &self,
        i: usize,
        rows: &[Range<usize>],
        cores: &[bool],
        cell_labels: &[i32],
    ) -> i32 {
        let point = self.grid.points[i];
        let mut lowest = i32::MAX;
        for cell in rows.iter().cloned().flatten() {
            let label = cell_labels[cell];
            if label == NOISE || label >= lowest {
                continue;
            }
            let is_near =
                |j: usize| cores[j] && squared_distance(point, self.grid.points[j]) <= self.limit;
            if self.grid.members(cell).any(is_near) {
                lowest = label;
            }
        }
        if lowest == i32::MAX { NOISE } else { lowest }
    }
}
