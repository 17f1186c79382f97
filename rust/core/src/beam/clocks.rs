//! Clocks of the lidars against each other, from a blade that moves: what two of them see of it fits one
//! shape only at the right instants.

use nalgebra::{DMatrix, DVector};

use super::adjust::Adjustment;
use super::normal::Normal;

/// Inverse variance by which the mean of all clocks is held: no blade tells what they have in common.
const TIED: f64 = 1e8;

/// What is known of the clocks before a stretch is looked at.
#[derive(Debug, Clone)]
pub struct Clocks {
    /// What each is behind the one that all share, seconds.
    pub offset_s: Vec<f64>,
    /// Its standard deviation, seconds.
    pub deviation_s: Vec<f64>,
    /// Whether the mean, by inverse variances, is held: where offsets are looked for.
    pub tied: bool,
}

/// What a stretch tells of the clocks.
#[derive(Debug, Clone)]
pub struct ClockNews {
    /// Information of the data alone, 1/s^2.
    pub information: DMatrix<f64>,
    /// That times the offsets that the data alone ask for, 1/s.
    pub right: DVector<f64>,
}

impl Adjustment {
    /// Takes what is known of the clocks over to a stretch.
    pub(super) fn set_clocks(&mut self, clocks: &Clocks) {
        self.rig.clock_s.clone_from(&clocks.deviation_s);
        let known = clocks.offset_s.iter().zip(&clocks.deviation_s);
        for (lidar, (offset, deviation)) in known.enumerate() {
            let at = self.layout.clock_at(lidar);
            self.values[at] = offset / deviation;
            self.expected[at] = offset / deviation;
        }
        self.ties_clocks = clocks.tied;
    }

    /// Adds to what is known that the clocks' mean is none of the unknowns.
    pub(super) fn tie_clocks(&self, prior: &mut Normal) {
        let (first, count) = (self.layout.clock_at(0), self.rig.clock_s.len());
        if !self.ties_clocks || !self.free.contains(&first) {
            return;
        }
        let weights = DVector::from_fn(count, |i, _| 1.0 / self.rig.clock_s[i]).normalize();
        let lacking: f64 = (0..count)
            .map(|i| weights[i] * (self.expected[first + i] - self.values[first + i]))
            .sum();
        let (row, column) = (first - prior.asked.start, first - prior.free.start);
        let mut right = prior.right.rows_mut(row, count);
        right += &weights * (TIED * lacking);
        let mut block = prior.matrix.view_mut((row, column), (count, count));
        block += &weights * weights.transpose() * TIED;
    }

    /// What the data of a stretch tell of its clocks, from the covariance of all that was free in it.
    pub(super) fn clock_news(&self, known: &DMatrix<f64>) -> Option<ClockNews> {
        let (first, count) = (self.layout.clock_at(0), self.rig.clock_s.len());
        let at = first - self.free.start;
        let block = known.view((at, at), (count, count)).into_owned();
        let information = block.try_inverse()?;
        let mut prior = Normal::new(&self.free, &self.free);
        self.tie_clocks(&mut prior);
        let before = prior.matrix.view((at, at), (count, count)) + DMatrix::identity(count, count);
        let right = &information * self.values.rows(first, count)
            - &before * self.expected.rows(first, count);
        let information = information - before;
        let scale =
            DMatrix::from_diagonal(&DVector::from_fn(count, |i, _| 1.0 / self.rig.clock_s[i]));
        Some(ClockNews {
            information: &scale * information * &scale,
            right: scale * right,
        })
    }
}
