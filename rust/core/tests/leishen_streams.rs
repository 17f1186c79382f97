//! Is every Leishen model found in a stream, with its losses, its pace and its unit?

#[path = "support/leishen.rs"]
mod leishen;

use leishen::*;
use lidar_deflect_core::packet::leishen::cx::Cx;
use lidar_deflect_core::packet::leishen::mirror::{self, MIRRORS};
use lidar_deflect_core::packet::leishen::products::{self, PRODUCTS};
use lidar_deflect_core::packet::leishen::{ch, cx, difop};
use lidar_deflect_core::packet::unit::{Calibration, UnitFile};
use lidar_deflect_core::packet::{MODELS, Model, PacketKind, ReturnMode, closest};

/// Packets of a stream with their arrival, without those in a list.
fn stream(model: &Cx, count: i64, period_ns: i64, without: &[i64]) -> Vec<(i64, Vec<u8>)> {
    let kept = (0..count).filter(|number| !without.contains(number));
    let mode = ReturnMode::Strongest;
    kept.map(|number| {
        (
            START_NS + (number + 1) * period_ns + 40_000,
            cx_packet(model, mode, number, period_ns),
        )
    })
    .collect()
}

#[test]
fn every_product_is_found_with_its_losses_over_the_turn_of_the_second() {
    for model in &products::MODELS {
        let period_ns = model.period_ns(ReturnMode::Strongest);
        let report = scan(&stream(model, 600, period_ns, &[70, 71, 300]), &[]);
        let [info] = &report.lidars[..] else {
            panic!("{}", model.id())
        };
        assert_eq!(info.model.id(), model.id());
        let counts = info.counts;
        assert_eq!(
            (counts.packets, counts.lost, counts.late),
            (597, 3, 0),
            "{}",
            model.id()
        );
        assert!(
            info.conflict.is_none() && info.notes.is_empty(),
            "{:?}",
            info.notes
        );
    }
}

#[test]
fn another_pace_is_seen_and_is_no_loss() {
    let model = &products::MODELS[0];
    let report = scan(&stream(model, 400, 2_000_000, &[100, 200]), &[]);
    let info = &report.lidars[0];
    assert_eq!((info.model.id(), info.counts.lost), ("c16", 2));
    // 12 blocks of 0.36 degree in 2 ms are 360 turns a minute.
    assert!((info.rpm - 360.0).abs() < 1.0, "{}", info.rpm);
    assert!(
        info.notes.iter().any(|note| note.contains("5.2")),
        "{:?}",
        info.notes
    );
}

#[test]
fn a_clock_of_microseconds_is_told_by_its_numbers() {
    let model = products::MODELS[1].with_ntp();
    let period_ns = model.period_ns(ReturnMode::Strongest);
    let report = scan(&stream(&model, 600, period_ns, &[]), &[]);
    let info = &report.lidars[0];
    assert_eq!(
        (info.model.id(), info.counts.packets, info.counts.lost),
        ("c32", 600, 0)
    );
    assert!(
        info.notes.iter().any(|note| note.contains("NTP")),
        "{:?}",
        info.notes
    );
    let seconds = info.last.seconds_since(info.first);
    assert!((seconds - 600.0 * period_ns as f64 / 1e9).abs() < 1e-4);
}

#[test]
fn a_unit_of_version_3_is_no_velodyne_and_tells_its_angles() {
    let model = &products::MODELS[2];
    let period_ns = model.period_ns(ReturnMode::Strongest);
    let sent = stream(model, 200, period_ns, &[]);
    for other in MODELS
        .iter()
        .filter(|other| other.title().starts_with("Velodyne"))
    {
        assert_ne!(
            other.recognise(&sent[0].1),
            Some(PacketKind::Data),
            "{}",
            other.id()
        );
    }
    let nominal = &scan(&sent, &[]).lidars[0];
    let text = nominal.calibration.as_ref().unwrap().describe();
    assert!(
        text.contains("unit calibration missing") && text.contains("DIFOP"),
        "{text}"
    );
    let product = &PRODUCTS[2];
    let told: Vec<(usize, i16)> = product
        .elevation_deg
        .iter()
        .enumerate()
        .map(|(channel, angle)| (245 + 2 * channel, (angle * 100.0) as i16 + 25))
        .collect();
    let bytes = difop::encode(3, &told).to_vec();
    let info = &scan(&sent, &[(START_NS + 7, bytes.clone())]).lidars[0];
    assert_eq!(
        info.calibration.as_ref().unwrap().describe(),
        "packets to port 2369"
    );
    let own = decode(model, &info.unit, &sent[0].1);
    let first = &own.returns[0];
    let elevation_deg = (first.xyz_m[2] / first.range_m).asin().to_degrees();
    assert!((elevation_deg + 14.75).abs() < 1e-4, "{elevation_deg}");
    // Angles that are far off the table were never programmed.
    let blank = [UnitFile::new("d", difop::encode(3, &[]))];
    assert_eq!(
        model.fit(&blank).unwrap().calibration,
        Calibration::Nominal { obtain: cx::OBTAIN }
    );
}

#[test]
fn an_unknown_product_is_named_as_such() {
    let mut payload = cx_packet(&products::MODELS[0], ReturnMode::Strongest, 0, 1_200_000);
    payload[1211] = 0xEE;
    assert!(
        MODELS
            .iter()
            .all(|model| model.recognise(&payload).is_none())
    );
    let near = closest(&payload).unwrap();
    assert!(
        near.why.contains("0xee") && near.may_be == Some("c16"),
        "{near:?}"
    );
}

#[test]
fn mirrors_are_told_by_length_and_lines_and_say_so() {
    for (model, mirror) in mirror::MODELS.iter().zip(&MIRRORS) {
        let sent: Vec<(i64, Vec<u8>)> = (0..300)
            .filter(|number| *number != 120)
            .map(|number| {
                (
                    START_NS + (number as i64 + 1) * 225_000 + 9_000,
                    ch_packet(model, mirror.lines, false, number),
                )
            })
            .collect();
        let report = scan(&sent, &[]);
        let [info] = &report.lidars[..] else {
            panic!("{}: {:?}", mirror.id, report.others)
        };
        let found = info.model.id();
        assert!(
            found == mirror.id || mirror.id == "cx128s2" && found == "ch128s1",
            "{} {found}",
            mirror.id
        );
        assert_eq!(
            (info.counts.packets, info.counts.lost),
            (299, 1),
            "{}",
            mirror.id
        );
        assert!(
            info.notes.iter().any(|note| note.contains("--sensor")),
            "{:?}",
            info.notes
        );
    }
}

#[test]
fn the_two_mirrors_that_are_not_decoded_are_refused_by_name() {
    let packet = |lines: usize, step: usize| ch::RawPacket {
        time_ns: START_NS,
        is_double: false,
        is_ptp: false,
        records: (0..171_usize)
            .map(|number| {
                Some(ch::Record {
                    line: (number % lines) as u8,
                    azimuth: (number * step) as u16,
                    echoes: [(256_000, 9), (0, 0)],
                })
            })
            .collect(),
    };
    let wide = mirror::MODELS[1].encode(&packet(64, 105));
    let one_line = mirror::MODELS[6].encode(&packet(1, 60));
    for (payload, name) in [(wide, "CH64W"), (one_line, "CX1S3")] {
        let claims = MODELS.iter().filter_map(|model| model.recognise(&payload));
        assert_eq!(claims.count(), 0, "{name}");
        let near = closest(&payload).unwrap();
        assert!(near.why.contains(name) && near.may_be.is_none(), "{near:?}");
    }
}
