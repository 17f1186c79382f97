//! Clusters where all points have the same radius, on a grid of cells.

use std::ops::Range;

use rayon::prelude::*;

use super::NOISE;
use super::components::Components;
use super::cores::CellCores;
use super::grid::{Around, Cell, Grid, Reach};
use crate::neighbors::{Coordinate, squared_distance};
use crate::simd::{Kernel, vectorized};

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
    let in_cells = scene.cores_in_cells(&cores);
    let components = scene.connect(&cores, &in_cells);
    let cell_labels = scene.number(&components, &in_cells);
    drop(in_cells);
    let sorted_labels = scene.label(&cores, &cell_labels);
    Some(scene.grid.unsorted(&sorted_labels))
}

struct Scene<T> {
    grid: Grid<T>,
    limit: f64,
    needed: usize,
}

impl<T: Coordinate> Scene<T> {
    /// Fills one value per sorted point, blocks of bricks in parallel.
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
            vectorized(FindCores {
                scene: self,
                block,
                cores,
            });
        })
    }

    /// Counts the neighbours of the points of a cell, nearest cells first, until all have enough.
    #[inline(always)]
    fn count_around(&self, cell: Cell, around: &Around<'_>, counts: &mut Vec<usize>) {
        let members = self.grid.members(cell.number);
        counts.clear();
        counts.resize(members.len(), members.len()); // all of the cell, and the point itself
        around.any(cell, |other| {
            let others = &self.grid.points[self.grid.members(other)];
            let mut all_full = true;
            for (point, count) in self.grid.points[members.clone()].iter().zip(&mut *counts) {
                self.count_among(*point, others, count);
                all_full &= *count >= self.needed;
            }
            all_full
        });
    }

    #[inline(always)]
    fn count_among(&self, point: [T; 3], others: &[[T; 3]], count: &mut usize) {
        for batch in others.chunks(BATCH) {
            if *count >= self.needed {
                return;
            }
            for other in batch {
                *count += usize::from(squared_distance(point, *other) <= self.limit);
            }
        }
    }

    /// The cores of every cell.
    fn cores_in_cells(&self, cores: &[bool]) -> Vec<CellCores<T>> {
        let of = |cell: usize| CellCores::of(&self.grid.points, self.grid.members(cell), cores);
        (0..self.grid.cells()).map(of).collect()
    }

    /// Joins cells that have cores within the radius of each other.
    fn connect(&self, cores: &[bool], in_cells: &[CellCores<T>]) -> Components {
        let components = Components::new(self.grid.cells());
        // Cells that touch come first: nearly all others hang together by then and need no distances.
        for reach in [Reach::Touching, Reach::Farther] {
            self.grid.blocks().into_par_iter().for_each(|block| {
                vectorized(Connect {
                    scene: self,
                    block,
                    reach,
                    cores,
                    in_cells,
                    components: &components,
                });
            });
        }
        components
    }

    /// Whether two cells have a pair of cores within the radius.
    #[inline(always)]
    fn cells_touch(&self, cells: [usize; 2], cores: &[bool], in_cells: &[CellCores<T>]) -> bool {
        let [a, b] = cells.map(|cell| &in_cells[cell]);
        if self.is_near(a.first as usize, b.first as usize) {
            return true; // mostly the first pair tells
        }
        if a.squared_gap(b) > self.limit {
            return false;
        }
        let [a_members, b_members] = cells.map(|cell| self.grid.members(cell));
        if a_members.len() * b_members.len() <= FEW_PAIRS {
            return self.points_touch(a_members, b_members, cores);
        }
        // Only points that are near the cores of the other cell can be in such a pair.
        let a_near = self.near(a_members, b, cores);
        let b_near = self.near(b_members, a, cores);
        a_near
            .iter()
            .any(|&i| b_near.iter().any(|&j| self.is_near(i, j)))
    }

    #[inline(always)]
    fn is_near(&self, i: usize, j: usize) -> bool {
        squared_distance(self.grid.points[i], self.grid.points[j]) <= self.limit
    }

    #[inline(always)]
    fn points_touch(&self, a: Range<usize>, b: Range<usize>, cores: &[bool]) -> bool {
        a.filter(|&i| cores[i])
            .any(|i| b.clone().any(|j| cores[j] && self.is_near(i, j)))
    }

    /// Cores among `points` within the radius of the box around others.
    fn near(&self, points: Range<usize>, others: &CellCores<T>, cores: &[bool]) -> Vec<usize> {
        let is_near = |&i: &usize| others.squared_gap_to(self.grid.points[i]) <= self.limit;
        points.filter(|&i| cores[i]).filter(is_near).collect()
    }

    /// Label of the cores of every cell: components in the order of their smallest core index.
    fn number(&self, components: &Components, in_cells: &[CellCores<T>]) -> Vec<i32> {
        let with_cores = || (0..in_cells.len()).filter(|&cell| in_cells[cell].has_any());
        let mut first_of_root = vec![u32::MAX; in_cells.len()];
        for cell in with_cores() {
            let first = &mut first_of_root[components.root(cell as u32) as usize];
            *first = self.grid.order[in_cells[cell].first as usize].min(*first);
        }
        let is_root = |&cell: &usize| first_of_root[cell] != u32::MAX;
        let mut roots: Vec<usize> = with_cores().filter(is_root).collect();
        roots.sort_unstable_by_key(|&root| first_of_root[root]);
        let mut labels = vec![NOISE; in_cells.len()];
        for (label, &root) in roots.iter().enumerate() {
            labels[root] = label as i32;
        }
        // A root is the smallest cell of its component, so its label is never overwritten too early.
        for cell in with_cores() {
            labels[cell] = labels[components.root(cell as u32) as usize];
        }
        labels
    }

    /// Label of every sorted point: that of its cell for a core, else of the lowest cluster in reach.
    fn label(&self, cores: &[bool], cell_labels: &[i32]) -> Vec<i32> {
        self.per_point(NOISE, |block, labels| {
            vectorized(Label {
                scene: self,
                block,
                cores,
                cell_labels,
                labels,
            });
        })
    }

    /// Lowest label of the cores that reach a point of a cell.
    #[inline(always)]
    fn reached_by(
        &self,
        place: usize,
        own: Cell,
        around: &Around<'_>,
        cores: &[bool],
        cell_labels: &[i32],
    ) -> i32 {
        let point = self.grid.points[place];
        // All points of one cell are neighbours.
        let mut lowest = Some(cell_labels[own.number]).filter(|label| *label != NOISE);
        around.each(own, |cell| {
            let label = cell_labels[cell];
            if label == NOISE || lowest.is_some_and(|lowest| lowest <= label) {
                return;
            }
            let is_near =
                |j: usize| cores[j] && squared_distance(point, self.grid.points[j]) <= self.limit;
            if self.grid.members(cell).any(is_near) {
                lowest = Some(label);
            }
        });
        lowest.unwrap_or(NOISE)
    }
}

