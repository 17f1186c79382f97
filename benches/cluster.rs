//! How long does it take to label a cloud of so many points, on one thread and on all?
//!
//! `cargo bench --bench cluster`; brute force stands in the same group where it ends in time.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lidar_deflect_core::cluster::{DbscanParams, dbscan, dbscan_brute};
use lidar_deflect_core::neighbors::{Neighbors, within_brute};
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::{ThreadPool, ThreadPoolBuilder};

const SIZES: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];
const BRUTE_UP_TO: usize = 10_000;
/// About 28 neighbours on a surface of 400 points per square metre.
const RADIUS_M: f64 = 0.15;
const MIN_POINTS: usize = 4;

/// A wavy surface at constant density, 2 cm of noise, one stray point in twenty; nearly in the order
/// in which a lidar would send it.
fn surface(count: usize) -> Vec<[f32; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let side_m = (count as f64 / 400.0).sqrt() as f32;
    let mut point = |i: usize| {
        let z = side_m * (i as f32 / count as f32 + rng.random_range(-0.01..0.01));
        let x = rng.random_range(0.0..side_m);
        let stray = if i.is_multiple_of(20) { 3.0 } else { 0.02 };
        [
            x,
            (0.7 * x).sin() + (0.3 * z).cos() + rng.random_range(-stray..stray),
            z,
        ]
    };
    (0..count).map(&mut point).collect()
}

/// Radii that grow along the cloud, as with range.
fn radii_m(points: &[[f32; 3]]) -> Vec<f64> {
    let far = points.iter().fold(1.0, |far: f32, p| far.max(p[2]));
    let radius_m = |p: &[f32; 3]| RADIUS_M * (0.7 + 0.6 * f64::from((p[2] / far).max(0.0)));
    points.iter().map(radius_m).collect()
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads start")
}

fn labels(c: &mut Criterion) {
    let mut group = c.benchmark_group("dbscan");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(3));
    let (one_thread, all_threads) = (pool(1), pool(0));
    for count in SIZES {
        let points = surface(count);
        group.throughput(Throughput::Elements(count as u64));
        let same = DbscanParams::new(RADIUS_M, MIN_POINTS).expect("a radius");
        let each = DbscanParams::new(radii_m(&points), MIN_POINTS).expect("radii");
        for (radius, params) in [("one radius", &same), ("radius per point", &each)] {
            for (threads, pool) in [("1 thread", &one_thread), ("all threads", &all_threads)] {
                let id = BenchmarkId::new(format!("{radius}, {threads}"), count);
                group.bench_function(id, |b| {
                    b.iter(|| pool.install(|| dbscan(black_box(&points), params)));
                });
            }
        }
        if count <= BRUTE_UP_TO {
            group.bench_function(BenchmarkId::new("brute force", count), |b| {
                b.iter(|| dbscan_brute(black_box(&points), &same));
            });
        }
    }
}

fn queries(c: &mut Criterion) {
    let mut group = c.benchmark_group("neighbours of 1000 places");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(2));
    for count in SIZES {
        let points = surface(count);
        let search = Neighbors::new(&points).expect("finite points");
        let places: Vec<[f32; 3]> = (0..1000).map(|i| points[i * (count / 1000)]).collect();
        group.throughput(Throughput::Elements(1000));
        group.bench_function(BenchmarkId::new("tree", count), |b| {
            b.iter(|| {
                places
                    .iter()
                    .map(|&p| search.within(p, RADIUS_M).len())
                    .sum::<usize>()
            });
        });
        if count <= BRUTE_UP_TO {
            group.bench_function(BenchmarkId::new("brute force", count), |b| {
                b.iter(|| {
                    let near = |&p: &[f32; 3]| within_brute(&points, p, RADIUS_M).len();
                    places.iter().map(near).sum::<usize>()
                });
            });
        }
    }
}

criterion_group!(benches, labels, queries);
criterion_main!(benches);
