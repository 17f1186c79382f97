//! Are turns that are decoded side by side those of one thread?

#[path = "support/puck.rs"]
mod puck;

use lidar_deflect_core::capture::DatagramBatch;
use lidar_deflect_core::cloud::PointCloud;
use lidar_deflect_core::frame::Sensor;
use lidar_deflect_core::packet::ReturnMode;
use lidar_deflect_core::stream::{Abreast, Reading, ScanOptions, ScanReport, SweepOptions};
use lidar_deflect_core::sweep::Sweep;
use lidar_deflect_core::time::Timestamp;
use puck::{Puck, Sent, datagram, in_order, scan, sweeps};
use rayon::ThreadPoolBuilder;

/// All columns and counts to the last digit.
fn written(sweeps: &[Sweep]) -> Vec<String> {
    sweeps.iter().map(|sweep| format!("{sweep:?}")).collect()
}

/// Sweeps by so many threads, and the returns that were merged.
fn abreast(
    sent: &[Sent],
    report: &ScanReport,
    options: &SweepOptions,
    threads: usize,
) -> (Vec<String>, u64) {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap().install(|| {
        let mut reader = Abreast::<PointCloud<Sensor>>::new(report, options)
            .unwrap()
            .unwrap();
        let mut found = Vec::new();
        for some in sent.chunks(100) {
            let mut batch = DatagramBatch::default();
            some.iter().for_each(|packet| batch.push(&datagram(packet)));
            reader.push(&batch);
            while let Some(sweep) = reader.pop() {
                found.extend(written(std::slice::from_ref(&sweep)));
                reader.recycle(sweep.lidar, sweep.cloud);
            }
        }
        reader.finish();
        while let Some(sweep) = reader.pop() {
            found.extend(written(&[sweep]));
        }
        (found, reader.merged())
    })
}

fn two_lidars() -> Vec<Sent> {
    let dual = Puck {
        source: "192.168.1.202:2368".parse().unwrap(),
        mode: ReturnMode::Dual,
        ..Puck::default()
    };
    let mut sent = Puck::default().packets(2.0);
    sent.drain(300..330); // over a cut: some are lost
    sent.swap(500, 503); // and some come late
    sent.extend(dual.packets(1.5));
    in_order(sent)
}

#[test]
fn any_number_of_threads_gives_the_sweeps_of_one() {
    let sent = two_lidars();
    let report = scan(&sent, ScanOptions::default());
    assert_eq!(report.lidars.len(), 2);
    let middle = |after_ns: i64| Some(Timestamp(report.lidars[0].first.0 + after_ns));
    let wanted = [
        SweepOptions::default(),
        SweepOptions::of(&[0, 1], &[2.0, 0.5]).one_in(3),
        SweepOptions {
            start: middle(400_000_000),
            stop: middle(900_000_000),
            ..SweepOptions::of(&[1], &[1.0])
        },
    ];
    for options in wanted {
        let expected = written(&sweeps(&sent, &report, &options));
        assert!(expected.len() > 4, "{}", expected.len());
        for threads in [1, 2, 5] {
            let (found, _) = abreast(&sent, &report, &options, threads);
            assert_eq!(found, expected, "{threads} threads");
        }
    }
}

#[test]
fn a_packet_over_a_cut_is_counted_once() {
    let sent = two_lidars();
    let report = scan(&sent, ScanOptions::default());
    let (_, merged) = abreast(&sent, &report, &SweepOptions::default(), 2);
    let known: u64 = report.lidars.iter().map(|lidar| lidar.merged).sum();
    assert!(known > 0);
    assert_eq!(merged, known);
}
