//! How well observations agree with what was adjusted, and how much those weigh that do not.

use super::rows::Row;

/// Residuals beyond this many sigmas weigh less, beyond the second none at all.
const DOUBTED: f64 = 2.5;
const REFUSED: f64 = 6.0;
/// Surveyed values beyond this many sigmas of their studentised residual are gross errors: one in
/// sixteen thousand by chance.
pub const GROSS: f64 = 4.0;

/// An observation of which nothing else tells more than this share of an error cannot be judged by its
/// residual: what is left of it is the last step of the adjustment.
const LEAST_REDUNDANCY: f64 = 0.01;

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
        (own - variance).max(LEAST_REDUNDANCY * own)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn row(residual: f64) -> Row {
        Row {
            residual,
            sigma: 0.005,
            ..Row::default()
        }
    }

    #[test]
    fn what_nothing_else_tells_of_is_no_gross_error() {
        // A position that alone holds its lidar: its variance is its own but for the last digits.
        let alone = judged(&row(0.02 * 0.005), 0.005f64.powi(2) * (1.0 - 1e-9), false);
        assert!(alone.studentised < GROSS);
        // Three quarters of a gross error of 50 mm show where all else is twice as good.
        let wrong = judged(&row(0.0375), 0.005f64.powi(2) / 4.0, false);
        assert!((wrong.redundancy - 0.75).abs() < 1e-12);
        assert!(wrong.studentised > GROSS);
    }
}