/// Finds the cores of a block.
struct FindCores<'a, T> {
    scene: &'a Scene<T>,
    block: Range<usize>,
    cores: &'a mut [bool],
}

impl<T: Coordinate> Kernel for FindCores<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self {
            scene,
            block,
            cores,
        } = self;
        let first = scene.grid.members_of(&block).start;
        let mut counts = Vec::new();
        scene.grid.walk(block, |cell, around| {
            let members = scene.grid.members(cell.number);
            let own = &mut cores[members.start - first..members.end - first];
            if members.len() >= scene.needed {
                return own.fill(true);
            }
            scene.count_around(cell, around, &mut counts);
            for (core, count) in own.iter_mut().zip(&counts) {
                *core = *count >= scene.needed;
            }
        });
    }
}

/// Joins the cells of a block with those that follow them.
struct Connect<'a, T> {
    scene: &'a Scene<T>,
    block: Range<usize>,
    reach: Reach,
    cores: &'a [bool],
    in_cells: &'a [CellCores<T>],
    components: &'a Components,
}

impl<T: Coordinate> Kernel for Connect<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let (scene, components) = (self.scene, self.components);
        scene.grid.walk(self.block, |cell, around| {
            let has_cores = |cell: usize| self.in_cells[cell].has_any();
            if !has_cores(cell.number) {
                return;
            }
            let mut root = components.root(cell.number as u32);
            around.each_after(cell, self.reach, |other| {
                let is_new = has_cores(other) && !components.is_under(root, other as u32);
                let pair = [cell.number, other];
                if is_new && scene.cells_touch(pair, self.cores, self.in_cells) {
                    components.join(cell.number as u32, other as u32);
                    root = components.root(root);
                }
            });
        });
    }
}

/// Labels the points of a block.
struct Label<'a, T> {
    scene: &'a Scene<T>,
    block: Range<usize>,
    cores: &'a [bool],
    cell_labels: &'a [i32],
    labels: &'a mut [i32],
}

impl<T: Coordinate> Kernel for Label<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let (scene, cores, cell_labels) = (self.scene, self.cores, self.cell_labels);
        let first = scene.grid.members_of(&self.block).start;
        let labels = self.labels;
        scene.grid.walk(self.block, |cell, around| {
            for place in scene.grid.members(cell.number) {
                labels[place - first] = match cores[place] {
                    true => cell_labels[cell.number],
                    false => scene.reached_by(place, cell, around, cores, cell_labels),
                };
            }
        });
    }
}
