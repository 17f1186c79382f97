//! Frames on the common clock: of every lidar the sweep whose middle is nearest.

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::Point3;

use super::inside::Inside;
use super::passthrough::PassThrough;
use crate::cloud::PointCloud;
use crate::error::InvalidValue;
use crate::frame::Sensor;
use crate::stand::Stands;
use crate::sweep::{Gap, Gathered, Kept, Sweep};
use crate::time::Timestamp;

/// A packet that is missing this close to the blade's first or last shot may have held its edge:
/// 2 ms are 7 degrees at ten turns a second.
const NEAR_BLADE_NS: i64 = 2_000_000;

/// A lidar that is so far behind the others has fallen silent, and frames no longer wait for it.
const PATIENCE_NS: i64 = 1_000_000_000;

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
            [
                sum[0] + f64::from(p[0]),
                sum[1] + f64::from(p[1]),
                sum[2] + f64::from(p[2]),
            ]
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
    period_ns: i64,
    next: Timestamp,
    waiting: Vec<VecDeque<(Timestamp, Share)>>,
    ended: bool,
}

impl FrameAssembler {
    /// Frames at `first`, `first + period` and so on, of so many lidars.
    ///
    /// # Errors
    /// [`InvalidValue`] where the period is not positive.
    pub fn new(lidars: usize, first: Timestamp, period_ns: i64) -> Result<Self, InvalidValue> {
        if period_ns <= 0 {
            return Err(InvalidValue {
                name: "rate_hz",
                expected: "a rate above zero".into(),
                found: format!("a period of {period_ns} ns"),
            });
        }
        let waiting = vec![VecDeque::new(); lidars];
        Ok(Self {
            period_ns,
            next: first,
            waiting,
            ended: false,
        })
    }

    /// Takes what a lidar's next sweep gives, and the middle of that sweep.
    pub fn push(&mut self, lidar: usize, middle: Timestamp, share: Share) {
        self.waiting[lidar].push_back((middle, share));
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
        let newest = self
            .waiting
            .iter()
            .filter_map(|queue| queue.back())
            .map(|(t, _)| *t)
            .max();
        let overdue = newest.is_some_and(|newest| newest - self.next > PATIENCE_NS);
        let ready = if self.ended || overdue {
            self.waiting.iter().any(complete)
        } else {
            self.waiting.iter().all(complete)
        };
        if !ready {
            return None;
        }
        let (time, reach) = (self.next, self.period_ns);
        let shares = self
            .waiting
            .iter_mut()
            .map(|queue| nearest(queue, time, reach))
            .collect();
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
    queue
        .front()
        .filter(|entry| off(entry) <= reach_ns)
        .map(|e| e.1.clone())
        .unwrap_or_default()
}

/// Echoes of a sweep in the columns that a share is made of.
#[derive(Debug, Clone, Default)]
pub struct ShareEchoes {
    xyz_m: Vec<[f32; 3]>,
    time_ns: Vec<i64>,
    ring: Vec<u16>,
}

impl Kept for ShareEchoes {
    const IS_SLIM: bool = true;

    fn take(&mut self, from: &PointCloud<Sensor>, places: Range<usize>) {
        self.xyz_m.extend_from_slice(&from.xyz_m[places.clone()]);
        self.time_ns
            .extend_from_slice(&from.time_ns[places.clone()]);
        self.ring.extend_from_slice(&from.ring[places]);
    }
}

impl Gathered for ShareEchoes {
    fn count(&self) -> usize {
        self.xyz_m.len()
    }

    fn make_room(&mut self, additional: usize) {
        self.xyz_m.reserve(additional);
        self.time_ns.reserve(additional);
        self.ring.reserve(additional);
    }

