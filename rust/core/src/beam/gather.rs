//! Sweeps of all lidars sorted into holds: scan lines inside the box, with their ends.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use super::echoes::{LineEcho, Seen, add_line};
use crate::capture::DatagramBatch;
use crate::cloud::PointCloud;
use crate::error::ReadError;
use crate::frame::Sensor;
use crate::paper::passthrough::PassThrough;
use crate::stand::{Stand, Stands};
use crate::stream::{Beside, Reading, ScanReport, SweepOptions, Taker};
use crate::sweep::{Gap, Sweep};
use crate::time::Timestamp;

/// A window no longer waits for a lidar that is so far behind the others: it has fallen silent.
const PATIENCE_NS: i64 = 60_000_000_000;

/// Collects what is seen of the blade in given stretches of time, each handed over when it is complete; lidars side
/// by side.
pub struct Gather {
    lidars: Beside<Windows>,
    /// Of the windows that were not handed over yet.
    ends_ns: VecDeque<i64>,
    has_ended: bool,
}

/// Which lidars are read, by number in the scan, at which azimuth their sweeps are cut, where they stand, and what
/// lies around the blade.
#[derive(Debug)]
pub struct GatherPlan<'a> {
    /// Numbers.
    pub lidars: &'a [usize],
    /// Azimuths.
    pub cuts_rad: &'a [f64],
    /// What is seen goes by number of the stand.
    pub stands: Vec<Stands>,
    /// Points inside of it count.
    pub pass: PassThrough,
}

/// What one lidar sees in the windows.
#[derive(Debug)]
struct Windows {
    stands: Stands,
    pass: PassThrough,
    open: VecDeque<Window>,
    /// Start of the last sweep.
    reached_ns: i64,
}

#[derive(Debug)]
struct Window {
    span_ns: (i64, i64),
    seen: Seen,
}

impl Gather {
    /// For the capture that `report` was made of, with windows in the order of their starts.
    ///
    /// # Errors
    /// [`ReadError`] where a lidar cannot be decoded.
    pub fn new(
        report: &ScanReport,
        plan: GatherPlan<'_>,
        windows_ns: &[(i64, i64)],
    ) -> Result<Self, ReadError> {
        let lidars = plan.lidars.iter().zip(plan.cuts_rad);
        let lidar = |((number, cut_rad), stands): ((&usize, &f64), Stands)| {
            let bearings = std::iter::once(plan.pass.bearings(&stands));
            let options = SweepOptions {
                start: windows_ns.iter().map(|w| Timestamp(w.0)).min(),
                stop: windows_ns.iter().map(|w| Timestamp(w.1)).max(),
                ..SweepOptions::of(&[*number], &[*cut_rad]).towards(&[*number], bearings)
            };
            (options, Windows::new(stands, plan.pass, windows_ns))
        };
        Ok(Self {
            lidars: Beside::new(report, lidars.zip(plan.stands).map(lidar))?,
            ends_ns: windows_ns.iter().map(|span_ns| span_ns.1).collect(),
            has_ended: false,
        })
    }

    /// What was seen in the next window, once no lidar has more to say of it.
    pub fn pop(&mut self) -> Option<Seen> {
        let end_ns = *self.ends_ns.front()?;
        if !self.has_ended && !self.is_past(end_ns) {
            return None;
        }
        self.ends_ns.pop_front();
        let mut seen = Seen::default();
        let of_lidars = self.lidars.takers();
        of_lidars
            .filter_map(|lidar| lidar.open.pop_front())
            .for_each(|window| seen.append(window.seen));
        seen.sort();
        Some(seen)
    }

    fn is_past(&mut self, end_ns: i64) -> bool {
        let reached_ns = self.lidars.takers().map(|lidar| lidar.reached_ns);
        is_past(end_ns, reached_ns)
    }
}

impl Reading for Gather {
    fn push(&mut self, batch: &DatagramBatch) {
        self.lidars.push(batch);
    }

    fn is_done(&self) -> bool {
        self.lidars.is_done()
    }

    fn finish(&mut self) {
        self.lidars.finish();
        self.has_ended = true;
    }
}

