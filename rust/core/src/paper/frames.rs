//! Frames on the common clock: of every lidar the sweep whose middle is nearest.

use std::collections::VecDeque;

use nalgebra::Point3;

use super::passthrough::PassThrough;
use crate::error::InvalidValue;
use crate::frame::WorldFromSensor;
use crate::sweep::Sweep;
use crate::time::Timestamp;

/// What one lidar gives to a frame: its points inside the box, world frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Share {
    /// Whether the lidar gave a sweep at all.
    pub present: bool,
    /// Points that passed the box, metres.
    pub points_m: Vec<[f32; 3]>,
    /// Their beams.
    pub rings: Vec<u16>,
    /// Whether packets were lost where the blade was seen.
    pub lost_on_blade: bool,
}

impl Share {
    /// Distance d of equation (10): from the mean of the points to the lidar, metres; `None`
    /// without points.
    pub fn distance_m(&self, sensor_m: &Point3<f64>) -> Option<f64> {
        let count = self.points_m.len() as f64;
        let sum = self.points_m.iter().fold([0.0; 3], |sum, p| {
            [sum[0] + f64::from(p[0]), sum[1] + f64::from(p[1]), sum[2] + f64::from(p[2])]
        });
        (count > 0.0).then(|| (Point3::from(sum.map(|s| s / count)) - sensor_m).norm())
    }
}

/// One moment of the test: a share of every lidar.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Middle of the frame.
    pub time: Timestamp,
    /// One per lidar, in their order.
    pub shares: Vec<Share>,
}

/// Collects sweeps of all lidars into frames.
///
/// A state machine without input or output: sweeps go in as they complete, each lidar's own in
/// order of time; frames come out when no later sweep can be nearer.
#[derive(Debug)]
pub struct FrameAssembler {
    poses: Vec<WorldFromSensor>,
    pass: PassThrough,
    period_ns: i64,
    next: Timestamp,
    waiting: Vec<VecDeque<(Timestamp, Share)>>,
    ended: bool,
}

impl FrameAssembler {
    /// Frames at `first`, `first + period` and so on, of lidars with these poses.
    ///
    /// # Errors
    /// [`InvalidValue`] where the period is not positive.
    pub fn new(
        poses: Vec<WorldFromSensor>,
        pass: PassThrough,
        first: Timestamp,
        period_ns: i64,
    ) -> Result<Self, InvalidValue> {
        if period_ns <= 0 {
            return Err(InvalidValue {
                name: "rate_hz",
                expected: "a rate above zero".into(),
                found: format!("a period of {period_ns} ns"),
            });
        }
        let waiting = vec![VecDeque::new(); poses.len()];
        Ok(Self { poses, pass, period_ns, next: first, waiting, ended: false })
    }

    /// Takes the next sweep of its lidar.
    pub fn push(&mut self, sweep: &Sweep) {
        let middle = sweep.start + (sweep.end - sweep.start) / 2;
        let share = share_of(sweep, &self.poses[sweep.lidar], &self.pass);
        self.waiting[sweep.lidar].push_back((middle, share));
    }

    /// No more sweeps will come: what waits may go out.
    pub fn finish(&mut self) {
        self.ended = true;
    }

    /// The next frame, once every lidar has a sweep at or after its middle.
    pub fn pop(&mut self) -> Option<Frame> {
        let complete = |queue: &VecDeque<(Timestamp, Share)>| {
            queue.back().is_some_and(|(middle, _)| *middle >= self.next)
        };
        let ready = match self.ended {
            false => self.waiting.iter().all(complete),
            // After the end as long as any lidar reaches this far.
            true => self.waiting.iter().any(complete),
        };
        if !ready {
            return None;
        }
        let (time, reach) = (self.next, self.period_ns);
        let shares = self.waiting.iter_mut().map(|queue| nearest(queue, time, reach)).collect();
        self.next = time + self.period_ns;
        Some(Frame { time, shares })
    }
}

/// The share nearest to `time`, if within `reach_ns`; what is older and farther leaves the queue.
fn nearest(queue: &mut VecDeque<(Timestamp, Share)>, time: Timestamp, reach_ns: i64) -> Share {
    let off = |entry: &(Timestamp, Share)| (entry.0 - time).abs();
    while queue.len() > 1 && off(&queue[1]) <= off(&queue[0]) {
        queue.pop_front();
    }
    // A sweep may serve two frames where the sensor turns more slowly than frames come.
    queue.front().filter(|entry| off(entry) <= reach_ns).map(|e| e.1.clone()).unwrap_or_default()
}

fn share_of(sweep: &Sweep, world_from_sensor: &WorldFromSensor, pass: &PassThrough) -> Share {
    let mut share = Share { present: true, ..Share::default() };
    let mut azimuths = Vec::new();
    for (index, xyz) in sweep.cloud.xyz_m.iter().enumerate() {
        let point = world_from_sensor.transform(&Point3::from(xyz.map(f64::from)));
        let point = [point.x as f32, point.y as f32, point.z as f32];
        if pass.contains(&point) {
            share.points_m.push(point);
            share.rings.push(sweep.cloud.ring[index]);
            azimuths.push(sweep.cloud.time_ns[index]);
        }
    }
    share
}
