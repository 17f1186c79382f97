//! Clusters where every point has a radius of its own, on a grid of cells of the largest.

use std::ops::Range;

use rayon::prelude::*;

use super::NOISE;
use super::components::Components;
use super::grid::{Grid, Reach};
use crate::neighbors::{Coordinate, squared_distance};

/// Radii may differ by so much: cells hold the more strangers of a point the smaller its radius is.
const MOST_RATIO: f64 = 4.0;
/// Distances computed between two looks at whether the count is full.
const BATCH: usize = 16;

/// Labels of `points`, finite all; `None` where radii differ too much or the cloud is too large for a grid.
pub fn dbscan_graded<T: Coordinate>(
    points: &[[T; 3]],
    radii_m: &[f64],
    needed: usize,
) -> Option<Vec<i32>> {
    let most_m = radii_m.iter().copied().reduce(f64::max)?;
    let least_m = radii_m.iter().copied().fold(most_m, f64::min);
    if most_m > MOST_RATIO * least_m {
        return None;
    }
    let grid = Grid::new(points, most_m)?;
    let limit = |place: &u32| radii_m[*place as usize] * radii_m[*place as usize];
    let scene = Scene {
        limits: grid.order.iter().map(limit).collect(),
        grid,
        needed,
    };
    let cores = scene.find_cores();
    let core_labels = scene.number(&scene.connect(&cores), &cores);
    let sorted_labels = scene.reach_borders(&cores, &core_labels);
    Some(scene.grid.unsorted(&sorted_labels))
}

struct Scene<T> {
    grid: Grid<T>,
    /// Squared radius of every sorted point.
    limits: Vec<f64>,
    needed: usize,
}

impl<T: Coordinate> Scene<T> {
    /// One value per sorted point from the runs of points around it, blocks of bricks in parallel.
    fn per_point<V: Send + Clone>(
        &self,
        empty: V,
        value: impl Fn(usize, &[Range<usize>]) -> V + Sync,
    ) -> Vec<V> {
        let mut values = vec![empty; self.grid.points.len()];
        let blocks = self.grid.blocks();
        let pieces = self.grid.split(&mut values, &blocks);
        let work: Vec<_> = blocks.into_iter().zip(pieces).collect();
        work.into_par_iter().for_each(|(block, piece)| {
            let first = self.grid.members_of(&block).start;
            let mut runs = Vec::new();
            self.grid.walk(block, |cell, around| {
                let members = self.grid.members(cell.number);
                runs.clear();
                runs.push(members.clone());
                around.any(cell, |other| {
                    append(&mut runs, self.grid.members(other));
                    false
                });
                for i in members {
                    piece[i - first] = value(i, &runs);
                }
            });
        });
        values
    }

    /// Whether each sorted point is a core.
    fn find_cores(&self) -> Vec<bool> {
        self.per_point(false, |i, runs| {
            let (point, limit) = (self.grid.points[i], self.limits[i]);
            let is_near = |q: &&[T; 3]| squared_distance(point, **q) <= limit;
            let mut count = 0;
            for run in runs {
                for batch in self.grid.points[run.clone()].chunks(BATCH) {
                    count += batch.iter().filter(is_near).count();
                    if count >= self.needed {
                        return true;
                    }
                }
            }
            false
        })
    }

    /// Joins cores whose distance is within the radii of both.
    fn connect(&self, cores: &[bool]) -> Components {
        let components = Components::new(self.grid.points.len());
        self.grid.blocks().into_par_iter().for_each(|block| {
            self.grid.walk(block, |cell, around| {
                let members = self.grid.members(cell.number);
                for i in members.clone().filter(|&i| cores[i]) {
                    self.connect_one(i, i + 1..members.end, cores, &components);
                }
                for reach in [Reach::Touching, Reach::Farther] {
                    around.each_after(cell, reach, |other| {
                        let others = self.grid.members(other);
                        for i in members.clone().filter(|&i| cores[i]) {
                            self.connect_one(i, others.clone(), cores, &components);
                        }
                    });
                }
            });
        });
        components
    }

    fn connect_one(&self, i: usize, others: Range<usize>, cores: &[bool], components: &Components) {
        let (point, limit) = (self.grid.points[i], self.limits[i]);
        let mut root = components.root(i as u32);
        for j in others.filter(|&j| cores[j]) {
            let is_mutual =
                || squared_distance(point, self.grid.points[j]) <= limit.min(self.limits[j]);
            if !components.is_under(root, j as u32) && is_mutual() {
                components.join(i as u32, j as u32);
                root = components.root(root);
            }
        }
    }

    /// Label of every sorted core: components in the order of their smallest core index.
    fn number(&self, components: &Components, cores: &[bool]) -> Vec<i32> {
        let all = || (0..cores.len()).filter(|&i| cores[i]);
        let mut first = vec![u32::MAX; cores.len()];
        for i in all() {
            let root = components.root(i as u32) as usize;
            first[root] = first[root].min(self.grid.order[i]);
        }
        let mut roots: Vec<usize> = all().filter(|&i| first[i] != u32::MAX).collect();
        roots.sort_unstable_by_key(|&root| first[root]);
        let mut labels = vec![NOISE; cores.len()];
        for (label, &root) in roots.iter().enumerate() {
            labels[root] = label as i32;
        }
        // A root is the smallest of its component, so its label is never overwritten too early.
        for i in all() {
            labels[i] = labels[components.root(i as u32) as usize];
        }
        labels
    }

    /// The label of a core, to others the lowest among those of cores whose radius reaches them.
    fn reach_borders(&self, cores: &[bool], core_labels: &[i32]) -> Vec<i32> {
        self.per_point(NOISE, |i, runs| {
            if cores[i] {
                return core_labels[i];
            }
            let point = self.grid.points[i];
            let reaches = |&j: &usize| {
                cores[j] && squared_distance(self.grid.points[j], point) <= self.limits[j]
            };
            let around = runs.iter().cloned().flatten();
            around
                .filter(reaches)
                .map(|j| core_labels[j])
                .min()
                .unwrap_or(NOISE)
        })
    }
}

/// Adds a run of points, to the last one where it goes on there.
fn append(runs: &mut Vec<Range<usize>>, next: Range<usize>) {
    match runs.last_mut() {
        Some(last) if last.end == next.start => last.end = next.end,
        _ => runs.push(next),
    }
}
