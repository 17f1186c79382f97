//! Clusters where every point has a radius of its own, by tree search: for radii so different that the cells
//! of [`super::graded`] would be too large for most.

use std::sync::atomic::{AtomicI32, Ordering::Relaxed};

use rayon::prelude::*;

use super::NOISE;
use super::components::Components;
use crate::error::ClusterError;
use crate::neighbors::{Coordinate, Neighbors, squared_distance};

/// Points handed to a thread at once.
const BLOCK: usize = 256;

/// Three passes over the cloud, none of which keeps neighbours: who is a core, which cores connect,
/// whom do cores reach.
pub fn dbscan_varied<T: Coordinate>(
    points: &[[T; 3]],
    radius_m: impl Fn(usize) -> f64 + Sync,
    needed: usize,
) -> Result<Vec<i32>, ClusterError> {
    let search = Neighbors::new(points)?;
    let cores = find_cores(points, &search, &radius_m, needed);
    let components = connect(points, &search, &radius_m, &cores);
    let labels = number_cores(&components, &cores);
    Ok(reach_borders(points, &search, &radius_m, &cores, labels))
}

fn find_cores<T: Coordinate>(
    points: &[[T; 3]],
    search: &Neighbors<'_, T>,
    radius_m: &(impl Fn(usize) -> f64 + Sync),
    needed: usize,
) -> Vec<bool> {
    let is_core = |i: usize| {
        let mut count = 0;
        search.for_each_within(points[i], radius_m(i), |_| count += 1);
        count >= needed
    };
    let indices = (0..points.len()).into_par_iter().with_min_len(BLOCK);
    indices.map(is_core).collect()
}

/// Joins cores whose distance is within the radii of both; each pair is seen from its lower index.
fn connect<T: Coordinate>(
    points: &[[T; 3]],
    search: &Neighbors<'_, T>,
    radius_m: &(impl Fn(usize) -> f64 + Sync),
    cores: &[bool],
) -> Components {
    let components = Components::new(points.len());
    let connect_one = |i: usize| {
        search.for_each_within(points[i], radius_m(i), |j| {
            let back_m = radius_m(j);
            let is_mutual = || squared_distance(points[i], points[j]) <= back_m * back_m;
            if j > i && cores[j] && is_mutual() {
                components.join(i as u32, j as u32);
            }
        });
    };
    let indices = (0..points.len()).into_par_iter().with_min_len(BLOCK);
    indices.filter(|&i| cores[i]).for_each(connect_one);
    components
}

/// Numbers the components; a root is the smallest core index of its component, so it comes first.
fn number_cores(components: &Components, cores: &[bool]) -> Vec<i32> {
    let mut labels = vec![NOISE; cores.len()];
    let mut next = 0;
    for i in (0..cores.len()).filter(|&i| cores[i]) {
        let root = components.root(i as u32) as usize;
        if root == i {
            labels[i] = next;
            next += 1;
        }
        labels[i] = labels[root];
    }
    labels
}

/// Gives every other point the lowest label among the cores whose radius reaches it.
fn reach_borders<T: Coordinate>(
    points: &[[T; 3]],
    search: &Neighbors<'_, T>,
    radius_m: &(impl Fn(usize) -> f64 + Sync),
    cores: &[bool],
    labels: Vec<i32>,
) -> Vec<i32> {
    let labels: Vec<AtomicI32> = labels.into_iter().map(AtomicI32::new).collect();
    let lower = |held: i32, label: i32| held == NOISE || label < held;
    let reach = |i: usize| {
        let label = labels[i].load(Relaxed);
        search.for_each_within(points[i], radius_m(i), |j| {
            if !cores[j] {
                let update = |held| lower(held, label).then_some(label);
                let _ = labels[j].fetch_update(Relaxed, Relaxed, update); // refused: has a lower one
            }
        });
    };
    let indices = (0..points.len()).into_par_iter().with_min_len(BLOCK);
    indices.filter(|&i| cores[i]).for_each(reach);
    labels.into_iter().map(AtomicI32::into_inner).collect()
}
