//! Are the frames of every sensor without a rotor (Livox; RoboSense M series, E1, EMX, EM4) those of the sensor,
//! is the model told, and is counted what is missing?

#[path = "support/line.rs"]
mod line;
#[path = "support/still.rs"]
mod still;

use std::collections::BTreeSet;

use lidar_deflect_core::capture::Datagram;
use lidar_deflect_core::packet::model;
use lidar_deflect_core::packet::robosense::solid::joined;
use lidar_deflect_core::stream::{
    Given, Scan, ScanOptions, ScanReport, Source, SweepOptions, SweepReader,
};
use lidar_deflect_core::sweep::Sweep;
use lidar_deflect_core::time::Timestamp;
use still::{FRAME_LEN, START_NS, Setting, Writer, steady, writers};

fn options(writer: &Writer) -> ScanOptions {
    let units = writer.files.iter().map(|file| Given {
        source: None,
        file: file.clone(),
        is_named: false,
    });
    let named = (Source::parse("192.168.1.201").unwrap(), writer.model);
    ScanOptions {
        units: units.collect(),
        models: Vec::from_iter((!writer.is_told).then_some(named)),
        ..ScanOptions::default()
    }
}

/// Sends packets as `order` says; each arrives when it is complete. `datagrams` takes them.
fn send(setting: &Setting, order: &[u32], datagrams: impl FnMut(&Datagram<'_>)) {
    let sent = order.iter().map(|number| {
        let complete = Timestamp(START_NS) + (i64::from(*number) + 1) * setting.period_ns;
        (complete, (setting.encode)(*number, &steady))
    });
    line::deliver(57431, sent, datagrams);
}

fn scan(writer: &Writer, setting: &Setting, order: &[u32]) -> ScanReport {
    let mut scan = Scan::new(options(writer));
    send(setting, order, |datagram| scan.push(datagram));
    scan.finish()
}

fn sweeps(report: &ScanReport, setting: &Setting, order: &[u32]) -> Vec<Sweep> {
    let mut reader = SweepReader::new(report, &SweepOptions::default()).unwrap();
    send(setting, order, |datagram| reader.push(datagram));
    reader.finish();
    std::iter::from_fn(|| reader.pop()).collect()
}

#[test]
fn every_model_is_named_from_its_packets_alone_and_has_no_rotor() {
    for writer in writers() {
        for setting in &writer.settings {
            let report = scan(&writer, setting, &(0..400).collect::<Vec<_>>());
            let [info] = &report.lidars[..] else {
                panic!("{}: {:?}", setting.name, report.others)
            };
            assert_eq!(info.model.id(), writer.model.id(), "{}", setting.name);
            let counts = (info.counts.packets, info.counts.lost);
            assert_eq!(counts, (400, 0), "{}", setting.name);
            assert_eq!(info.clock.segments().len(), 1, "{}", setting.name);
            assert!(
                info.conflict.is_none(),
                "{}: {:?}",
                setting.name,
                info.conflict
            );
            assert!(report.health().all(|health| health.rpm.is_none()));
            assert_eq!(info.view.blind_rad(), 0.0, "{}", setting.name);
        }
    }
}

#[test]
fn what_the_packets_cannot_tell_are_candidates() {
    let of = |id: &str| model(id).unwrap().candidates();
    assert_eq!(of("avia"), ["horizon", "tele15"]);
    assert_eq!(of("m1"), ["m1-plus"]);
}

#[test]
fn packets_that_are_lost_repeated_or_late_are_counted_exactly() {
    for writer in writers() {
        for setting in &writer.settings {
            let mut order = Vec::new();
            let outage = 2000..2300;
            for number in 0..6000_u32 {
                match number % 45 {
                    _ if !(100..5900).contains(&number) => order.push(number),
                    // A long outage, over ends of frames.
                    _ if outage.contains(&number) => {}
                    5 => {}
                    14 => order.extend([number, number]),
                    23 => {} // comes two later
                    25 => order.extend([number, number - 2]),
                    _ => order.push(number),
                }
            }
            let report = scan(&writer, setting, &order);
            let [info] = &report.lidars[..] else {
                panic!("{}: {:?}", setting.name, report.others)
            };
            let sent: BTreeSet<u32> = order.iter().copied().collect();
            let sending = (100..5900).filter(|number| !outage.contains(number));
            let repeated = sending.clone().filter(|number| number % 45 == 14).count() as u64;
            let late = sending.filter(|number| number % 45 == 23).count() as u64;
            let counts = info.counts;
            let found = (counts.packets, counts.lost, counts.duplicated, counts.late);
            let packets = sent.len() as u64;
            assert_eq!(
                found,
                (packets, 6000 - packets, repeated, late),
                "{}",
                setting.name
            );
            assert_eq!(counts.too_late, 0, "{}", setting.name);
        }
    }
}

#[test]
fn frames_are_those_of_the_sensor_or_a_tenth_of_a_second() {
    for writer in writers() {
        for setting in &writer.settings {
            let frame = setting.frame;
            let order: Vec<u32> = (0..frame * 5 / 2).collect();
            let report = scan(&writer, setting, &order);
            let sweeps = sweeps(&report, setting, &order);
            assert_eq!(sweeps.len(), 3, "{}", setting.name);
            let per_packet = (setting.shots * setting.echoes) as u32;
            for sweep in &sweeps[..2] {
                let points = f64::from(frame * per_packet);
                let off = (sweep.cloud.len() as f64 - points).abs();
                // Frames in time end within a packet, those of the sensor between two.
                let most = if setting.is_timed {
                    f64::from(per_packet)
                } else {
                    0.0
                };
                assert!(
                    off <= most,
                    "{}: {} of {points}",
                    setting.name,
                    sweep.cloud.len()
                );
                assert!(
                    (f64::from(sweep.coverage) - 1.0).abs() < 0.01,
                    "{}",
                    setting.name
                );
            }
            let all: usize = sweeps.iter().map(|sweep| sweep.cloud.len()).sum();
            assert_eq!(all, order.len() * per_packet as usize, "{}", setting.name);
        }
    }
}

#[test]
fn stray_packets_and_companions_are_counted() {
    let writer = writers()
        .into_iter()
        .find(|w| w.model.id() == "mid360")
        .unwrap();
    let setting = &writer.settings[0];
    let mut inertial = [0_u8; 60];
    inertial[1] = 60;
    let mut scan = Scan::new(options(&writer));
    send(setting, &(0..300).collect::<Vec<_>>(), |datagram| {
        scan.push(datagram);
        for extra in [&inertial[..], &[1, 2, 3]] {
            scan.push(&Datagram {
                payload: extra,
                ..*datagram
            });
        }
    });
    let report = scan.finish();
    assert_eq!(
        (report.lidars[0].counts.packets, report.lidars[0].foreign),
        (300, 300)
    );
    assert_eq!(
        (
            report.drops.count("companion"),
            report.drops.count("foreign")
        ),
        (300, 300)
    );
}

#[test]
fn tags_and_clocks_are_told_in_notes() {
    let writer = writers()
        .into_iter()
        .find(|w| w.model.id() == "mid360")
        .unwrap();
    let report = scan(&writer, &writer.settings[0], &(0..100).collect::<Vec<_>>());
    let notes = report.lidars[0].notes.join("; ");
    assert!(notes.contains("the clock follows PTP"), "{notes}");
    assert!(notes.contains("do not tell"), "{notes}");
    assert!(notes.contains("200 of 9600 points carry a tag"), "{notes}");
}

#[test]
fn an_em4_without_its_description_is_refused_and_says_how_to_get_one() {
    use lidar_deflect_core::error::Coded;
    let mut writer = writers()
        .into_iter()
        .find(|w| w.model.id() == "em4")
        .unwrap();
    writer.files.clear();
    let report = scan(&writer, &writer.settings[0], &(0..100).collect::<Vec<_>>());
    let error = report.lidars[0].calibration.clone().unwrap_err();
    assert_eq!(error.code(), "beams.missing");
    assert!(error.hint().unwrap().contains("7766"));
}

#[test]
fn frames_have_the_number_that_the_packet_tells_where_it_counts() {
    for writer in writers() {
        for setting in &writer.settings {
            let number = 7 * FRAME_LEN + 2;
            let payload = (setting.encode)(number, &steady);
            let wanted = (writer.model.id() == "hap").then_some(7);
            assert_eq!(writer.model.frame_id(&payload), wanted, "{}", setting.name);
            assert_eq!(writer.model.frame_id(&payload[..20]), None);
        }
    }
}

#[test]
fn packets_that_are_joined_into_large_datagrams_are_read_one_by_one() {
    let writers = writers();
    let writer = writers.iter().find(|w| w.model.id() == "m1-jumbo").unwrap();
    let setting = &writer.settings[0];
    let joined = |number: u32| {
        let pieces: Vec<Vec<u8>> = (0..63)
            .map(|place| (setting.encode)(63 * number + place, &steady))
            .collect();
        let complete_ns = START_NS + i64::from(63 * (number + 1)) * setting.period_ns;
        (Timestamp(complete_ns), joined::join(&pieces))
    };
    // Of 40 datagrams two are lost.
    let sent = || {
        (0..40)
            .filter(|number| ![10, 17].contains(number))
            .map(joined)
    };
    let mut scan = Scan::new(ScanOptions::default());
    line::deliver(6699, sent(), |datagram| scan.push(datagram));
    let report = scan.finish();
    let info = &report.lidars[0];
    assert_eq!(info.model.id(), "m1-jumbo");
    assert_eq!((info.counts.packets, info.counts.lost), (38 * 63, 2 * 63));
    assert_eq!(report.datagrams, 38 * 63);
    let mut reader = SweepReader::new(&report, &SweepOptions::default()).unwrap();
    line::deliver(6699, sent(), |datagram| reader.push(datagram));
    reader.finish();
    let points: usize = std::iter::from_fn(|| reader.pop())
        .map(|sweep| sweep.cloud.len())
        .sum();
    assert_eq!(points, 38 * 63 * 125);
}
