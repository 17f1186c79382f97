//! What all data of a hold cost: by that a step is judged.

use super::weights::cost;

/// What data of one kind cost.
#[derive(Debug)]
pub(super) struct Bill {
    /// Whether anybody asks.
    is_asked: bool,
    cost: f64,
    at_gate: f64,
    /// Shares of the data that count, and how many data there are.
    counted: f64,
    data: f64,
}

impl Bill {
    pub(super) fn new(is_asked: bool) -> Self {
        Self {
            is_asked,
            cost: 0.0,
            at_gate: 0.0,
            counted: 0.0,
            data: 0.0,
        }
    }

    /// Adds a residual of which a share counts; beyond the gate it costs as much as at the gate.
    pub(super) fn add(&mut self, residual: f64, sigma: f64, gate: f64, variance: f64, share: f64) {
        if !self.is_asked {
            return;
        }
        self.cost += share * cost(residual, sigma, gate, variance);
        self.at_gate += share * cost(gate, sigma, gate, variance);
        self.counted += share;
        self.data += 1.0;
    }

    /// Adds a datum of which nothing counts any more.
    pub(super) fn add_faded(&mut self) {
        self.data += 1.0;
    }

    /// What all cost: those that fade as the others do, those that miss the blade as at the gate, or a
    /// blade that turns away from its data would cost less.
    pub(super) fn total(&self, missed: usize) -> f64 {
        (self.cost * self.data + self.at_gate * missed as f64) / self.counted.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fades_or_misses_is_never_cheaper() {
        let mut seen = Bill::new(true);
        (0..10).for_each(|_| seen.add(0.02, 0.01, 0.1, 1e-4, 1.0));
        let (mut grazing, mut missed) = (Bill::new(true), Bill::new(true));
        for _ in 0..5 {
            grazing.add(0.02, 0.01, 0.1, 1e-4, 1.0);
            grazing.add_faded();
            missed.add(0.02, 0.01, 0.1, 1e-4, 1.0);
        }
        assert!((grazing.total(0) - seen.total(0)).abs() < 1e-9);
        assert!(missed.total(5) > 2.0 * seen.total(0));
    }
}
