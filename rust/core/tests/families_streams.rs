//! Is every Velodyne and Hesai model named from its packets alone, and are loss, order and clocks
//! exact where packets are numbered?

#[path = "support/families.rs"]
mod families;
#[path = "support/line.rs"]
mod line;

use std::net::SocketAddr;

use families::{Writer, packet, writers};
use lidar_deflect_core::capture::Datagram;
use lidar_deflect_core::packet::ReturnMode;
use lidar_deflect_core::packet::echoes::RawEcho;
use lidar_deflect_core::stream::{Scan, ScanOptions, ScanReport};
use lidar_deflect_core::time::Timestamp;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Sends packets as `order` says; each arrives when it is complete.
fn scan(writer: &Writer, mode: ReturnMode, order: &[u32]) -> ScanReport {
    let period_ns = writer.model.period_ns(mode);
    let mut scan = Scan::new(ScanOptions::default());
    let echo = |_, _| RawEcho {
        range: 2_500,
        intensity: 9,
    };
    let sent = order.iter().map(|number| {
        let sent = packet(writer, mode, *number, echo);
        (sent.time + period_ns, (writer.encode)(&sent))
    });
    line::deliver(2368, sent, |datagram| scan.push(datagram));
    scan.finish()
}

#[test]
fn numbered_packets_that_are_lost_repeated_or_late_are_counted_exactly() {
    let numbered = |writer: &Writer| writer.model.counting().sequence_bits.is_some();
    for writer in writers().iter().filter(|writer| numbered(writer)) {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut numbers: Vec<u32> = (1..1500).collect();
        numbers[1..].shuffle(&mut random);
        // Far enough apart that one does not touch another, none at an end.
        let mut chosen: Vec<u32> = numbers
            .into_iter()
            .filter(|n| n % 9 == 4 && *n > 60 && *n < 1450)
            .collect();
        let lost: Vec<u32> = chosen.split_off(chosen.len() - 40);
        let repeated: Vec<u32> = chosen.split_off(chosen.len() - 30);
        let late: Vec<u32> = chosen.split_off(chosen.len() - 20);
        let mut order = Vec::new();
        for number in (1..1500).filter(|n| !lost.contains(n) && !late.contains(n)) {
            order.push(number);
            order.extend(repeated.contains(&number).then_some(number));
            order.extend(number.checked_sub(2).filter(|before| late.contains(before)));
        }
        let report = scan(writer, writer.modes[0], &order);
        let id = writer.model.id();
        assert_eq!(report.lidars.len(), 1, "{id}: {:?}", report.others);
        let info = &report.lidars[0];
        assert_eq!(info.model.id(), id);
        let counts = info.counts;
        let found = (
            counts.packets,
            counts.lost,
            counts.duplicated,
            counts.late,
            counts.too_late,
        );
        assert_eq!(found, (1499 - 40, 40, 30, 20, 0), "{id}");
        assert_eq!(info.clock.segments().len(), 1, "{id}");
    }
}

#[test]
fn every_model_is_named_from_its_packets_alone() {
    for writer in writers() {
        for mode in writer.modes {
            let order: Vec<u32> = (0..200).collect();
            let report = scan(&writer, *mode, &order);
            let [info] = &report.lidars[..] else {
                panic!("{}: {:?}", writer.model.id(), report.others)
            };
            assert_eq!(info.model.id(), writer.model.id());
            assert_eq!(info.return_mode, mode.name());
            assert_eq!(
                (info.counts.packets, info.counts.lost),
                (200, 0),
                "{}",
                info.model.id()
            );
        }
    }
}

#[test]
fn an_hdl64e_without_a_calibration_is_refused_and_says_how_to_get_one() {
    let writer = writers()
        .into_iter()
        .find(|w| w.model.id() == "hdl64e")
        .unwrap();
    let report = scan(
        &writer,
        ReturnMode::Strongest,
        &(0..200).collect::<Vec<_>>(),
    );
    let error = report.lidars[0].calibration.clone().unwrap_err();
    assert!(
        error.to_string().contains("calibration of the unit"),
        "{error}"
    );
}

