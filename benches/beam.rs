//! How much faster than the test itself is the beam method, from capture bytes to states?
//!
//! Three seconds of a simulated edgewise test with four VLP-16, in memory. Throughput in milliseconds of
//! test: 1000 elements a second are real time. The adjustment of the holds is a cost once per test.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lidar_deflect_core::beam::adjust::{Adjustment, Gates, Hold, Problem, Stage};
use lidar_deflect_core::beam::carry::Knowledge;
use lidar_deflect_core::beam::design::{self, Design, Outlines};
use lidar_deflect_core::beam::echoes::Seen;
use lidar_deflect_core::beam::family::{Loading, Trust};
use lidar_deflect_core::beam::gather::{Gather, GatherPlan};
use lidar_deflect_core::beam::layout::RIG;
use lidar_deflect_core::beam::mesh::Mesh;
use lidar_deflect_core::beam::rig::Rig;
use lidar_deflect_core::beam::shape::{Shape, ShapeTrust};
use lidar_deflect_core::beam::track::{Followed, Stretch, load_knots};
use lidar_deflect_core::beam::weights::Weights;
use lidar_deflect_core::capture::{DatagramBatch, DatagramReader};
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::stand::Stands;
use lidar_deflect_core::stream::{Reading, ScanReport};
use lidar_deflect_core::synthetic::blade::Blade;
use nalgebra::{DMatrix, DVector, Vector3};
use std::hint::black_box;
use std::sync::Arc;

#[path = "edgewise.rs"]
mod edgewise;

use edgewise::{START, capture, scan};

const CHANNELS: usize = 16;
const SADDLE_M: f64 = 95.0;
const FULL_N: f64 = 3e4;
/// Both holds, and what is between them, milliseconds since the start.
const HOLDS_MS: [(i64, i64); 2] = [(100, 900), (2100, 2900)];
const STRETCH_MS: (i64, i64) = (1000, 2000);
/// Bytes of datagrams that lidars look at side by side.
const BATCH_BYTES: usize = 1 << 19;
/// Sections whose states are wanted, metres.
const SECTIONS_M: [f64; 3] = [84.0, 100.0, 110.0];

fn gates(echo_m: f64, stage: Stage) -> Gates {
    Gates {
        echo_m,
        edge_m: echo_m,
        stage,
    }
}

fn span_ns((from_ms, to_ms): (i64, i64)) -> (i64, i64) {
    (START.0 + from_ms * 1_000_000, START.0 + to_ms * 1_000_000)
}

/// What is seen of the blade in the holds and, in the middle, between them.
fn gathered(bytes: &[u8], report: &ScanReport, poses: &[WorldFromSensor]) -> Vec<Arc<Seen>> {
    let lidars: Vec<usize> = (0..poses.len()).collect();
    let plan = GatherPlan {
        lidars: &lidars,
        cuts_rad: &vec![0.0; lidars.len()],
        stands: Stands::of(poses, &[]).unwrap(),
        pass: PassThrough::new([-6.0, -5.0, 60.0], [12.0, 6.0, 112.0]).unwrap(),
    };
    let windows = [HOLDS_MS[0], STRETCH_MS, HOLDS_MS[1]].map(span_ns);
    let mut gather = Gather::new(report, plan, &windows).unwrap();
    let mut batch = DatagramBatch::default();
    let mut datagrams = DatagramReader::new(bytes).unwrap();
    while let Some(datagram) = datagrams.next().unwrap() {
        batch.push(&datagram);
        if batch.bytes() > BATCH_BYTES {
            gather.push(&batch);
            batch.clear();
        }
    }
    gather.push(&batch);
    gather.finish();
    std::iter::from_fn(|| gather.pop()).map(Arc::new).collect()
}

/// The drawing of the simulated blade.
fn mesh(blade: &Blade) -> Mesh {
    let drawn = blade.nominal.clone();
    let outlines = Outlines {
        points: drawn
            .s_m
            .iter()
            .map(|s| blade.nominal_contour(*s).to_vec())
            .collect(),
        s_m: drawn.s_m.clone(),
    };
    let stations = design::Stations {
        s_m: drawn.s_m,
        chord_m: drawn.chord_m,
        twist_rad: drawn.twist_rad,
        prebend_m: drawn.prebend_m,
        axis_fraction: drawn.axis_fraction,
        ei_edge_nm2: drawn.ei_edge_nm2,
        ei_flap_nm2: drawn.ei_flap_nm2,
        gj_nm2: drawn.gj_nm2,
    };
    let design = Design::new(stations, outlines, &-Vector3::x(), &Vector3::y()).unwrap();
    Mesh::new(&design, &[SADDLE_M])
}

/// Standard deviation of an unknown of a lidar: rotation, place, elevation, scale, channels.
fn sigma(place: usize) -> f64 {
    match place {
        0..3 | 6 => 3e-4,
        3..6 => 2e-3,
        7 => 1e-4,
        _ => 5e-3,
    }
}

