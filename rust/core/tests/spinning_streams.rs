//! Is every Ouster, and every RoboSense with a rotor, told from its packets and what describes its unit, and is
//! counted what is missing?

#[path = "support/line.rs"]
mod line;
#[path = "support/spinning.rs"]
mod spinning;

use lidar_deflect_core::packet::Model;
use lidar_deflect_core::packet::ouster::profile::PROFILES;
use lidar_deflect_core::packet::robosense::helios;
use lidar_deflect_core::packet::unit::UnitFile;
use spinning::{Writer, ouster, ousters, robosense, scan, writers};

#[test]
fn numbered_packets_that_are_lost_repeated_or_late_are_counted_exactly() {
    let numbered = |writer: &&Writer| writer.model.sequence_wrap().is_some();
    let all = writers();
    for writer in all.iter().filter(numbered) {
        let mut order = Vec::new();
        // Losses, repetitions and late packets far enough apart that one does not touch another.
        for number in 0..1500_u32 {
            match number % 45 {
                _ if !(100..1400).contains(&number) => order.push(number),
                5 => {}
                14 => order.extend([number, number]),
                23 => {} // comes two later
                25 => order.extend([number, number - 2]),
                _ => order.push(number),
            }
        }
        let count = |rest: u32| (100..1400).filter(|number| number % 45 == rest).count() as u64;
        let report = scan(writer, &order);
        let (id, title) = (writer.model.id(), writer.model.title());
        assert_eq!(report.lidars.len(), 1, "{title}: {:?}", report.others);
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
        assert_eq!(
            found,
            (1500 - count(5), count(5), count(14), count(23), 0),
            "{title}"
        );
        assert!(info.calibration.is_ok(), "{title}");
    }
}

#[test]
fn every_model_is_named_from_its_packets_and_the_description_of_its_unit() {
    for writer in writers() {
        let report = scan(&writer, &(0..200).collect::<Vec<_>>());
        let [info] = &report.lidars[..] else {
            panic!("{}: {:?}", writer.model.id(), report.others)
        };
        assert_eq!(info.model.id(), writer.model.id());
        assert_eq!(
            (info.counts.packets, info.counts.lost),
            (200, 0),
            "{}",
            info.model.id()
        );
        assert!(
            (info.rpm - 600.0).abs() < 4.0 || !matches!(info.model.id(), "os1-32" | "helios32"),
            "{} {}",
            info.model.id(),
            info.rpm
        );
    }
}

#[test]
fn ouster_without_metadata_is_found_and_says_how_to_get_them() {
    use lidar_deflect_core::error::Coded;
    for mut writer in ousters() {
        writer.files.clear();
        let report = scan(&writer, &(0..200).collect::<Vec<_>>());
        let info = &report.lidars[0];
        assert_eq!((info.model.id(), info.return_mode), ("ouster", "unknown"));
        let error = info.calibration.clone().unwrap_err();
        assert_eq!(error.code(), "beams.missing");
        assert!(error.hint().unwrap().contains("--beams ADDRESS=FILE"));
    }
}

#[test]
fn metadata_of_another_sensor_are_taken_with_a_warning_and_two_of_them_not_at_all() {
    let mut writer = ouster(&PROFILES[1], (0, 1023));
    let text = String::from_utf8(writer.files[0].content.clone()).unwrap();
    let other = |serial: &str| {
        let text = text.replace("122239000672", serial).replace(": 77", ": 78");
        UnitFile::new(format!("{serial}.json"), text)
    };
    writer.files = vec![other("111111111111")];
    let info = scan(&writer, &(0..200).collect::<Vec<_>>())
        .lidars
        .remove(0);
    assert_eq!(info.model.id(), "os1-32");
    assert!(
        info.notes
            .iter()
            .any(|note| note.contains("another sensor")),
        "{:?}",
        info.notes
    );
    writer.files.push(other("222222222222"));
    let info = scan(&writer, &(0..200).collect::<Vec<_>>())
        .lidars
        .remove(0);
    assert_eq!(info.model.id(), "ouster");
    assert!(
        info.calibration
            .unwrap_err()
            .to_string()
            .contains("222222222222.json")
    );
}

#[test]
fn two_files_that_differ_in_ports_alone_describe_one_sensor() {
    let mut writer = ouster(&PROFILES[1], (0, 1023));
    let text = String::from_utf8(writer.files[0].content.clone()).unwrap();
    let other = text.replacen('{', "{\"udp_port_imu\": 7504, ", 1);
    writer.files.push(UnitFile::new("other.json", other));
    let report = scan(&writer, &(0..200).collect::<Vec<_>>());
    assert_eq!(report.lidars[0].model.id(), "os1-32");
    assert!(report.lidars[0].calibration.is_ok());
    report.check_units().unwrap();
}

#[test]
fn an_older_helios_is_told_by_what_its_halves_see() {
    for is_half in [true, false] {
        let echo = move |place: usize, channel: usize, _: usize| {
            let beam = if is_half { channel % 16 } else { channel };
            (
                (1_000 + 37 * place + 300 * beam + channel / 16 * 5) as u32,
                9,
            )
        };
        let header = [(17, 1), (30, 6)];
        let mut writer = robosense(&helios::HELIOS_32, &header, Vec::new(), 0.0025);
        if is_half {
            writer = robosense(&helios::HELIOS_16P, &header, Vec::new(), 0.0025);
        }
        let packets: Vec<Vec<u8>> = (0..40)
            .map(|number| (writer.encode)(number, 1, &echo))
            .collect();
        let payloads: Vec<&[u8]> = packets.iter().map(Vec::as_slice).collect();
        // Where the halves differ the header still names no model: both stay possible.
        assert!(helios::HELIOS_16P.suits(&payloads));
        assert_eq!(helios::HELIOS_32.suits(&payloads), !is_half);
        let doubt = helios::HELIOS_16P.doubt(&payloads);
        assert_eq!(doubt.is_none(), is_half);
        assert!(doubt.is_none_or(|text| text.contains("--sensor SOURCE=helios32")));
        assert!(!helios::HELIOS_32_26DEG.suits(&payloads));
    }
}
