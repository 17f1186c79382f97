//! A Ruby with 128 lasers sends three blocks a packet, so that the two returns of every second firing lie in two
//! packets: are they judged as a pair, and counted the same by scan and decoder?

#[path = "support/line.rs"]
mod line;

use std::collections::BTreeMap;

use lidar_deflect_core::cloud::ReturnKind;
use lidar_deflect_core::packet::echoes::RawEcho;
use lidar_deflect_core::packet::robosense::layout::RawPacket;
use lidar_deflect_core::packet::robosense::ruby::PLUS_128;
use lidar_deflect_core::stream::{PointReader, Scan, ScanOptions, ScanReport, SweepOptions};
use lidar_deflect_core::time::Timestamp;

const START_NS: i64 = 1_718_000_000_500_000_000;
const FIRING_NS: i64 = 55_560;
const PACKETS: usize = 400;

/// Ranges of the two returns of a laser, units of 5 mm: one in four each has no second return, the same one, a
/// farther and a nearer one.
fn ranges(laser: usize) -> [u16; 2] {
    let first = 1_000 + laser as u16;
    match laser % 4 {
        0 => [first, 0],
        1 => [first, first],
        2 => [first, first + 100],
        _ => [first, first - 100],
    }
}

/// The packet with a number and the moment at which it is complete.
fn packet(number: usize) -> (Timestamp, Vec<u8>) {
    let place = |k: usize| ((3 * number + k) / 2, (3 * number + k) % 2);
    let block = |k: usize| {
        let (firing, index) = place(k);
        let echo = |laser| RawEcho {
            range: ranges(laser)[index],
            intensity: 7,
        };
        let azimuth = (firing * 20 % 36_000) as u16;
        (azimuth, (0..128).map(echo).collect())
    };
    let firing_ns = |k| place(k).0 as i64 * FIRING_NS / 1000 * 1000;
    let payload = PLUS_128.encode(&RawPacket {
        time_ns: START_NS + firing_ns(0),
        counter: number as u32,
        header: vec![(7, 3), (31, 5)],
        blocks: (0..3).map(block).collect(),
    });
    (Timestamp(START_NS + firing_ns(2) + FIRING_NS), payload)
}

fn read(order: &[usize]) -> (ScanReport, PointReader) {
    let sent = || order.iter().map(|number| packet(*number));
    let mut scan = Scan::new(ScanOptions::default());
    line::deliver(6699, sent(), |datagram| scan.push(datagram));
    let report = scan.finish();
    let mut reader = PointReader::new(&report, &SweepOptions::default()).unwrap();
    line::deliver(6699, sent(), |datagram| reader.push(datagram));
    reader.finish();
    (report, reader)
}

/// Points and merged returns, which scan and decoder agree on.
fn totals(order: &[usize], lost: u64) -> (u64, u64) {
    let (report, reader) = read(order);
    let info = &report.lidars[0];
    assert_eq!((info.model.id(), info.counts.lost), ("ruby-plus-128", lost));
    assert_eq!(
        (info.points, info.merged),
        (reader.waiting() as u64, reader.merged())
    );
    (info.points, info.merged)
}

/// Range, kind, packet and block of a point.
type Seen = (f32, ReturnKind, u32, u16);

/// 32 lasers each with one, one merged, two and two points.
const OF_A_FIRING: u64 = 32 * (1 + 1 + 2 + 2);

#[test]
fn pairs_are_judged_across_packets() {
    let firings = PACKETS * 3 / 2;
    let all: Vec<usize> = (0..PACKETS).collect();
    assert_eq!(
        totals(&all, 0),
        (firings as u64 * OF_A_FIRING, firings as u64 * 32)
    );
    let (report, mut reader) = read(&all);
    assert!(
        (report.lidars[0].rpm - 600.0).abs() < 1.0,
        "{}",
        report.lidars[0].rpm
    );
    let points = reader.take().cloud;
    let mut shots: BTreeMap<(i64, u16), Vec<Seen>> = BTreeMap::new();
    for point in points.iter() {
        let shot = shots.entry((point.time.0, point.ring)).or_default();
        shot.push((point.range_m, point.return_kind, point.packet, point.block));
    }
    assert_eq!(shots.len(), firings * 128);
    let mut across = 0;
    for shot in shots.values() {
        if let [near, far] = shot[..] {
            let (near, far) = if near.0 < far.0 {
                (near, far)
            } else {
                (far, near)
            };
            assert_eq!((near.1, far.1), (ReturnKind::Strongest, ReturnKind::Last));
            across += usize::from(near.2 != far.2);
            // Each is said to lie where it does.
            for (_, _, packet, block) in [near, far] {
                assert!(block < 3 && (packet as usize) < PACKETS);
            }
        }
    }
    // Every packet with an even number shares its last firing with the next one: 64 lasers see two.
    assert_eq!(across, PACKETS / 2 * 64);
}

#[test]
fn a_lost_packet_leaves_halves_that_stand_alone() {
    let firings = (PACKETS * 3 / 2) as u64;
    // An even one has all of one firing and the first half of another, whose second half has 96 echoes.
    let order: Vec<usize> = (0..PACKETS).filter(|number| *number != 200).collect();
    assert_eq!(
        totals(&order, 1),
        ((firings - 2) * OF_A_FIRING + 96, (firings - 2) * 32)
    );
    // An odd one has the second half, so that the first half with 128 echoes stands alone.
    let order: Vec<usize> = (0..PACKETS).filter(|number| *number != 201).collect();
    assert_eq!(
        totals(&order, 1),
        ((firings - 2) * OF_A_FIRING + 128, (firings - 2) * 32)
    );
}

#[test]
fn packets_out_of_order_are_paired_all_the_same() {
    let firings = PACKETS as u64 * 3 / 2;
    let mut order: Vec<usize> = (0..PACKETS).collect();
    order.swap(150, 151);
    order.swap(250, 251);
    assert_eq!(totals(&order, 0), (firings * OF_A_FIRING, firings * 32));
}
