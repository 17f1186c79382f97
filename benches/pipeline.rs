//! How much faster than the test itself is the paper's method, from capture bytes to sections?
//!
//! Three seconds of a simulated edgewise test with four VLP-16, in memory. Throughput in milliseconds of
//! test: 1000 elements a second are real time.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lidar_deflect_core::capture::{DatagramBatch, DatagramReader};
use lidar_deflect_core::cluster::line::LineParams;
use lidar_deflect_core::cluster::radius::{Intervals, RadiusModel};
use lidar_deflect_core::fit::arc::SpanAxis;
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::curves::Degrees;
use lidar_deflect_core::paper::frame::{FrameParams, RadiusRule};
use lidar_deflect_core::paper::frames::Frame;
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::paper::reader::{FramePlan, FrameReader};
use lidar_deflect_core::paper::series::{ContourSeries, DistanceRanges, Sampling};
use lidar_deflect_core::paper::tip::{Plane, TipLimits};
use lidar_deflect_core::stream::{Reading, ScanReport};
use lidar_deflect_core::time::Timestamp;
use nalgebra::Vector3;
use std::hint::black_box;

#[path = "edgewise.rs"]
mod edgewise;

use edgewise::{START, capture, scan};

const PERIOD_NS: i64 = 100_000_000;

/// Bytes of a batch.
const BATCH_BYTES: usize = 1 << 19;

/// Hands a capture over in batches; the next one is read beside.
fn by_batches(bytes: &[u8], mut take: impl FnMut(&DatagramBatch) + Send) {
    let mut reader = DatagramReader::new(bytes).unwrap();
    let (mut batch, mut ahead) = (DatagramBatch::default(), DatagramBatch::default());
    loop {
        let fill = || {
            ahead.clear();
            while ahead.bytes() < BATCH_BYTES
                && let Some(datagram) = reader.next().unwrap()
            {
                ahead.push(&datagram);
            }
        };
        rayon::join(fill, || take(&batch));
        std::mem::swap(&mut batch, &mut ahead);
        if batch.is_empty() {
            return;
        }
    }
}

fn frames(bytes: &[u8], report: &ScanReport, poses: &[WorldFromSensor]) -> Vec<Frame> {
    let plan = FramePlan {
        lidars: (0..poses.len()).collect(),
        poses: poses.to_vec(),
        moves: Vec::new(),
        cut_azimuth_rad: vec![0.0; poses.len()],
        pass: PassThrough::new([-5.0, -4.0, 70.0], [12.0, 6.0, 111.0]).unwrap(),
        first: START + PERIOD_NS,
        period_ns: PERIOD_NS,
        start: START,
        stop: Timestamp(i64::MAX),
    };
    let mut reader = FrameReader::new(report, &plan).unwrap();
    by_batches(bytes, |batch| reader.push(batch));
    reader.finish();
    std::iter::from_fn(|| reader.pop()).collect()
}

/// Step 6: the intervals of the distance over the whole test, what the first pass is for.
fn rule(frames: &[Frame], poses: &[WorldFromSensor]) -> RadiusRule {
    let sensors: Vec<_> = poses
        .iter()
        .map(|pose| pose.translation_m().into())
        .collect();
    let mut ranges = DistanceRanges::new(sensors.len());
    ranges.extend(frames, &sensors);
    let division = |[low, high]: [f64; 2]| Intervals::new(low, high, 8).unwrap();
    let divisions = ranges.ranges_m().iter().map(|range| range.map(division));
    RadiusRule::Intervals(divisions.collect())
}

fn params(poses: &[WorldFromSensor], rule: RadiusRule) -> FrameParams {
    FrameParams {
        sensors_m: poses
            .iter()
            .map(|pose| pose.translation_m().into())
            .collect(),
        model: RadiusModel::new(0.2_f64.to_radians(), 1.5, 0.05, 4).unwrap(),
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

fn sections(frames: &[Frame], params: &FrameParams) -> Vec<[f64; 3]> {
    let mut series = ContourSeries::new(
        params.clone(),
        Sampling {
            every: 50,
            points: 500,
        },
    );
    series.extend(frames);
    series.sections_m(Plane::Xoz, &[36.0, 20.0, 10.0])
}

fn pipeline(c: &mut Criterion) {
    let (bytes, poses) = capture(edgewise::simulation());
    let report = scan(&bytes);
    let assembled = frames(&bytes, &report, &poses);
    let by_interval = params(&poses, rule(&assembled, &poses));
    let by_point = params(&poses, RadiusRule::Continuous);
    let mut group = c.benchmark_group("pipeline");
    group.sample_size(20).throughput(Throughput::Elements(3000));
    group.bench_function("scan", |b| b.iter(|| scan(black_box(&bytes))));
    group.bench_function("sweeps and frames", |b| {
        b.iter(|| frames(black_box(&bytes), &report, &poses));
    });
    group.bench_function("clusters, contours, sections", |b| {
        b.iter(|| sections(black_box(&assembled), &by_interval));
    });
    group.bench_function("the same, a radius per point", |b| {
        b.iter(|| sections(black_box(&assembled), &by_point));
    });
    group.bench_function("whole", |b| {
        b.iter(|| {
            let report = scan(black_box(&bytes));
            let frames = frames(&bytes, &report, &poses);
            sections(&frames, &params(&poses, rule(&frames, &poses)))
        });
    });
    group.finish();
}

criterion_group!(benches, pipeline);
criterion_main!(benches);
