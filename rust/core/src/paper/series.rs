//! The frames of a whole test: steps 6 to 10 in parallel, then questions asked of all of them.

use rayon::prelude::*;

use super::frame::{BladePoints, FrameContours, FrameParams, ShareUse, frame_contours};
use super::frames::Frame;
use super::sections::MidLine;
use super::tip::Plane;
use crate::time::Timestamp;
use nalgebra::Point3;

/// Smallest and largest distance d of equation (10) of each lidar.
#[derive(Debug, Clone)]
pub struct DistanceRanges(Vec<Option<[f64; 2]>>);

impl DistanceRanges {
    /// Nothing seen yet by so many lidars.
    pub fn new(lidars: usize) -> Self {
        Self(vec![None; lidars])
    }

    /// Takes more frames of lidars at these places, metres.
    pub fn extend(&mut self, frames: &[Frame], sensors_m: &[Point3<f64>]) {
        for frame in frames {
            for ((range, share), sensor) in self.0.iter_mut().zip(&frame.shares).zip(sensors_m) {
                let Some(d) = share.distance_m(sensor) else {
                    continue;
                };
                let [low, high] = range.unwrap_or([d, d]);
                *range = Some([low.min(d), high.max(d)]);
            }
        }
    }

    /// Per lidar, metres; `None` where it saw no blade.
    pub fn ranges_m(&self) -> &[Option<[f64; 2]>] {
        &self.0
    }
}

/// What of some frames is kept to look at.
#[derive(Debug, Clone, Copy)]
pub struct Sampling {
    /// One frame in so many.
    pub every: usize,
    /// At most so many points of one lidar.
    pub points: usize,
}

/// Columns of blade points that were kept.
#[derive(Debug, Clone, Default)]
pub struct PointColumns {
    /// Middle of the frame, nanoseconds.
    pub time_ns: Vec<i64>,
    /// Number of the lidar.
    pub lidar: Vec<u32>,
    /// Beam.
    pub ring: Vec<u32>,
    /// Position, metres, world frame.
    pub xyz_m: Vec<[f32; 3]>,
}

impl PointColumns {
    fn extend(&mut self, time: Timestamp, lidar: usize, blade: &BladePoints) {
        let count = blade.rings.len();
        self.time_ns.extend(std::iter::repeat_n(time.0, count));
        self.lidar.extend(std::iter::repeat_n(lidar as u32, count));
        self.ring
            .extend(blade.rings.iter().map(|ring| u32::from(*ring)));
        self.xyz_m.extend_from_slice(&blade.points_m);
    }
}

/// Columns of contour samples that were left out (step 8).
#[derive(Debug, Clone, Default)]
pub struct LeftOutColumns {
    /// Middle of the frame, nanoseconds.
    pub time_ns: Vec<i64>,
    /// Why.
    pub reason: Vec<&'static str>,
    /// Samples.
    pub count: Vec<u32>,
    /// Centre of the cluster, metres, world frame.
    pub centre_m: Vec<[f64; 3]>,
}

/// Contours of all frames in the order of time.
#[derive(Debug)]
pub struct ContourSeries {
    params: FrameParams,
    sampling: Sampling,
    frames: Vec<FrameContours>,
    points: PointColumns,
}

impl ContourSeries {
    /// Nothing yet.
    pub fn new(params: FrameParams, sampling: Sampling) -> Self {
        Self {
            params,
            sampling,
            frames: Vec::new(),
            points: PointColumns::default(),
        }
    }

    /// Takes the next frames, in parallel; the order and the bits of the results do not depend on it.
    pub fn extend(&mut self, frames: &[Frame]) {
        let (params, sampling, done) = (&self.params, self.sampling, self.frames.len());
        let results: Vec<(FrameContours, Vec<BladePoints>)> = frames
            .par_iter()
            .enumerate()
            .map(|(index, frame)| {
                let (contours, mut blades) = frame_contours(frame, params);
                if !(done + index).is_multiple_of(sampling.every.max(1)) {
                    blades.clear();
                }
                (contours, blades)
            })
            .collect();
        for (contours, blades) in results {
            for (lidar, blade) in blades.iter().enumerate() {
                let kept = blade.thinned(sampling.points);
                self.points.extend(contours.time, lidar, &kept);
            }
            self.frames.push(contours);
        }
    }

    /// All frames.
    pub fn frames(&self) -> &[FrameContours] {
        &self.frames
    }

    /// Points that were kept to look at.
    pub fn sampled_points(&self) -> PointColumns {
        self.points.clone()
    }

    /// Contour samples that were left out, of the frames whose points were kept.
    pub fn left_out(&self) -> LeftOutColumns {
        let mut columns = LeftOutColumns::default();
        for frame in self.frames.iter().step_by(self.sampling.every.max(1)) {
            for rejected in &frame.rejected {
                columns.time_ns.push(frame.time.0);
                columns.reason.push(rejected.reason);
                columns.count.push(rejected.count);
                columns.centre_m.push(rejected.centre_m);
            }
        }
        columns
    }

