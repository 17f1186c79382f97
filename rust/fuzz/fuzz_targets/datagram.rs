//! A stream of datagrams: two bytes of length and two of time before each.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lidar_deflect_core::capture::Datagram;
use lidar_deflect_core::stream::{Scan, ScanOptions};
use lidar_deflect_core::time::Timestamp;

fuzz_target!(|bytes: &[u8]| {
    let mut scan = Scan::new(ScanOptions::default());
    let (mut rest, mut time_ns) = (bytes, 1_700_000_000_000_000_000_i64);
    while let [low, high, step, scale, tail @ ..] = rest {
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(tail.len());
        let (payload, behind) = tail.split_at(length);
        rest = behind;
        time_ns += i64::from(*step as i8) << (scale % 40);
        scan.push(&Datagram {
            time: Timestamp(time_ns),
            source: ([192, 168, 1, 201], 2368).into(),
            destination: ([192, 168, 1, 100], 2368).into(),
            payload,
            record: 0,
            offset: 0,
        });
    }
    let report = scan.finish();
    let dropped: u64 = report.drops.iter().map(|(_, count)| count).sum();
    let taken: u64 = report.lidars.iter().map(|lidar| lidar.counts.packets).sum();
    assert_eq!(dropped + taken, report.datagrams);
});
