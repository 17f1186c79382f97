//! Columns of slopes that touch few of the unknowns: a covariance is carried to them by these alone.

use nalgebra::DMatrix;

/// Slopes of some values by the unknowns that move them.
#[derive(Debug, Clone)]
pub(super) struct Few {
    /// Which unknowns.
    unknowns: Vec<usize>,
    /// A row per unknown, a column per value.
    slopes: DMatrix<f64>,
}

impl Few {
    /// The columns from `first` on of slopes by all unknowns.
    pub(super) fn of(rows: &DMatrix<f64>, first: usize, count: usize) -> Self {
        let columns = rows.columns(first, count);
        let mut is_touched = vec![false; rows.nrows()];
        for column in columns.column_iter() {
            let entries = is_touched.iter_mut().zip(column.iter());
            entries.for_each(|(is_one, slope)| *is_one |= *slope != 0.0);
        }
        let unknowns: Vec<usize> = (0..rows.nrows()).filter(|row| is_touched[*row]).collect();
        Self {
            slopes: columns.select_rows(&unknowns),
            unknowns,
        }
    }

    /// Covariance of all unknowns with the values.
    pub(super) fn carried(&self, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        covariance.select_columns(&self.unknowns) * &self.slopes
    }

    /// Covariance of the values with others.
    pub(super) fn with(&self, other: &Self, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        let carried = block(covariance, &self.unknowns, &other.unknowns) * &other.slopes;
        self.slopes.tr_mul(&carried)
    }

    /// Variance of each value.
    pub(super) fn variances(&self, covariance: &DMatrix<f64>) -> Vec<f64> {
        let carried = self.own_carried(covariance);
        let of = |k: usize| self.slopes.column(k).dot(&carried.column(k));
        (0..self.slopes.ncols()).map(of).collect()
    }

    /// Of a table with a row per unknown the rows of those that move the values.
    pub(super) fn rows_of(&self, table: &DMatrix<f64>) -> DMatrix<f64> {
        table.select_rows(&self.unknowns)
    }

    /// A row per unknown that moves the values, a column per value.
    pub(super) fn slopes(&self) -> &DMatrix<f64> {
        &self.slopes
    }

    /// Covariance of the unknowns that move the values with these.
    pub(super) fn own_carried(&self, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        block(covariance, &self.unknowns, &self.unknowns) * &self.slopes
    }
}

/// Some rows and columns of a matrix.
fn block(matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    let mut entries = Vec::with_capacity(rows.len() * columns.len());
    for column in columns {
        let column = matrix.column(*column);
        entries.extend(rows.iter().map(|row| column[*row]));
    }
    DMatrix::from_vec(rows.len(), columns.len(), entries)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_few_unknowns_tell_is_what_all_of_them_tell() {
        let entry = |i: usize, j: usize| ((7 * i + 3 * j + 1) as f64 * 0.7).sin();
        let root = DMatrix::from_fn(12, 12, entry);
        let covariance = &root * root.transpose();
        let touches = |i: usize, j: usize| if i % 3 == j % 2 { entry(i, j) } else { 0.0 };
        let rows = DMatrix::from_fn(12, 5, touches);
        let (one, two) = (Few::of(&rows, 0, 2), Few::of(&rows, 2, 3));
        assert_eq!(one.unknowns.len(), 8);
        let whole = rows.transpose() * &covariance * &rows;
        let close = |found: DMatrix<f64>, expected: DMatrix<f64>| {
            assert!((found - expected).amax() < 1e-12 * whole.amax());
        };
        close(
            one.with(&two, &covariance),
            whole.view((0, 2), (2, 3)).into(),
        );
        close(one.carried(&covariance), &covariance * rows.columns(0, 2));
        let variances = two.variances(&covariance);
        assert!((variances[1] - whole[(3, 3)]).abs() < 1e-12 * whole.amax());
    }
}
