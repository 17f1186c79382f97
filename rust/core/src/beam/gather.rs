//! Sweeps of all lidars sorted into holds: scan lines inside the box, with their ends.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use super::echoes::{LineEcho, Seen, add_line};
use crate::paper::passthrough::PassThrough;
use crate::stand::{Stand, Stands};
use crate::sweep::{Gap, Sweep};

/// A window no longer waits for a lidar that is so far behind the others: it has fallen silent.
const PATIENCE_NS: i64 = 60_000_000_000;

/// Collects what is seen of the blade in given stretches of time, each handed over when it is complete.
#[derive(Debug)]
pub struct Gather {
    stands: Vec<Stands>,
    pass: PassThrough,
    open: VecDeque<Window>,
    /// Start of the last sweep of each lidar.
    reached_ns: Vec<i64>,
    has_ended: bool,
}

#[derive(Debug)]
struct Window {
    span_ns: (i64, i64),
    seen: Seen,
}

impl Gather {
    /// For lidars that stand there, points inside the box, and windows in the order of their starts.
    pub fn new(stands: Vec<Stands>, pass: PassThrough, windows_ns: &[(i64, i64)]) -> Self {
        let window = |span_ns: &(i64, i64)| Window {
            span_ns: *span_ns,
            seen: Seen::default(),
        };
        Self {
            reached_ns: vec![i64::MIN; stands.len()],
            stands,
            pass,
            open: windows_ns.iter().map(window).collect(),
            has_ended: false,
        }
    }

    /// Takes the next sweep of a lidar by its number among the stands; what is seen goes by number of the stand.
    pub fn push(&mut self, sweep: &Sweep) {
        self.reached_ns[sweep.lidar] = sweep.start.0;
        for window in &mut self.open {
            if window.span_ns.0 > sweep.end.0 {
                break; // so do all that follow
            }
            if sweep.start.0 > window.span_ns.1 {
                continue;
            }
            let stands = &self.stands[sweep.lidar];
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

    /// No more sweeps will come.
    pub fn finish(&mut self) {
        self.has_ended = true;
    }

    /// What was seen in the next window, once no lidar has more to say of it.
    pub fn pop(&mut self) -> Option<Seen> {
        let end_ns = self.open.front()?.span_ns.1;
        let slowest = self.reached_ns.iter().min()?;
        let fastest = self.reached_ns.iter().max()?;
        let is_past = *slowest > end_ns || *fastest > end_ns.saturating_add(PATIENCE_NS);
        (is_past || self.has_ended)
            .then(|| self.open.pop_front())
            .flatten()
            .map(|window| {
                let mut seen = window.seen;
                seen.sort();
                seen
            })
    }
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
    use crate::cloud::PointCloud;
    use crate::frame::WorldFromSensor;
    use crate::time::Timestamp;
    use nalgebra::Rotation3;

    const SECOND: i64 = 1_000_000_000;

    fn gather(windows: &[(i64, i64)]) -> Gather {
        let pose = WorldFromSensor::new(Rotation3::identity(), Vector3::zeros());
        let stands = Stands::of(&[pose; 2], &[]).unwrap();
        let pass = PassThrough::new([-1.0; 3], [1.0; 3]).unwrap();
        Gather::new(stands, pass, windows)
    }

    fn sweep(lidar: usize, start: i64) -> Sweep {
        Sweep {
            lidar,
            index: 0,
            cloud: PointCloud::default(),
            start: Timestamp(start),
            end: Timestamp(start + 100),
            coverage: 1.0,
            packets: 1,
            lost: 0,
            gaps: Vec::new(),
        }
    }

    #[test]
    fn a_window_waits_until_all_lidars_are_past_it() {
        let mut gather = gather(&[(0, 1000), (500, 2000)]);
        gather.push(&sweep(0, 1500));
        assert!(gather.pop().is_none());
        gather.push(&sweep(1, 1001));
        assert!(gather.pop().is_some());
        assert!(gather.pop().is_none());
        gather.finish();
        assert!(gather.pop().is_some() && gather.pop().is_none());
    }

    #[test]
    fn a_silent_lidar_does_not_hold_up_the_others_for_ever() {
        let mut gather = gather(&[(0, SECOND)]);
        gather.push(&sweep(0, 2 * SECOND));
        assert!(gather.pop().is_none());
        gather.push(&sweep(0, 2 * SECOND + PATIENCE_NS));
        assert!(gather.pop().is_some());
    }
}