    /// What keeps each frame from a tip on a plane, `None` where nothing does.
    pub fn failures(&self, plane: Plane) -> Vec<Option<&'static str>> {
        let of = |frame: &FrameContours| match (&frame.contours, frame.tip(plane)) {
            (None, _) if frame.uses.iter().any(|used| used.used > 0) => Some("few_samples"),
            (None, _) => Some("no_points"),
            (_, Err(failure)) => Some(failure.name()),
            (_, Ok(_)) => None,
        };
        self.frames.iter().map(of).collect()
    }

    /// First and last z of the contours of each frame, metres; NaN without contours.
    pub fn seen_z_m(&self) -> Vec<[f64; 2]> {
        let of = |frame: &FrameContours| match &frame.contours {
            None => [f64::NAN; 2],
            Some(both) => {
                let (a, b) = (both.leading.seen_z_m, both.trailing.seen_z_m);
                [a[0].min(b[0]), a[1].max(b[1])]
            }
        };
        self.frames.iter().map(of).collect()
    }

    /// z of the tip of each frame, metres; NaN where there is none.
    pub fn tip_z_m(&self, plane: Plane) -> Vec<f64> {
        self.frames
            .iter()
            .map(|frame| frame.tip(plane).map_or(f64::NAN, |tip| tip.z_m))
            .collect()
    }

    /// Arc length (15) from each z to the tip, metres; frame by frame, NaN without a tip.
    pub fn arc_to_tip_m(&self, plane: Plane, z_m: &[f64]) -> Vec<f64> {
        self.at_each(z_m, f64::NAN, |frame, z| {
            let tip = frame.tip(plane).ok()?;
            mid_line(frame)?.length_m(z, tip.z_m).ok()
        })
    }

    /// Points of the mid-chord line so far before the tip, metres; frame by frame, NaN without one.
    pub fn sections_m(&self, plane: Plane, to_tip_m: &[f64]) -> Vec<[f64; 3]> {
        self.at_each(to_tip_m, [f64::NAN; 3], |frame, length| {
            let tip = frame.tip(plane).ok()?;
            mid_line(frame)?.before_tip_m(tip.z_m, length).ok()
        })
    }

    /// Points of the mid-chord line at each z, metres; frame by frame, NaN without contours.
    pub fn points_at_m(&self, z_m: &[f64]) -> Vec<[f64; 3]> {
        self.at_each(z_m, [f64::NAN; 3], |frame, z| {
            Some(mid_line(frame)?.point_m(z))
        })
    }

    /// Leading minus trailing edge at each z, metres; frame by frame, NaN without contours.
    pub fn chords_at_m(&self, z_m: &[f64]) -> Vec<[f64; 3]> {
        self.at_each(z_m, [f64::NAN; 3], |frame, z| {
            Some(frame.contours.as_ref()?.chord_m(z))
        })
    }

    /// What became of each lidar's share, frame by frame.
    pub fn uses<T>(&self, of: impl Fn(&ShareUse) -> T) -> Vec<T> {
        self.frames
            .iter()
            .flat_map(|frame| frame.uses.iter().map(&of))
            .collect()
    }

    fn at_each<T: Clone + Send + Sync>(
        &self,
        places: &[f64],
        missing: T,
        of: impl Fn(&FrameContours, f64) -> Option<T> + Sync,
    ) -> Vec<T> {
        let row = |frame: &FrameContours| -> Vec<T> {
            places
                .iter()
                .map(|p| of(frame, *p).unwrap_or_else(|| missing.clone()))
                .collect()
        };
        let rows: Vec<Vec<T>> = self.frames.par_iter().map(row).collect();
        rows.concat()
    }
}

