//! Sums of products of unknowns with each other: of each that it may meet in a row, and no others.
//!
//! Most unknowns are waves of the surface, and a row meets those of two neighbouring knots alone. Their columns
//! hold these and what stands behind the waves, a twentieth of a whole column.

use std::ops::Range;

/// Unknowns by knots in a row, so many in each: those of a knot meet those of the next one and no farther ones.
#[derive(Debug, Clone)]
pub struct Knotted {
    /// All of them.
    pub all: Range<usize>,
    /// In each knot.
    pub each: usize,
}

impl Knotted {
    /// None.
    pub const NONE: Self = Self { all: 0..0, each: 1 };

    /// Their places among unknowns that rise, where the residual has place 0.
    pub fn within(&self, unknowns: &[usize]) -> Self {
        let before = |end: usize| 1 + unknowns.partition_point(|unknown| *unknown < end);
        Self {
            all: before(self.all.start)..before(self.all.end),
            each: self.each,
        }
    }

    /// Behind the last one that meets this one.
    fn reach(&self, unknown: usize) -> usize {
        let knot = (unknown - self.all.start) / self.each;
        (self.all.start + (knot + 2) * self.each).min(self.all.end)
    }
}

/// Lower triangle: a column for each of the first places, in it a run of rows from the diagonal on and one that ends
/// with the last row.
#[derive(Debug)]
pub struct Pairs {
    columns: Vec<Column>,
    size: usize,
    sums: Vec<f64>,
}

#[derive(Debug)]
struct Column {
    /// Of its sums among those of all.
    start: usize,
    /// Where the first run ends and the second one begins.
    gap: Range<usize>,
}

impl Pairs {
    /// Of `size` places, with so many columns; `knotted` are places.
    pub fn new(size: usize, columns: usize, knotted: &Knotted) -> Self {
        let mut next = 0;
        let column = |place: usize| {
            let gap = match knotted.all.contains(&place) {
                true => knotted.reach(place)..knotted.all.end,
                false => size..size,
            };
            let start = next;
            next += gap.start - place + size - gap.end;
            Column { start, gap }
        };
        let columns = (0..columns).map(column).collect();
        Self {
            columns,
            size,
            sums: vec![0.0; next],
        }
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there is no column.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Adds products of a column's place with these rows, which rise from the diagonal on.
    pub fn add(&mut self, column: usize, rows: &[usize], products: &[f64]) {
        let Column { start, gap } = &self.columns[column];
        let first = gap.start - column;
        let near = rows.partition_point(|row| *row < gap.start);
        let sums = &mut self.sums[*start..][..first + self.size - gap.end];
        let (rows, products) = (rows.split_at(near), products.split_at(near));
        for (row, product) in rows.0.iter().zip(products.0) {
            sums[row - column] += product;
        }
        for (row, product) in rows.1.iter().zip(products.1) {
            sums[row - gap.end + first] += product;
        }
    }

    /// Sums of a column with the places that they belong to.
    pub fn column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> {
        let Column { start, gap } = &self.columns[column];
        let places = (column..gap.start).chain(gap.end..self.size);
        places.zip(self.sums[*start..].iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_meet_is_summed_and_comes_back_with_its_place() {
        // Three knots of two between places of their own.
        let knotted = Knotted { all: 2..8, each: 2 };
        let mut pairs = Pairs::new(10, 9, &knotted);
        let rows: [&[usize]; 3] = [&[0, 1, 4, 9], &[2, 3, 5, 8, 9], &[7, 8]];
        for _ in 0..2 {
            for rows in rows {
                let products: Vec<f64> = rows.iter().map(|row| *row as f64 + 0.5).collect();
                pairs.add(rows[0], rows, &products);
            }
        }
        for column in 0..pairs.len() {
            let touched = rows.iter().find(|rows| rows[0] == column);
            for (place, sum) in pairs.column(column) {
                let is_one = touched.is_some_and(|rows| rows.contains(&place));
                let expected = if is_one {
                    2.0 * (place as f64 + 0.5)
                } else {
                    0.0
                };
                assert_eq!(sum, expected, "{column} {place}");
            }
        }
        let of_wave: Vec<usize> = pairs.column(3).map(|(place, _)| place).collect();
        assert_eq!(of_wave, [3, 4, 5, 8, 9]);
        assert_eq!(pairs.column(6).count(), 4);
    }
}
