//! Normal equations: nodes of the roughness in an envelope, everything else in a border.
//!
//! The nodes are eliminated first (their matrix is an envelope); what is left is small and dense, and
//! its inverse is the joint covariance of all poses and nuisances.

use nalgebra::{DMatrix, DVector};

use super::field::Field;
use super::rows::Row;
use super::skyline::{Factor, Skyline};
use super::state::{Layout, State};

/// Sums of weighted products.
#[derive(Debug, Clone)]
pub struct Normal {
    border: DMatrix<f64>,
    coupling: Vec<f64>,
    field: Skyline,
    border_right: DVector<f64>,
    field_right: Vec<f64>,
    /// Weighted sum of squares so far.
    pub cost: f64,
}

/// Normal equations with the nodes eliminated.
#[derive(Debug, Clone)]
pub struct Solved {
    factor: Factor,
    coupling: Vec<f64>,
    /// Joint covariance of the unknowns of the border.
    pub covariance: DMatrix<f64>,
    /// Step of the border.
    pub border: Vec<f64>,
    /// Step of the nodes.
    pub nodes: Vec<f64>,
}

impl Normal {
    /// No observation yet but the prior of the roughness.
    pub fn new(state: &State, layout: &Layout) -> Self {
        let priors: Vec<_> = state.surfaces.iter().map(|s| s.field.as_ref()).collect();
        let mut normal = Self {
            border: DMatrix::zeros(layout.border, layout.border),
            coupling: vec![0.0; layout.nodes * layout.border],
            field: Skyline::new(envelope(&priors, layout)),
            border_right: DVector::zeros(layout.border),
            field_right: vec![0.0; layout.nodes],
            cost: 0.0,
        };
        for (field, start) in priors.into_iter().zip(&layout.fields) {
            field
                .into_iter()
                .for_each(|field| normal.add_roughness(field, *start));
        }
        normal
    }

    fn add_roughness(&mut self, field: &Field, start: usize) {
        for weights in field.prior() {
            let residual = weights.iter().map(|(i, w)| w * field.heights_m[*i]).sum();
            let field = weights.into_iter().map(|(i, w)| (start + i, w)).collect();
            let row = Row {
                residual,
                sigma: 1.0,
                border: Vec::new(),
                field,
            };
            self.add_weighted(&row, 1.0);
        }
    }

    /// Adds one observation; `share` < 1 where it is doubted.
    pub fn add(&mut self, row: &Row, share: f64) {
        self.add_weighted(row, share / row.sigma.powi(2));
    }

    fn add_weighted(&mut self, row: &Row, weight: f64) {
        let width = self.border.ncols();
        self.cost += weight * row.residual.powi(2);
        for (i, a) in &row.border {
            let wa = weight * a;
            self.border_right[*i] -= wa * row.residual;
            for (j, b) in &row.border {
                self.border[(*i, *j)] += wa * b;
            }
        }
        for (k, (i, a)) in row.field.iter().enumerate() {
            let wa = weight * a;
            self.field_right[*i] -= wa * row.residual;
            let coupling = &mut self.coupling[i * width..(i + 1) * width];
            row.border.iter().for_each(|(j, b)| coupling[*j] += wa * b);
            for (j, b) in &row.field[..=k] {
                self.field.add(*i, *j, wa * b);
            }
        }
    }

    /// Adds what is known of a single unknown: its value is `value` to within `sigma`.
    pub fn hold(&mut self, unknown: usize, value: f64, sigma: f64) {
        let weight = sigma.max(1e-9).powi(-2);
        self.cost += weight * value * value;
        self.border[(unknown, unknown)] += weight;
        self.border_right[unknown] -= weight * value;
    }

    /// Adds that a run of unknowns scatters by `sigma` about a common value that is itself known to
    /// be zero to within `sigma`.
    pub fn hold_alike(&mut self, start: usize, values: &[f64], sigma: f64) {
        let weight = sigma.max(1e-9).powi(-2);
        let common = values.iter().sum::<f64>() / (values.len() + 1) as f64;
        for (i, value) in values.iter().enumerate() {
            self.cost += weight * value * (value - common);
            self.border_right[start + i] -= weight * (value - common);
            for j in 0..values.len() {
                let shared = weight / (values.len() + 1) as f64;
                self.border[(start + i, start + j)] +=
                    if i == j { weight - shared } else { -shared };
            }
        }
    }