fn mid_line(frame: &FrameContours) -> Option<MidLine> {
    frame.contours.as_ref()?.middle().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::line::LineParams;
    use crate::cluster::radius::{Intervals, RadiusModel};
    use crate::fit::arc::SpanAxis;
    use crate::paper::curves::Degrees;
    use crate::paper::frame::RadiusRule;
    use crate::paper::frames::Share;
    use crate::paper::tip::TipLimits;
    use nalgebra::Vector3;
    use rayon::ThreadPoolBuilder;

    /// Tip of the wedge that stands for a blade, metres.
    const TIP_M: f64 = 110.0;

    /// A flat wedge at height 0, shifted by `x_m`, seen in eight lines around `middle_m`, with two stray echoes
    /// and, in the last line, a saddle that sticks out by 3 m.
    fn share(middle_m: f64, x_m: f64, has_saddle: bool) -> Share {
        let mut share = Share {
            present: true,
            ..Share::default()
        };
        for ring in 0..8u16 {
            let z = middle_m + 0.3 * (f64::from(ring) - 3.5);
            let half = 0.05 * (TIP_M - z) + if has_saddle && ring == 7 { 3.0 } else { 0.0 };
            for k in 0..=100 {
                let x = x_m + half * (f64::from(k) / 50.0 - 1.0);
                share.points_m.push([x as f32, 0.0, z as f32]);
                share.rings.push(ring);
            }
        }
        share
            .points_m
            .extend([[9.0, 3.0, middle_m as f32], [-4.0, 2.0, middle_m as f32]]);
        share.rings.extend([3, 3]);
        share
    }

    fn sensors_m() -> Vec<Point3<f64>> {
        vec![Point3::new(0.0, -7.0, 90.0), Point3::new(0.0, -7.0, 104.0)]
    }

    fn params(rule: RadiusRule) -> FrameParams {
        FrameParams {
            sensors_m: sensors_m(),
            model: RadiusModel::new(0.2f64.to_radians(), 1.5, 0.05, 4).unwrap(),
            rule,
            min_points: 4,
            strict: false,
            leading_edge: -Vector3::x_axis(),
            contour_radius_m: None,
            contour_min_points: 3,
            line: LineParams::new(SpanAxis::Z, [1, 1], 0.6).unwrap(),
            degrees: Degrees::new(1, 2).unwrap(),
            tip: TipLimits::new(5.0).unwrap(),
            overhead_m: None,
        }
    }

    fn frame(x_m: f64) -> Frame {
        let shares = vec![share(90.0, x_m, true), share(104.0, x_m, false)];
        Frame {
            time: Timestamp(7),
            shares,
        }
    }

    fn series(frames: &[Frame], params: FrameParams) -> ContourSeries {
        let mut series = ContourSeries::new(
            params,
            Sampling {
                every: 1,
                points: 50,
            },
        );
        series.extend(frames);
        series
    }

    #[test]
    fn a_wedge_gives_its_tip_and_its_sections_despite_strays_and_a_saddle() {
        let mut ranges = DistanceRanges::new(2);
        ranges.extend(&[frame(0.0), frame(2.0)], &sensors_m());
        let division = |range: &Option<[f64; 2]>| {
            range.map(|[low, high]| Intervals::new(low, high, 8).unwrap())
        };
        let intervals = RadiusRule::Intervals(ranges.ranges_m().iter().map(division).collect());
        for rule in [intervals, RadiusRule::Continuous] {
            let series = series(&[frame(0.0), frame(2.0)], params(rule));
            assert_eq!(series.failures(Plane::Xoz), [None, None]);
            for (tip, x_m) in series.tip_z_m(Plane::Xoz).into_iter().zip([0.0, 2.0]) {
                assert!((tip - TIP_M).abs() < 1e-3, "{tip} at {x_m}");
            }
            let sections = series.sections_m(Plane::Xoz, &[20.0]);
            for (section, x_m) in sections.iter().zip([0.0, 2.0]) {
                let expected = Vector3::new(x_m, 0.0, TIP_M - 20.0);
                assert!((Vector3::from(*section) - expected).norm() < 1e-3);
            }
            // Strays were noise of step 6, the saddle's line did not agree in step 8.
            assert_eq!(series.uses(|used| used.points - used.used), [2, 2, 2, 2]);
            assert_eq!(series.left_out().reason, ["alone"; 4]);
        }
    }

    #[test]
    fn both_edges_at_one_height_give_no_tip_there() {
        let series = series(&[frame(0.0)], params(RadiusRule::Continuous));
        assert!(series.failures(Plane::Yoz)[0].is_some());
        assert!(series.sections_m(Plane::Yoz, &[20.0])[0][0].is_nan());
    }

    #[test]
    fn an_overhead_blade_and_an_empty_frame_are_named() {
        let overhead = FrameParams {
            overhead_m: Some(1.5),
            ..params(RadiusRule::Continuous)
        };
        let empty = Frame {
            time: Timestamp(0),
            shares: vec![Share::default(); 2],
        };
        let series = series(&[frame(0.0), frame(20.0), empty], overhead);
        assert_eq!(
            series.uses(|used| used.overhead),
            [true, true, false, false, false, false]
        );
        assert_eq!(series.failures(Plane::Xoz)[0], Some("no_points"));
        assert_eq!(series.failures(Plane::Xoz)[2], Some("no_points"));
        assert!(series.seen_z_m()[0][0].is_nan());
    }

    #[test]
    fn results_are_the_same_for_any_number_of_threads() {
        let frames: Vec<Frame> = (0..16).map(|k| frame(0.1 * f64::from(k))).collect();
        let with = |threads: usize| {
            let pool = ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let params = params(RadiusRule::Continuous);
            pool.install(|| series(&frames, params).sections_m(Plane::Xoz, &[5.0, 20.0]))
        };
        assert_eq!(with(1), with(3));
    }
}
