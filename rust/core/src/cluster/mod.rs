//! Which points belong together: clusters by density, and contour pieces on one line.

mod bounds;
mod bricks;
mod components;
mod cores;
pub mod dbscan;
mod graded;
mod grid;
mod lattice;
pub mod line;
mod lines;
mod noise;
pub mod radius;
mod radix;
mod uniform;
mod varied;

pub use dbscan::{DbscanParams, Radius, dbscan, dbscan_brute};
pub use line::{Fate, LineClusters, LineParams, line_clusters};
pub use noise::is_noise;
pub use radius::{Intervals, RadiusModel};

/// Label of points that belong to no cluster.
pub const NOISE: i32 = -1;

/// Cluster of every point: 0, 1, ... by smallest core index, [`NOISE`] for none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels(Vec<i32>);

impl Labels {
    /// Label of every point, in the order of the cloud.
    pub fn as_slice(&self) -> &[i32] {
        &self.0
    }

    /// Hands the labels over.
    pub fn into_vec(self) -> Vec<i32> {
        self.0
    }

    /// Number of clusters, noise not counted.
    pub fn clusters(&self) -> usize {
        self.0.iter().max().map_or(0, |&last| (last + 1) as usize)
    }

    /// Number of points in each cluster, by label.
    pub fn sizes(&self) -> Vec<usize> {
        let mut sizes = vec![0; self.clusters()];
        for &label in self.0.iter().filter(|&&label| label != NOISE) {
            sizes[label as usize] += 1;
        }
        sizes
    }
}