    /// Solves; None where the matrix is not positive definite. Of the unknowns `frozen`, those less sure
    /// than their limit do not move, and all others move as fits that; the covariance is that of all.
    pub fn solve(self, frozen: &[(usize, f64)]) -> Option<Solved> {
        let width = self.border.ncols();
        let factor = self.field.factor()?;
        let (mut coupling, mut right) = (self.coupling, self.field_right);
        factor.forward(&mut coupling, width);
        factor.forward(&mut right, 1);
        let mut border = self.border;
        let mut border_right = self.border_right;
        for (row, value) in coupling.chunks_exact(width).zip(&right) {
            subtract_square(&mut border, row);
            border_right
                .iter_mut()
                .zip(row)
                .for_each(|(r, c)| *r -= c * value);
        }
        let covariance = inverse(&border)?;
        let step = held(&covariance, &covariance * border_right, frozen);
        for (row, value) in coupling.chunks_exact(width).zip(&mut right) {
            *value -= row.iter().zip(step.iter()).map(|(c, s)| c * s).sum::<f64>();
        }
        factor.backward(&mut right);
        Some(Solved {
            factor,
            coupling,
            covariance,
            border: step.as_slice().to_vec(),
            nodes: right,
        })
    }
}

/// A step given that some unknowns do not move: those less sure than their limit.
fn held(covariance: &DMatrix<f64>, step: DVector<f64>, frozen: &[(usize, f64)]) -> DVector<f64> {
    let loose = frozen
        .iter()
        .filter(|(k, limit)| covariance[(*k, *k)] > limit * limit);
    let loose: Vec<usize> = loose.map(|(k, _)| *k).collect();
    let own = covariance.select_rows(&loose).select_columns(&loose);
    let Some(inverse) = own.cholesky().filter(|_| !loose.is_empty()) else {
        return step;
    };
    let moved = DVector::from_iterator(loose.len(), loose.iter().map(|k| step[*k]));
    step - covariance.select_columns(&loose) * inverse.solve(&moved)
}

fn subtract_square(matrix: &mut DMatrix<f64>, row: &[f64]) {
    for (j, b) in row.iter().enumerate().filter(|(_, b)| **b != 0.0) {
        let mut column = matrix.column_mut(j);
        column.iter_mut().zip(row).for_each(|(m, a)| *m -= a * b);
    }
}

/// Inverse of a symmetric positive definite matrix whose unknowns differ in unit.
fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale: Vec<f64> = matrix.diagonal().iter().map(|d| d.sqrt().recip()).collect();
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        0.5 * (matrix[(i, j)] + matrix[(j, i)]) * scale[i] * scale[j]
    });
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        inverse[(i, j)] * scale[i] * scale[j]
    }))
}

impl Solved {
    /// Variance of what a row models, in its unit squared.
    pub fn variance(&self, row: &Row) -> f64 {
        let width = self.covariance.ncols();
        let mut seen = DVector::zeros(width);
        row.border.iter().for_each(|(i, a)| seen[*i] += a);
        let mut own = 0.0;
        if !row.field.is_empty() {
            let mut nodes = vec![0.0; self.nodes.len()];
            row.field.iter().for_each(|(i, a)| nodes[*i] += a);
            self.factor.forward(&mut nodes, 1);
            own = nodes.iter().map(|x| x * x).sum();
            for (coupling, x) in self.coupling.chunks_exact(width).zip(&nodes) {
                if *x != 0.0 {
                    seen.iter_mut().zip(coupling).for_each(|(s, c)| *s -= c * x);
                }
            }
        }
        own + seen.dot(&(&self.covariance * &seen))
    }
}

/// First column of every row of the nodes' matrix.
fn envelope(fields: &[Option<&Field>], layout: &Layout) -> Vec<usize> {
    let mut first: Vec<usize> = (0..layout.nodes).collect();
    for (field, start) in fields.iter().zip(&layout.fields) {
        for row in field.iter().flat_map(|field| field.prior()) {
            let least = row.iter().map(|(i, _)| start + i).min().unwrap_or(*start);
            for (i, _) in row {
                first[start + i] = first[start + i].min(least);
            }
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_frozen_stays_and_the_rest_follows() {
        // Two unknowns of correlation 0.8: held at zero, the first takes its share from the second.
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 0.8, 0.8, 0.25]);
        let step = DVector::from_vec(vec![1.0, 0.5]);
        let found = held(&covariance, step.clone(), &[(0, 1.0), (1, 1.0)]);
        assert!(found[0].abs() < 1e-12);
        assert!((found[1] - (0.5 - 0.8 / 4.0)).abs() < 1e-12);
        assert_eq!(held(&covariance, step.clone(), &[(0, 3.0)]), step);
    }
}
