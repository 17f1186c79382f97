//! How fast do packets become points and sweeps, and what does the care for each shot cost against
//! the plainest decoder?
//!
//! One second of a VLP-16 at 600 rpm: 753 packets, 289 000 points. Throughput in points.

#[path = "../rust/core/tests/support/puck.rs"]
mod puck;
#[path = "../rust/core/tests/support/still.rs"]
mod still;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lidar_deflect_core::packet::velodyne::puck::{FIRING_NS, LASER_NS, VLP16};
use lidar_deflect_core::packet::velodyne::{BLOCKS, Packet};
use lidar_deflect_core::packet::{Decoded, Place, ReturnMode, model};
use lidar_deflect_core::stream::{Scan, ScanOptions, SweepOptions, SweepReader};
use lidar_deflect_core::time::Timestamp;
use puck::{Puck, Sent, datagram, scan};

/// The plainest decoder: block azimuth and a constant rate, sine and cosine of every single shot.
fn plain(payload: &[u8], cos_sin: &[(f64, f64); 16], out: &mut Vec<[f32; 3]>) {
    let Some(packet) = Packet::new(payload) else {
        return;
    };
    let rate = 1e-7 * 36.0_f64.to_radians(); // 10 turns a second, radians per nanosecond
    for block in 0..BLOCKS {
        let azimuth_rad = (f64::from(packet.azimuth_centideg(block)) / 100.0).to_radians();
        for (channel, echo) in (0_i64..).zip(packet.returns(block)) {
            if echo.range == 0 {
                continue;
            }
            let shot_ns = channel / 16 * FIRING_NS + channel % 16 * LASER_NS;
            let (sin, cos) = (azimuth_rad + rate * shot_ns as f64).sin_cos();
            let range_m = f64::from(echo.range) * 0.002;
            let (cos_up, sin_up) = cos_sin[channel as usize % 16];
            let level_m = range_m * cos_up;
            out.push([
                (level_m * cos) as f32,
                (-level_m * sin) as f32,
                (range_m * sin_up) as f32,
            ]);
        }
    }
}

fn seconds(mode: ReturnMode, seconds: f64) -> Vec<Sent> {
    let puck = Puck {
        mode,
        ..Puck::default()
    };
    puck.packets(seconds)
}

fn decode(c: &mut Criterion) {
    let mut group = c.benchmark_group("decode");
    let model = model("vlp16").unwrap();
    let beams = VLP16.beams();
    let cos_sin = std::array::from_fn(|laser| {
        let (sin, cos) = beams.channels()[laser].elevation_rad.sin_cos();
        (cos, sin)
    });
    for (name, mode) in [
        ("single", ReturnMode::Strongest),
        ("dual", ReturnMode::Dual),
    ] {
        let sent = seconds(mode, 1.0);
        let points: u64 = sent
            .iter()
            .map(|s| u64::from(model.tally(&s.payload).points))
            .sum();
        group.throughput(Throughput::Elements(points));
        let mut decoder = model.fit(&[]).unwrap().decoder;
        let mut out = Decoded::default();
        group.bench_function(format!("vlp16 {name}"), |b| {
            b.iter(|| {
                for packet in &sent {
                    out.clear();
                    let place = Place {
                        time: Timestamp(0),
                        packet: 0,
                        mean_rate_rad_per_ns: 0.0,
                    };
                    decoder.decode(black_box(&packet.payload), place, &mut out);
                }
                out.cloud.len()
            });
        });
    }
    let sent = seconds(ReturnMode::Strongest, 1.0);
    group.throughput(Throughput::Elements(sent.len() as u64 * 384));
    let mut out = Vec::new();
    group.bench_function("plain twin, positions only", |b| {
        b.iter(|| {
            for packet in &sent {
                out.clear();
                plain(black_box(&packet.payload), &cos_sin, &mut out);
            }
            out.len()
        });
    });
    group.finish();
}

/// Two hundred packets of sensors without a rotor, every shot with all its echoes.
fn still(c: &mut Criterion) {
    let mut group = c.benchmark_group("decode still");
    for writer in still::writers() {
        let settings = writer.settings.iter();
        let timed = [
            "mid-360 1",
            "mid-360 3",
            "avia 4",
            "m1",
            "mx dual",
            "e1",
            "em4",
        ];
        for setting in settings.filter(|setting| timed.contains(&setting.name)) {
            let seen = |shot: usize, echo: usize| still::Seen {
                range_m: (5 + shot + 20 * echo) as f64,
                yaw_rad: 0.01 * shot as f64,
                pitch_rad: 0.02,
                brightness: 7,
            };
            let sent: Vec<Vec<u8>> = (0..200)
                .map(|number| (setting.encode)(number, &seen))
                .collect();
            let points: u64 = sent
                .iter()
                .map(|payload| u64::from(writer.model.tally(payload).points))
                .sum();
            group.throughput(Throughput::Elements(points));
            let mut decoder = writer.model.fit(&writer.files).unwrap().decoder;
            let mut out = Decoded::default();
            group.bench_function(setting.name, |b| {
                b.iter(|| {
                    for payload in &sent {
                        out.clear();
                        let place = Place {
                            time: Timestamp(0),
                            packet: 0,
                            mean_rate_rad_per_ns: 0.0,
                        };
                        decoder.decode(black_box(payload), place, &mut out);
                    }
                    out.cloud.len()
                });
            });
        }
    }
    group.finish();
}

fn stream(c: &mut Criterion) {
    let mut group = c.benchmark_group("stream");
    let sent = seconds(ReturnMode::Strongest, 10.0);
    group.throughput(Throughput::Elements(sent.len() as u64 * 384));
    group.bench_function("scan", |b| {
        b.iter(|| {
            let mut scan = Scan::new(ScanOptions::default());
            sent.iter().for_each(|packet| scan.push(&datagram(packet)));
            scan.finish().datagrams
        });
    });
    let report = scan(&sent, ScanOptions::default());
    group.bench_function("sweeps", |b| {
        b.iter(|| {
            let mut reader = SweepReader::new(&report, &SweepOptions::default()).unwrap();
            let mut points = 0;
            for packet in &sent {
                reader.push(&datagram(packet));
                while let Some(sweep) = reader.pop() {
                    points += sweep.cloud.len();
                    reader.recycle(sweep.lidar, sweep.cloud);
                }
            }
            points
        });
    });
    group.finish();
}

criterion_group!(benches, decode, still, stream);
criterion_main!(benches);
