//! How well observations agree with what was adjusted, and how much those weigh that do not.

use super::rows::Row;

/// Residuals beyond this many sigmas weigh less, beyond the second none at all.
const DOUBTED: f64 = 2.5;
const REFUSED: f64 = 6.0;
/// Surveyed values beyond this many sigmas of their studentised residual are gross errors: one in
/// sixteen thousand by chance.
pub const GROSS: f64 = 4.0;

/// One row of what was known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// Observed minus adjusted, in its unit.
    pub residual: f64,
    /// A-priori standard deviation.
    pub sigma: f64,
    /// Share of an error in it that its residual shows: 0 uncontrolled, 1 fully.
    pub redundancy: f64,
    /// Residual over its own standard deviation.
    pub studentised: f64,
    /// Left out as a gross error.
    pub left_out: bool,
}

/// Judges one row by its variance as adjusted.
pub fn judged(row: &Row, variance: f64, left_out: bool) -> Judged {
    let own = row.sigma.powi(2);
    // Left out, it is predicted by the rest; kept, it has pulled the rest towards itself.
    let left = if left_out {
        own + variance
    } else {
        (own - variance).max(1e-6 * own)
    };
    Judged {
        residual: row.residual,
        sigma: row.sigma,
        redundancy: if left_out { 1.0 } else { left / own },
        studentised: row.residual / left.sqrt(),
        left_out,
    }
}

/// Largest studentised residual.
pub fn largest(judged: &[Judged]) -> f64 {
    judged
        .iter()
        .map(|j| j.studentised.abs())
        .fold(0.0, f64::max)
}

/// Weight of a ray by its residual: Huber's, and none where something else was hit.
pub fn share(row: &Row) -> f64 {
    match row.residual.abs() / row.sigma {
        t if t > REFUSED => 0.0,
        _ => doubted(row),
    }
}

/// The same of what may be wrong by a little only.
pub fn doubted(row: &Row) -> f64 {
    (DOUBTED * row.sigma / row.residual.abs()).min(1.0)
}
