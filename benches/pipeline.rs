//! How much faster than the test itself is the paper's method, from capture bytes to sections?
//!
//! Three seconds of a simulated edgewise test with four VLP-16, in memory. Throughput in milliseconds of
//! test: 1000 elements a second are real time.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lidar_deflect_core::capture::{DatagramBatch, DatagramReader, PcapWriter};
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
use lidar_deflect_core::stream::{Scan, ScanOptions, ScanReport};
use lidar_deflect_core::synthetic::blade::{BuildErrors, Orientation};
use lidar_deflect_core::synthetic::echo::Optics;
use lidar_deflect_core::synthetic::lidar::{Clock, LidarPlan};
use lidar_deflect_core::synthetic::motion::Schedule;
use lidar_deflect_core::synthetic::network::NetworkPlan;
use lidar_deflect_core::synthetic::plan::{SaddlePlan, axes};
use lidar_deflect_core::synthetic::reference::Stations;
use lidar_deflect_core::synthetic::sensor::Sensor;
use lidar_deflect_core::synthetic::terrain::GroundPlan;
use lidar_deflect_core::synthetic::{ScenePlan, Simulation};
use lidar_deflect_core::time::Timestamp;
use nalgebra::Vector3;
use std::hint::black_box;

const START: Timestamp = Timestamp(1_718_000_000_000_000_000);
const PERIOD_NS: i64 = 100_000_000;
/// Places of the four lidars along the span, metres.
const PLACES_M: [f64; 4] = [86.0, 94.0, 102.0, 109.5];

fn lidar(index: u8, z_m: f64) -> LidarPlan {
    LidarPlan {
        sensor: std::sync::Arc::new(Sensor::new("vlp16").unwrap()),
        kick: None,
        silent_s: Vec::new(),
        address: [192, 168, 1, 201 + index],
        port: 2368,
        position_m: Vector3::new(3.0, -7.0, z_m),
        axes: axes([-Vector3::x(), -Vector3::y(), Vector3::z()]).unwrap(),
        tilt_rad: 0.0,
        rpm: 600.0,
        clock: Clock {
            offset_ns: 0,
            drift: 0.0,
            locked: true,
        },
        channel_offset_m: 0.007,
        unit_offset_m: 0.004,
    }
}

fn scene() -> ScenePlan {
    ScenePlan {
        seed: 1,
        start: START,
        stations: Stations::reference("iea15-110m", None).unwrap(),
        orientation: Orientation {
            leading_edge: -Vector3::x(),
            suction_side: Vector3::y(),
        },
        errors: BuildErrors {
            waves_m: 0.002,
            ..Default::default()
        },
        direction: Vector3::x(),
        follower: false,
        saddles: vec![SaddlePlan {
            s_m: 95.0,
            force_n: 3e4,
            lever_m: [0.0, 0.0],
            anchor_m: Vector3::new(42.0, -7.0, 95.0),
        }],
        show_saddles: true,
        cable_radius_m: 0.012,
        schedule: Schedule {
            levels: vec![0.0, 1.0],
            hold_s: 1.0,
            ramp_s: 1.0,
        },
        sways: Vec::new(),
        root_turn_rad: Vector3::zeros(),
        ground: GroundPlan {
            height_m: -8.0,
            slope: [0.01, 0.0],
            roughness_m: 0.01,
            correlation_m: 0.8,
            swell_m: 0.0,
        },
        wall: None,
        boxes: Vec::new(),
        targets: Vec::new(),
        lidars: (0..)
            .zip(PLACES_M)
            .map(|(index, z_m)| lidar(index, z_m))
            .collect(),
        optics: Optics {
            beam_rad: 3e-3,
            noise_m: 0.014,
            dropout: 0.01,
            merge_m: 0.45,
            range_at_10_percent_m: 60.0,
            max_range_m: 100.0,
            grazing_rad: 1.5,
            incidence_bias_m: 0.0,
            faint_bias_m: 0.0,
            retro_bias_m: 0.0,
            noise_freedom: 0,
        },
        network: NetworkPlan {
            loss: 0.004,
            jitter_s: 35e-6,
            ..Default::default()
        },
    }
}

/// Bytes of the capture and the poses of its lidars.
fn capture() -> (Vec<u8>, Vec<WorldFromSensor>) {
    let mut simulation = Simulation::new(scene()).unwrap();
    let mut writer = PcapWriter::new(Vec::new()).unwrap();
    while simulation.advance(&mut writer).unwrap() {}
    let poses = simulation
        .lidars
        .iter()
        .map(|lidar| lidar.world_from_sensor)
        .collect();
    (writer.into_inner(), poses)
}

fn scan(bytes: &[u8]) -> ScanReport {
    let mut reader = DatagramReader::new(bytes).unwrap();
    let mut scan = Scan::new(ScanOptions::default());
    while let Some(datagram) = reader.next().unwrap() {
        scan.push(&datagram);
    }
    scan.finish()
}

fn frames(bytes: &[u8], report: &ScanReport, poses: &[WorldFromSensor]) -> Vec<Frame> {
    let mut datagrams = DatagramReader::new(bytes).unwrap();
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
    let mut batch = DatagramBatch::default();
    while let Some(datagram) = datagrams.next().unwrap() {
        batch.push(&datagram);
        if batch.bytes() > 2 << 20 {
            reader.push(&batch);
            batch.clear();
        }
    }
    reader.push(&batch);
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
    let (bytes, poses) = capture();
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
