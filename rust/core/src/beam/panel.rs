//! Rows that touch the same unknowns, multiplied together: a small dense matrix times itself.

use crate::simd::{Kernel, vectorized};

/// Rows of a full panel.
const ROWS: usize = 32;
/// Columns that are multiplied at once.
const BLOCK: usize = 4;

/// Rows side by side, each as long as the others.
#[derive(Debug, Default)]
pub struct Panel {
    /// Node and places that its rows touch.
    pub node: usize,
    /// See `node`; those of the last columns.
    pub places: Vec<usize>,
    /// A multiple of [`BLOCK`]; zero beyond what is touched.
    width: usize,
    rows: Vec<f64>,
    products: Vec<f64>,
}

impl Panel {
    /// Whether a row that touches these can be added.
    pub fn suits(&self, node: usize, places: &[usize]) -> bool {
        node == self.node && places == self.places && self.rows.len() < ROWS * self.width
    }

    /// Begins anew with rows that touch these, beside the `before` columns of each node.
    pub fn begin(&mut self, node: usize, places: &[usize], before: usize) {
        self.node = node;
        self.places.clear();
        self.places.extend_from_slice(places);
        self.width = (before + places.len()).next_multiple_of(BLOCK);
        self.rows.clear();
    }

    /// Adds a row times `factor`.
    pub fn push(&mut self, values: impl Iterator<Item = f64>, factor: f64) {
        let whole = self.rows.len() + self.width;
        self.rows.extend(values.map(|value| value * factor));
        self.rows.resize(whole, 0.0);
    }

    /// Sums of products of columns over all rows, a line for each of the first `count` columns: right of the
    /// diagonal only.
    pub fn multiply(&mut self, count: usize) -> impl Iterator<Item = &[f64]> {
        self.products.resize(self.width * self.width, 0.0);
        vectorized(Squares {
            rows: &self.rows,
            width: self.width,
            count,
            products: &mut self.products,
        });
        self.products.chunks_exact(self.width.max(1)).take(count)
    }

    /// Whether it has no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

struct Squares<'a> {
    rows: &'a [f64],
    width: usize,
    count: usize,
    products: &'a mut [f64],
}

impl Kernel for Squares<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        for a in (0..self.count).step_by(BLOCK) {
            for b in (a..self.width).step_by(BLOCK) {
                let block = product(self.rows, self.width, a, b);
                for (i, sums) in block.iter().enumerate() {
                    let line = &mut self.products[(a + i) * self.width + b..];
                    line[..BLOCK].copy_from_slice(sums);
                }
            }
        }
    }
}

/// Products of the columns from `a` on with those from `b` on.
#[inline(always)]
fn product(rows: &[f64], width: usize, a: usize, b: usize) -> [[f64; BLOCK]; BLOCK] {
    let mut sums = [[0.0; BLOCK]; BLOCK];
    for row in rows.chunks_exact(width) {
        let (Some(left), Some(right)) = (
            row[a..].first_chunk::<BLOCK>(),
            row[b..].first_chunk::<BLOCK>(),
        ) else {
            continue;
        };
        for (line, factor) in sums.iter_mut().zip(left) {
            for (sum, value) in line.iter_mut().zip(right) {
                *sum += factor * value;
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_all_pairs_of_columns() {
        let mut panel = Panel::default();
        let places: Vec<usize> = (0..5).collect();
        panel.begin(3, &places, 2);
        let row = |k: usize| (0..7).map(move |i| ((k * 7 + i) as f64 * 0.7).sin());
        (0..20).for_each(|k| panel.push(row(k), 2.0));
        assert!(panel.suits(3, &places) && !panel.suits(3, &places[1..]));
        for (i, line) in panel.multiply(7).enumerate() {
            for (j, found) in line.iter().enumerate().take(7).skip(i) {
                let at = |k: usize, column: usize| row(k).nth(column).unwrap();
                let sum: f64 = (0..20).map(|k| 4.0 * at(k, i) * at(k, j)).sum();
                assert!((found - sum).abs() < 1e-12, "{i} {j}");
            }
        }
    }
}