impl Windows {
    fn new(stands: Stands, pass: PassThrough, windows_ns: &[(i64, i64)]) -> Self {
        let window = |span_ns: &(i64, i64)| Window {
            span_ns: *span_ns,
            seen: Seen::default(),
        };
        Self {
            stands,
            pass,
            open: windows_ns.iter().map(window).collect(),
            reached_ns: i64::MIN,
        }
    }
}

impl Taker for Windows {
    type Kept = PointCloud<Sensor>;

    fn take(&mut self, sweep: &Sweep) {
        self.reached_ns = sweep.start.0;
        for window in &mut self.open {
            if window.span_ns.0 > sweep.end.0 {
                break; // so do all that follow
            }
            if sweep.start.0 > window.span_ns.1 {
                continue;
            }
            let stands = &self.stands;
            let is_gap = |from: i64, to: i64| {
                let lost = |gap: &Gap| gap.from.0 <= to && from <= gap.to.0;
                sweep.gaps.iter().any(lost) || stands.moves_within(from, to)
            };
            for stand in stands.iter() {
                for (ring, line) in lines(sweep, stand, &self.pass, window.span_ns) {
                    let period_ns = shot_period_ns(&line);
                    let (seen, number) = (&mut window.seen, stand.number);
                    add_line(seen, number, ring, &line, period_ns, is_gap);
                }
            }
        }
    }
}

/// Whether no lidar has more to say of a window with this end, by the starts of their last sweeps.
fn is_past(end_ns: i64, reached_ns: impl Iterator<Item = i64>) -> bool {
    let (slowest, fastest) = reached_ns.fold((i64::MAX, i64::MIN), |(slow, fast), reached| {
        (slow.min(reached), fast.max(reached))
    });
    slowest > end_ns || fastest > end_ns.saturating_add(PATIENCE_NS)
}

/// Echoes of a sweep inside the box, the window and a stand, by beam, in the order of the shots.
fn lines(
    sweep: &Sweep,
    stand: &Stand,
    pass: &PassThrough,
    window_ns: (i64, i64),
) -> Vec<(usize, Vec<LineEcho>)> {
    let cloud = &sweep.cloud;
    if !stand.meets(sweep.start.0, sweep.end.0) {
        return Vec::new();
    }
    let rings = cloud
        .ring
        .iter()
        .max()
        .map_or(0, |last| usize::from(*last) + 1);
    let mut lines: Vec<Vec<LineEcho>> = vec![Vec::new(); rings];
    for (index, xyz) in cloud.xyz_m.iter().enumerate() {
        let time_ns = cloud.time_ns[index];
        if cloud.return_index[index] > 0 || time_ns < window_ns.0 || time_ns > window_ns.1 {
            continue;
        }
        if !stand.holds(time_ns) {
            continue;
        }
        let sensor = Point3::from(xyz.map(f64::from));
        let world = stand.pose.transform(&sensor);
        if pass.contains(&[world.x as f32, world.y as f32, world.z as f32]) {
            let xyz_m: Vector3<f64> = sensor.coords;
            lines[usize::from(cloud.ring[index])].push(LineEcho { time_ns, xyz_m });
        }
    }
    let mut lines: Vec<_> = lines.into_iter().enumerate().collect();
    lines.retain(|(_, line)| line.len() > 1);
    for (_, line) in &mut lines {
        line.sort_by_key(|echo| echo.time_ns);
    }
    lines
}

/// Time from shot to shot of a beam: the median of the times between its echoes, which mostly follow
/// each other.
fn shot_period_ns(line: &[LineEcho]) -> f64 {
    let mut steps: Vec<i64> = line
        .windows(2)
        .map(|pair| pair[1].time_ns - pair[0].time_ns)
        .collect();
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable(middle);
    (*median).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn a_window_waits_until_all_lidars_are_past_it() {
        assert!(!is_past(1000, [1500, i64::MIN].into_iter()));
        assert!(!is_past(1000, [1500, 1000].into_iter()));
        assert!(is_past(1000, [1500, 1001].into_iter()));
        assert!(!is_past(2000, [1500, 1001].into_iter()));
    }

    #[test]
    fn a_silent_lidar_does_not_hold_up_the_others_for_ever() {
        assert!(!is_past(SECOND, [i64::MIN, 2 * SECOND].into_iter()));
        assert!(is_past(
            SECOND,
            [i64::MIN, 2 * SECOND + PATIENCE_NS].into_iter()
        ));
    }
}
