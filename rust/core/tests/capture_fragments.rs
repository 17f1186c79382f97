//! Do fragmented datagrams come back whole, in any order and among others?

mod support;

use proptest::prelude::*;
use support::{frames, pcap, read};

const LIDARS: [(&str, &str); 3] = [
    ("169.254.92.158:7502", "169.254.1.1:7502"),
    ("169.254.238.111:7502", "169.254.1.1:7502"), // the same port and the same identification
    ("[fe80::1]:7502", "[fe80::2]:7502"),
];

fn payload(lidar: usize, len: usize) -> Vec<u8> {
    (0..len).map(|i| ((i * (7 + lidar)) % 251) as u8).collect()
}

/// Classic pcap with all records at one instant.
fn at_once(frames: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = pcap(1, frames);
    let mut at = 24;
    for frame in frames {
        bytes[at..at + 4].fill(0);
        at += 16 + frame.len();
    }
    bytes
}

fn shuffle<T>(items: &mut [T], mut seed: u64) {
    for i in (1..items.len()).rev() {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        items.swap(i, (seed >> 33) as usize % (i + 1));
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 200,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn fragments_of_several_sensors_in_any_order(
        lens in prop::array::uniform3(1481usize..25_000),
        seed in any::<u64>(),
        repeats in prop::collection::vec(any::<prop::sample::Index>(), 0..8),
    ) {
        let mut parts: Vec<Vec<u8>> = Vec::new();
        for (lidar, (source, destination)) in LIDARS.iter().enumerate() {
            parts.extend(frames(source, destination, &payload(lidar, lens[lidar])));
        }
        let distinct = parts.len() as u64;
        for repeat in &repeats {
            parts.push(parts[repeat.index(distinct as usize)].clone());
        }
        shuffle(&mut parts, seed);
        let outcome = read(&at_once(&parts)[..]);
        let mut found: Vec<Vec<u8>> = outcome.datagrams.into_iter().map(|(_, bytes)| bytes).collect();
        let mut expected: Vec<Vec<u8>> = (0..3).map(|lidar| payload(lidar, lens[lidar])).collect();
        found.sort();
        expected.sort();
        prop_assert!(found == expected);
        prop_assert_eq!(outcome.drops.count("fragment_duplicate"), repeats.len() as u64);
        prop_assert_eq!(outcome.drops.count("fragment_incomplete"), 0);
    }

    #[test]
    fn one_lost_fragment_loses_one_datagram(lost in any::<prop::sample::Index>(), seed in any::<u64>()) {
        let mut parts = frames(LIDARS[0].0, LIDARS[0].1, &payload(0, 12_608));
        parts.remove(lost.index(parts.len()));
        parts.extend(frames(LIDARS[1].0, LIDARS[1].1, &payload(1, 12_608)));
        shuffle(&mut parts, seed);
        let outcome = read(&at_once(&parts)[..]);
        prop_assert_eq!(outcome.datagrams.len(), 1);
        prop_assert_eq!(outcome.drops.iter().collect::<Vec<_>>(), [("fragment_incomplete", 1)]);
    }
}

#[test]
fn parts_more_than_two_seconds_apart_do_not_meet() {
    let parts = frames(LIDARS[0].0, LIDARS[0].1, &payload(0, 2000));
    let other = support::frame(b"x");
    // One record per second: two seconds between the parts are in time, three are not.
    let near = [parts[0].clone(), other.clone(), parts[1].clone()];
    assert_eq!(read(&pcap(1, &near)[..]).datagrams.len(), 2);
    let far = [parts[0].clone(), other.clone(), other, parts[1].clone()];
    let outcome = read(&pcap(1, &far)[..]);
    assert_eq!(outcome.datagrams.len(), 2);
    assert_eq!(outcome.drops.count("fragment_incomplete"), 2);
}

#[test]
fn the_same_datagram_in_two_vlans_is_two() {
    let parts = frames(LIDARS[0].0, LIDARS[0].1, &payload(0, 2000));
    let tagged = |part: &Vec<u8>, id: u8| [&part[..12], &[0x81, 0, 0, id], &part[12..]].concat();
    let mixed: Vec<Vec<u8>> = parts
        .iter()
        .flat_map(|part| [tagged(part, 1), tagged(part, 2)])
        .collect();
    let outcome = read(&at_once(&mixed)[..]);
    assert_eq!(outcome.datagrams.len(), 2);
    assert_eq!(outcome.drops.iter().count(), 0);
}

#[test]
fn fragments_of_other_protocols_do_not_enter_the_pool() {
    let mut parts = frames(LIDARS[0].0, LIDARS[0].1, &payload(0, 2000));
    for part in &mut parts {
        part[14 + 9] = 6;
    }
    let outcome = read(&at_once(&parts)[..]);
    assert_eq!(outcome.drops.iter().collect::<Vec<_>>(), [("not_udp", 2)]);
}