    fn empty(&mut self) {
        self.xyz_m.clear();
        self.time_ns.clear();
        self.ring.clear();
    }
}

/// What a sweep gives to a frame, and its middle. Echoes of a lidar on the move do not count.
pub fn share_of(
    sweep: &Sweep<ShareEchoes>,
    stands: &Stands,
    pass: &PassThrough,
) -> (Timestamp, Share) {
    let echoes = &sweep.cloud;
    let Inside { points_m, places } = passing(echoes, stands, pass);
    let place = |place: &u32| *place as usize;
    let rings = places.iter().map(|p| echoes.ring[place(p)]).collect();
    let times = || places.iter().map(|p| Timestamp(echoes.time_ns[place(p)]));
    let seen = times().min().zip(times().next_back());
    let seen = seen.map(|(from, to)| Gap { from, to }); // first and last shot that passed
    // Where nothing is left of the blade, any gap may have held it.
    let overlaps = |gap: &Gap| {
        seen.is_none_or(|s| gap.from <= s.to + NEAR_BLADE_NS && s.from <= gap.to + NEAR_BLADE_NS)
    };
    let share = Share {
        present: true,
        points_m,
        rings,
        lost_on_blade: sweep.gaps.iter().any(overlaps),
    };
    (sweep.start + (sweep.end - sweep.start) / 2, share)
}

/// Echoes in the box, of which those of a lidar that was moved are looked at one by one.
fn passing(echoes: &ShareEchoes, stands: &Stands, pass: &PassThrough) -> Inside {
    if let Some(stand) = stands.only() {
        return pass.view(&stand.pose).inside(&echoes.xyz_m);
    }
    let mut inside = Inside::default();
    for (place, (xyz_m, time_ns)) in (0..).zip(echoes.xyz_m.iter().zip(&echoes.time_ns)) {
        let Some(stand) = stands.at(*time_ns) else {
            continue; // on the move
        };
        let point = stand.pose.transform(&Point3::from(xyz_m.map(f64::from)));
        let point = [point.x as f32, point.y as f32, point.z as f32];
        if pass.contains(&point) {
            inside.points_m.push(point);
            inside.places.push(place);
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Return;
    use crate::frame::WorldFromSensor;
    use nalgebra::{Rotation3, Vector3};

    const PERIOD: i64 = 100_000_000;

    /// A sweep with one echo per millisecond around `middle`, at x = 1 .. 5 m of the sensor.
    fn sweep(lidar: usize, middle: i64, gaps: Vec<Gap>) -> Sweep<ShareEchoes> {
        let mut cloud = PointCloud::default();
        for k in 0..5i64 {
            let time = Timestamp(middle + (k - 2) * 1_000_000);
            cloud.push(&Return {
                ring: k as u16,
                ..Return::made_up([1.0 + k as f32, 0.0, 0.0], time)
            });
        }
        let mut kept = ShareEchoes::default();
        kept.take(&cloud, 0..cloud.len());
        Sweep {
            lidar,
            index: 0,
            cloud: kept,
            start: Timestamp(middle - PERIOD / 2),
            end: Timestamp(middle + PERIOD / 2),
            coverage: 1.0,
            packets: 75,
            lost: gaps.len() as u32,
            gaps,
        }
    }

    fn assembler(lidars: usize) -> FrameAssembler {
        FrameAssembler::new(lidars, Timestamp(0), PERIOD).unwrap()
    }

    fn push(frames: &mut FrameAssembler, sweep: &Sweep<ShareEchoes>) {
        let pose = WorldFromSensor::new(Rotation3::identity(), Vector3::new(0.0, 0.0, 80.0));
        let pass = PassThrough::new([1.5, -1.0, 70.0], [9.0, 1.0, 90.0]).unwrap();
        let (middle, share) = share_of(sweep, &Stands::still(sweep.lidar, pose), &pass);
        frames.push(sweep.lidar, middle, share);
    }

    #[test]
    fn the_nearest_sweep_of_each_lidar_makes_the_frame() {
        let mut frames = assembler(2);
        for k in 0..4 {
            push(&mut frames, &sweep(0, k * PERIOD + 10_000_000, vec![]));
            push(&mut frames, &sweep(1, k * PERIOD - 30_000_000, vec![]));
        }
        let first = frames.pop().unwrap();
        assert_eq!(first.time, Timestamp(0));
        assert!(first.shares.iter().all(|share| share.present));
        // x = 1 lies outside of the box; the rest stands in the world frame.
        assert_eq!(first.shares[0].points_m[0], [2.0, 0.0, 80.0]);
        assert_eq!(first.shares[0].rings, [1, 2, 3, 4]);
        assert_eq!(frames.pop().unwrap().time, Timestamp(PERIOD));
        assert_eq!(frames.pop().unwrap().time, Timestamp(2 * PERIOD));
        assert!(
            frames.pop().is_none(),
            "a later sweep of lidar 1 may be nearer"
        );
        frames.finish();
        assert!(
            frames
                .pop()
                .unwrap()
                .shares
                .iter()
                .all(|share| share.present)
        );
        assert!(frames.pop().is_none());
    }

    #[test]
    fn a_silent_lidar_is_absent_and_does_not_hold_up_the_others() {
        let mut frames = assembler(2);
        push(&mut frames, &sweep(1, 0, vec![]));
        for k in 0..30 {
            push(&mut frames, &sweep(0, k * PERIOD, vec![]));
        }
        let present: Vec<bool> = std::iter::from_fn(|| frames.pop())
            .map(|frame| frame.shares[1].present)
            .collect();
        assert!(present.len() > 15 && present[0] && !present[3]);
    }

    #[test]
    fn only_gaps_where_the_blade_was_seen_count() {
        let gap = |from, to| Gap {
            from: Timestamp(from),
            to: Timestamp(to),
        };
        let near = sweep(0, 0, vec![gap(500_000, 1_800_000)]);
        let far = sweep(0, 0, vec![gap(30_000_000, 31_300_000)]);
        for (sweep, expected) in [(near, true), (far, false)] {
            let mut frames = assembler(1);
            push(&mut frames, &sweep);
            assert_eq!(frames.pop().unwrap().shares[0].lost_on_blade, expected);
        }
    }

    #[test]
    fn the_distance_is_from_the_mean_of_the_points() {
        let share = Share {
            points_m: vec![[2.0, 0.0, 80.0], [4.0, 0.0, 80.0]],
            ..Share::default()
        };
        assert_eq!(share.distance_m(&Point3::new(0.0, 4.0, 80.0)), Some(5.0));
        assert_eq!(Share::default().distance_m(&Point3::origin()), None);
    }
}
