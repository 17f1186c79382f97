//! Sweeps of all lidars sorted into holds: scan lines inside the box, with their ends.

use nalgebra::{Point3, Vector3};

use super::echoes::{LineEcho, Seen, add_line};
use crate::frame::WorldFromSensor;
use crate::paper::passthrough::PassThrough;
use crate::sweep::Sweep;

/// Collects what is seen of the blade in given stretches of time.
#[derive(Debug)]
pub struct Gather {
    poses: Vec<WorldFromSensor>,
    pass: PassThrough,
    windows_ns: Vec<(i64, i64)>,
    seen: Vec<Seen>,
}

impl Gather {
    /// For lidars with these poses, points inside the box, and windows in time order.
    pub fn new(
        poses: Vec<WorldFromSensor>,
        pass: PassThrough,
        windows_ns: Vec<(i64, i64)>,
    ) -> Self {
        let seen = vec![Seen::default(); windows_ns.len()];
        Self {
            poses,
            pass,
            windows_ns,
            seen,
        }
    }

    /// Takes a sweep of a lidar by its number among the poses.
    pub fn push(&mut self, sweep: &Sweep) {
        for (window, seen) in self.windows_ns.iter().zip(&mut self.seen) {
            if sweep.end.0 < window.0 || sweep.start.0 > window.1 {
                continue;
            }
            for (ring, line) in lines(sweep, &self.poses[sweep.lidar], &self.pass, *window) {
                let is_gap = |from: i64, to: i64| {
                    sweep
                        .gaps
                        .iter()
                        .any(|gap| gap.from.0 <= to && from <= gap.to.0)
                };
                let period_ns = shot_period_ns(&line);
                add_line(seen, sweep.lidar, ring, &line, period_ns, is_gap);
            }
        }
    }

    /// What was seen, by window.
    pub fn finish(self) -> Vec<Seen> {
        self.seen
    }
}

/// Echoes of a sweep inside the box and the window, by beam, in the order of the shots.
fn lines(
    sweep: &Sweep,
    world_from_sensor: &WorldFromSensor,
    pass: &PassThrough,
    window_ns: (i64, i64),
) -> Vec<(usize, Vec<LineEcho>)> {
    let cloud = &sweep.cloud;
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
        let sensor = Point3::from(xyz.map(f64::from));
        let world = world_from_sensor.transform(&sensor);
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