/// The adjustment of both holds at its start, with poses known to a third of a milliradian and 2 mm.
fn started(mesh: &Mesh, poses: &[WorldFromSensor], seen: &[Arc<Seen>]) -> Adjustment {
    let full_n = vec![Vector3::x() * FULL_N];
    let hold = |(place, share): (usize, f64)| Hold {
        seen: seen[2 * place].clone(),
        span_ns: span_ns(HOLDS_MS[place]),
        loading: Loading {
            force_n: full_n.iter().map(|force| force * share).collect(),
            full_n: FULL_N,
        },
    };
    let problem = Problem {
        shape: Shape::new(mesh, ShapeTrust::default(), 0.45 * mesh.length_m()),
        trust: Trust::default(),
        holds: [(0, 0.0), (1, 1.0)].into_iter().map(hold).collect(),
        saddles: vec![mesh.node_at(SADDLE_M)],
        mesh: mesh.clone(),
        full_n,
    };
    let size = poses.len() * (RIG + CHANNELS);
    let covariance = DMatrix::from_diagonal(&DVector::from_fn(size, |k, _| {
        sigma(k % (RIG + CHANNELS)).powi(2)
    }));
    let channels = vec![CHANNELS; poses.len()];
    let clock_s = vec![1e-4; poses.len()];
    let rig = Rig::new(
        poses.to_vec(),
        channels,
        clock_s,
        DVector::zeros(size),
        covariance,
    )
    .unwrap();
    let weights = Weights {
        noise_m: vec![0.015; poses.len()],
        surface_m: 0.002,
        edge_rad: 1e-4,
        echoes: 20_000,
        common: Vec::new(),
        learned: 0,
    };
    Adjustment::new(problem, rig, weights).unwrap()
}

/// From the start to an estimate that no longer moves.
fn settled(mut holds: Adjustment) -> Adjustment {
    let wide = [
        (3.0, Stage::Loads),
        (1.5, Stage::Loads),
        (0.6, Stage::All),
        (0.2, Stage::All),
    ];
    let all = wide.into_iter().chain([(0.05, Stage::All); 6]);
    for (echo_m, stage) in all {
        holds.step(&gates(echo_m, stage)).unwrap();
        holds.linearise().unwrap();
    }
    holds
}

fn known(holds: &Adjustment) -> Knowledge {
    let solution = holds.solution(&gates(0.05, Stage::All)).unwrap();
    holds.knowledge(&SECTIONS_M, &solution).1
}

/// The states of the second between the holds.
fn follow(holds: &Adjustment, knowledge: &Knowledge, seen: &Arc<Seen>) -> Followed {
    let span = span_ns(STRETCH_MS);
    let share = |time_ns: &i64| (time_ns - span.0) as f64 / (span.1 - span.0) as f64;
    let stretch = Stretch {
        seen: seen.clone(),
        span_ns: span,
        load: load_knots(span)
            .iter()
            .map(|time| share(time).clamp(0.0, 1.0))
            .collect(),
        sway_m: [0.15, 0.15, 0.04, 0.04],
    };
    let loads = [0.0, 1.0];
    let between = stretch.between(&loads);
    let times: Vec<i64> = (0..10)
        .map(|k| span.0 + 50_000_000 + 100_000_000 * k)
        .collect();
    let gates = [0.5, 0.2, 0.1, 0.05].map(|echo_m| gates(echo_m, Stage::All));
    let mut part = holds.stretch(&stretch, &loads).unwrap();
    part.follow((holds, knowledge), between, &times, &gates)
        .unwrap()
}

fn beam(c: &mut Criterion) {
    let simulation = edgewise::simulation();
    let mesh = mesh(&simulation.blade);
    let (bytes, poses) = capture(simulation);
    let report = scan(&bytes);
    let seen = gathered(&bytes, &report, &poses);
    let holds = settled(started(&mesh, &poses, &seen));
    let knowledge = known(&holds);
    let mut group = c.benchmark_group("beam");
    group.sample_size(10).throughput(Throughput::Elements(3000));
    group.bench_function("gather", |b| {
        b.iter(|| gathered(black_box(&bytes), &report, &poses));
    });
    group.bench_function("whole", |b| {
        b.iter(|| {
            let seen = gathered(black_box(&bytes), &report, &poses);
            let holds = settled(started(&mesh, &poses, &seen));
            follow(&holds, &known(&holds), &seen[1])
        });
    });
    group.throughput(Throughput::Elements(1600));
    group.bench_function("one step of both holds", |b| {
        b.iter(|| holds.normal(&gates(0.05, Stage::All)).0.solve());
    });
    group.bench_function("what both holds tell", |b| b.iter(|| known(&holds)));
    group.throughput(Throughput::Elements(1000));
    group.bench_function("a stretch of one second", |b| {
        b.iter(|| follow(&holds, &knowledge, &seen[1]));
    });
    group.finish();
}

criterion_group!(benches, beam);
criterion_main!(benches);
