//! Which part of the turn a sensor sends at all.

use std::f64::consts::TAU;

use crate::angle::{Arc, wrap_turn};

const BINS: usize = 720;
const BIN_RAD: f64 = TAU / BINS as f64;
/// Bins seen in less than this share of the turns are outside of the field of view.
const BLIND_SHARE: f64 = 0.05;
/// Turns before a field of view can be told from loss.
const MIN_TURNS: u32 = 3;

/// How often each half degree of the turn was seen.
#[derive(Debug, Clone)]
pub struct FieldOfView {
    seen: Vec<u32>,
    last: usize,
}

impl Default for FieldOfView {
    fn default() -> Self {
        Self {
            seen: vec![0; BINS],
            last: usize::MAX,
        }
    }
}

impl FieldOfView {
    /// Marks an arc that was seen; arcs follow each other in the sense of rotation.
    pub fn observe(&mut self, arc: Arc) {
        for bin in bins(arc) {
            if bin != self.last {
                self.seen[bin] = self.seen[bin].saturating_add(1);
                self.last = bin;
            }
        }
    }

    /// Turns seen so far.
    pub fn turns(&self) -> u32 {
        self.seen.iter().copied().max().unwrap_or(0)
    }

    fn limit(&self) -> Option<f64> {
        let turns = self.turns();
        (turns >= MIN_TURNS).then(|| f64::from(turns) * BLIND_SHARE)
    }

    /// Angle of the turn that is never sent; 0 as long as it cannot be told.
    pub fn blind_rad(&self) -> f64 {
        let Some(limit) = self.limit() else {
            return 0.0;
        };
        let blind = self.seen.iter().filter(|seen| f64::from(**seen) <= limit);
        blind.count() as f64 * BIN_RAD
    }

    /// Share of a gap that lies in the field of view, so that packets are missing there.
    ///
    /// The bins at both ends of a blind part are half seen; they do not count as missing.
    pub fn visible_share(&self, gap: Arc) -> f64 {
        let (Some(limit), true) = (self.limit(), gap.width_rad > 0.0) else {
            return 1.0;
        };
        let total = bins(gap).count();
        let blind = bins(gap).filter(|bin| f64::from(self.seen[*bin]) <= limit);
        let blind = blind.count();
        if blind == 0 {
            return 1.0;
        }
        total.saturating_sub(blind + 2) as f64 / total as f64
    }
}

/// Bins that an arc touches, at most one turn of them.
fn bins(arc: Arc) -> impl Iterator<Item = usize> {
    let start = wrap_turn(arc.from_rad) / BIN_RAD;
    let first = start as usize;
    let end = start + arc.width_rad.clamp(0.0, TAU) / BIN_RAD;
    // Rounded up, which is a call where not all machines can.
    let end = end as usize + usize::from((end as usize as f64) < end);
    let within = |bin: usize| if bin < BINS { bin } else { bin - BINS };
    (first..end.min(first + BINS)).map(within)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(from_deg: f64, width_deg: f64) -> Arc {
        Arc {
            from_rad: from_deg.to_radians(),
            width_rad: width_deg.to_radians(),
        }
    }

    #[test]
    fn a_gap_of_every_turn_is_blind_and_one_of_a_single_turn_is_not() {
        let mut view = FieldOfView::default();
        for turn in 0..20 {
            for start in (0..180)
                .step_by(5)
                .filter(|start| turn != 7 || *start != 90)
            {
                view.observe(arc(f64::from(start) + 100.0, 5.0));
            }
        }
        assert!((view.blind_rad().to_degrees() - 180.0).abs() <= 1.0);
        assert_eq!(view.visible_share(arc(190.0, 5.0)), 1.0);
        assert_eq!(view.visible_share(arc(280.0, 180.0)), 0.0);
        // Blind part and one packet more.
        let share = view.visible_share(arc(275.0, 185.0));
        assert!((share * 37.0 - 1.0).abs() < 0.25, "{share}");
    }

    #[test]
    fn before_it_can_be_told_all_gaps_are_loss() {
        let mut view = FieldOfView::default();
        view.observe(arc(0.0, 180.0));
        assert_eq!(
            (view.blind_rad(), view.visible_share(arc(180.0, 180.0))),
            (0.0, 1.0)
        );
    }
}
