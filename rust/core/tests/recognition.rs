//! Is each sensor found by what it sends, also where bytes, addresses or ports are not what they should be?

#[path = "support/puck.rs"]
mod puck;

use lidar_deflect_core::packet::model;
use lidar_deflect_core::stream::{ScanOptions, Source, SweepOptions};
use puck::{Puck, START_NS, in_order, scan, sweeps};

#[test]
fn old_firmware_is_told_by_its_packet_period() {
    let old = Puck {
        product: 0x21,
        ..Puck::default()
    };
    let report = scan(&old.packets(0.5), ScanOptions::default());
    assert_eq!(report.lidars[0].model.id(), "vlp16");
    // The same bytes at the pace of an HDL-32E are its own.
    let mut fast = old.packets(0.5);
    for (number, packet) in (0..).zip(&mut fast) {
        let stamp: u32 = 1_000_000 + number * 553;
        packet.payload[1200..1204].copy_from_slice(&stamp.to_le_bytes());
    }
    let report = scan(&fast, ScanOptions::default());
    assert_eq!(report.lidars[0].model.id(), "hdl32e");
    // At a pace of neither they are no lidar's.
    for (number, packet) in (0..).zip(&mut fast) {
        let stamp: u32 = 1_000_000 + number * 900;
        packet.payload[1200..1204].copy_from_slice(&stamp.to_le_bytes());
    }
    let report = scan(&fast, ScanOptions::default());
    assert!(report.lidars.is_empty());
    let near = report.others[0].closest.clone().unwrap();
    assert!(near.why.contains("900 us"), "{near:?}");
}

#[test]
fn a_named_model_overrides_its_factory_bytes() {
    let blank = Puck {
        product: 0,
        ..Puck::default()
    };
    let sent = blank.packets(0.5);
    let report = scan(&sent, ScanOptions::default());
    assert!(report.lidars.is_empty());
    let near = report.others[0].closest.clone().unwrap();
    assert!(
        near.why.contains("0x00") && near.may_be == Some("vlp16"),
        "{near:?}"
    );
    let options = ScanOptions {
        models: vec![(
            Source::parse("192.168.1.201").unwrap(),
            model("vlp16").unwrap(),
        )],
        units: Vec::new(),
        split: vec![],
    };
    let report = scan(&sent, options);
    assert_eq!(report.lidars[0].counts.packets, sent.len() as u64);
    let sweeps = sweeps(&sent, &report, &SweepOptions::default());
    let returns: usize = sweeps.iter().map(|sweep| sweep.cloud.len()).sum();
    assert_eq!(returns, sent.len() * 384);
}

#[test]
fn two_sensors_with_one_address_are_found() {
    let one = Puck::default();
    for offset_ns in [0, 400_000, 90_000_000, 5_000_000_000, 1_000_000_000_000] {
        let other = Puck {
            start_ns: START_NS + 333_000,
            offset_ns,
            turns_per_s: 10.02,
            ..Puck::default()
        };
        let both = in_order([one.packets(2.0), other.packets(2.0)].concat());
        let report = scan(&both, ScanOptions::default());
        let conflict = report.lidars[0].conflict.as_ref();
        let text = conflict.unwrap_or_else(|| panic!("{offset_ns}: {:?}", report.lidars[0].counts));
        assert!(text.contains("192.168.1.201"), "{text}");
        assert!(report.split().is_none());
    }
    assert!(
        scan(&one.packets(2.0), ScanOptions::default()).lidars[0]
            .conflict
            .is_none()
    );
}

#[test]
fn source_ports_split_sensors_behind_one_address() {
    let one = Puck::default();
    let other = Puck {
        source: "192.168.1.201:41000".parse().unwrap(),
        start_ns: START_NS + 333_000,
        offset_ns: 5_000_000_000,
        ..Puck::default()
    };
    let (first, second) = (one.packets(2.0), other.packets(2.0));
    let both = in_order([first.clone(), second.clone()].concat());
    let report = scan(&both, ScanOptions::default());
    let report = scan(&both, report.split().unwrap());
    let names: Vec<String> = report
        .lidars
        .iter()
        .map(|lidar| lidar.key.to_string())
        .collect();
    assert_eq!(
        names,
        ["192.168.1.201:2368@2368", "192.168.1.201:2368@41000"]
    );
    for (lidar, sent) in report.lidars.iter().zip([first, second]) {
        assert_eq!(
            (lidar.counts.packets, lidar.counts.lost),
            (sent.len() as u64, 0)
        );
        assert!(lidar.conflict.is_none());
    }
}
