//! A sheet as a lidar sees it, as residuals: across its edges, along them, and along the ray.

use nalgebra::{Unit, Vector3};

use super::rows::{Row, raised};
use super::sheet::{Sheet, across};
use super::state::{Layout, State, Term};

/// Which sheet which lidar sees, and how.
#[derive(Debug, Clone)]
pub struct Sight {
    /// Which lidar.
    pub lidar: usize,
    /// Which target.
    pub target: usize,
    /// What it sees.
    pub seen: Sheet,
}

impl Sight {
    /// Its three rows, metres.
    pub fn rows(&self, state: &State, layout: &Layout) -> [Row; 3] {
        let (of, seen) = (&state.lidars[self.lidar], &self.seen);
        let measured_m = seen.centre_m.norm();
        let aim = Unit::new_normalize(seen.centre_m);
        let (direction, by_elevation) = raised(&aim, of.elevation_rad);
        let offset = |(ring, share): &(u16, f64)| {
            share * of.offsets_m.get(usize::from(*ring)).copied().unwrap_or(0.0)
        };
        let offset_m = seen.shares.iter().map(offset).sum::<f64>();
        let range_m = measured_m * (1.0 + of.scale) + of.retro_m + offset_m;
        // A turn w of R moves axis . R^T (T - t) by -w . ((T - t) x axis).
        let from = state.targets[self.target].centre_m - of.position_m;
        let found = direction * range_m - of.rotation.inverse() * from;
        let start = layout.lidars[self.lidar];
        let axes = self.axes(&aim);
        [0, 1, 2].map(|k| {
            let axis = of.rotation * axes[k];
            let mut row = Row {
                residual: axes[k].dot(&found),
                sigma: seen.sigma_m[k],
                ..Row::default()
            };
            row.vector(start + Term::ROTATION, &-axis.cross(&from));
            row.vector(start + Term::POSITION, &axis);
            row.vector(layout.targets[self.target], &-axis);
            let lifted = axes[k].dot(&by_elevation) * range_m;
            row.border.push((start + Term::ELEVATION, lifted));
            let farther = axes[k].dot(&direction);
            row.border.push((start + Term::SCALE, farther * measured_m));
            row.border.push((layout.retro[self.lidar], farther));
            let shares = seen.shares.iter();
            row.border.extend(shares.map(|(ring, share)| {
                (start + Term::OFFSETS + usize::from(*ring), farther * share)
            }));
            row
        })
    }

    /// Across the upright edges of the sheet, along them, and along the ray.
    fn axes(&self, aim: &Unit<Vector3<f64>>) -> [Vector3<f64>; 3] {
        let [level, upright] = across(aim);
        let lean = self.seen.lean;
        let (over, along) = (level - upright * lean, upright + level * lean);
        [over.normalize(), along.normalize(), aim.into_inner()]
    }
}