#[test]
fn too_few_packets_leave_two_models_open() {
    let writer = writers()
        .into_iter()
        .find(|w| w.model.id() == "hdl32e")
        .unwrap();
    let report = scan(&writer, ReturnMode::Strongest, &[1, 2]);
    let info = &report.lidars[0];
    let mut named = vec![info.model.id()];
    named.extend(&info.candidates);
    assert!(
        named.contains(&"hdl32e") && named.contains(&"vlp16"),
        "{named:?}"
    );
    assert!(
        info.notes
            .iter()
            .any(|note| note.contains("too few packets"))
    );
}

/// Sends numbered packets whose clock, at `from`, runs over the end of an hour, day and year.
#[test]
fn clocks_run_over_the_second_the_hour_and_the_year() {
    // 2024-12-31 23:59:59.95 UTC.
    const SILVESTER: Timestamp = Timestamp(1_735_689_599_950_000_000);
    let source: SocketAddr = "192.168.1.201:10000".parse().unwrap();
    let destination: SocketAddr = "192.168.1.100:2368".parse().unwrap();
    for writer in writers() {
        let id = writer.model.id();
        let mode = writer.modes[0];
        let period_ns = writer.model.period_ns(mode);
        let echo = |_, _| RawEcho {
            range: 2_500,
            intensity: 9,
        };
        let mut scan = Scan::new(ScanOptions::default());
        let packets = 100_000_000 / period_ns;
        for number in 0..packets {
            let mut sent = packet(&writer, mode, number as u32, echo);
            sent.time = Timestamp((SILVESTER + number * period_ns).0 / 1000 * 1000);
            let payload = (writer.encode)(&sent);
            scan.push(&Datagram {
                time: sent.time + period_ns + 80_000,
                source,
                destination,
                payload: &payload,
                record: number as u64,
                offset: 0,
            });
        }
        let report = scan.finish();
        let info = &report.lidars[0];
        assert_eq!(
            (info.counts.packets, info.counts.lost),
            (packets as u64, 0),
            "{id}"
        );
        assert_eq!(info.clock.segments().len(), 1, "{id}");
        let off_ns = (info.first - SILVESTER)
            .abs()
            .max((info.last - SILVESTER - packets * period_ns).abs());
        assert!(off_ns < 2_300_000, "{id}: {off_ns} ns off UTC");
    }
}

#[test]
fn a_clock_that_is_set_while_numbers_go_on_begins_a_new_segment() {
    let writer = writers()
        .into_iter()
        .find(|w| w.model.id() == "xt32")
        .unwrap();
    let mode = ReturnMode::Dual;
    let source: SocketAddr = "192.168.1.201:10000".parse().unwrap();
    let destination: SocketAddr = "192.168.1.100:2368".parse().unwrap();
    let echo = |_, _| RawEcho {
        range: 2_500,
        intensity: 9,
    };
    let mut scan = Scan::new(ScanOptions::default());
    for number in 0..2000_u32 {
        let mut sent = packet(&writer, mode, number, echo);
        let arrival = sent.time + 300_000;
        if number < 1000 {
            sent.time = sent.time + -200_000_000_000_000; // not yet set by its master
        }
        let payload = (writer.encode)(&sent);
        scan.push(&Datagram {
            time: arrival,
            source,
            destination,
            payload: &payload,
            record: number.into(),
            offset: 0,
        });
    }
    let report = scan.finish();
    let info = &report.lidars[0];
    assert_eq!((info.counts.packets, info.counts.lost), (2000, 0));
    let kinds: Vec<&str> = info
        .clock
        .segments()
        .iter()
        .map(|segment| segment.kind.name())
        .collect();
    assert_eq!(kinds, ["free_running", "utc"]);
}
