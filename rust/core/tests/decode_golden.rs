//! Do real bytes decode to the points that an independent program makes of them? The samples and
//! their origin are described in tests/data/packets/README.md.

use std::fs;
use std::path::PathBuf;

use lidar_deflect_core::capture::DatagramReader;
use lidar_deflect_core::cloud::ReturnKind;
use lidar_deflect_core::packet::velodyne::position::{Position, Pps};
use lidar_deflect_core::packet::{Decoded, PacketKind, Place, claimants};
use lidar_deflect_core::time::Timestamp;

/// Range and height agree to the last digit of the table; azimuth to 0.01 degree, to which the
/// other program rounds: 1.8e-4 of the range.
const TOLERANCE_M: f64 = 1e-3;
const TOLERANCE_OF_RANGE: f64 = 1.8e-4;
/// The table's times went through seconds since 1970 in f64.
const TOLERANCE_US: f64 = 0.5;

struct Row {
    packet: u32,
    ring: u16,
    kind: u8,
    intensity: u16,
    xyz_m: [f64; 3],
    past_hour_us: f64,
}

fn data(name: &str) -> PathBuf {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/packets");
    root.join(name)
}

fn table(name: &str) -> Vec<Row> {
    let text = fs::read_to_string(data(name)).unwrap();
    let row = |line: &str| {
        let fields: Vec<f64> = line
            .split(',')
            .map(|field| field.parse().unwrap())
            .collect();
        Row {
            packet: fields[0] as u32,
            ring: fields[1] as u16,
            kind: fields[2] as u8,
            intensity: fields[3] as u16,
            xyz_m: [fields[4], fields[5], fields[6]],
            past_hour_us: fields[7],
        }
    };
    text.lines().skip(1).map(row).collect()
}

/// Decodes all data packets; times count from the hour.
fn decode(name: &str) -> (Decoded, Vec<Vec<u8>>) {
    let bytes = fs::read(data(name)).unwrap();
    let mut reader = DatagramReader::new(&bytes[..]).unwrap();
    let mut decoded = Decoded::default();
    let mut others = Vec::new();
    let mut packet = 0;
    while let Some(datagram) = reader.next().unwrap() {
        let Some(model) = claimants(datagram.payload).next() else {
            others.push(datagram.payload.to_vec());
            continue;
        };
        let head = model.head(datagram.payload).unwrap();
        let place = Place {
            time: Timestamp(head.device_ns),
            packet,
            mean_rate_rad_per_ns: 0.0,
        };
        let mut decoder = model.fit(&[]).unwrap().decoder;
        decoder.decode(datagram.payload, place, &mut decoded);
        packet += 1;
    }
    (decoded, others)
}

fn assert_agrees(decoded: &Decoded, rows: &[Row]) {
    assert_eq!(decoded.cloud.len(), rows.len());
    for (echo, row) in decoded.cloud.iter().zip(rows) {
        let kind = match echo.return_kind {
            ReturnKind::Strongest => 1,
            ReturnKind::Last => 2,
            ReturnKind::Merged => 3,
            other => panic!("{other:?}"),
        };
        let found = (echo.packet, echo.ring, kind, echo.intensity);
        assert_eq!(found, (row.packet, row.ring, row.kind, row.intensity));
        let squares = echo
            .xyz_m
            .iter()
            .zip(row.xyz_m)
            .map(|(a, b)| (f64::from(*a) - b).powi(2));
        let off_m = squares.sum::<f64>().sqrt();
        let allowed_m = TOLERANCE_M + TOLERANCE_OF_RANGE * f64::from(echo.range_m);
        assert!(off_m < allowed_m, "{off_m} m: {echo:?}");
        // Height and distance from the axis do not depend on the azimuth.
        assert!((f64::from(echo.xyz_m[2]) - row.xyz_m[2]).abs() < 2e-6);
        let level = |x: f64, y: f64| x.hypot(y);
        let found_m = level(echo.xyz_m[0].into(), echo.xyz_m[1].into());
        assert!((found_m - level(row.xyz_m[0], row.xyz_m[1])).abs() < 5e-6);
        let off_us = echo.time.0 as f64 / 1e3 - row.past_hour_us;
        assert!(off_us.abs() < TOLERANCE_US, "{off_us} us: {echo:?}");
    }
}

#[test]
fn single_returns_over_the_seam() {
    let (decoded, others) = decode("velodyne_vlp16_single.pcap");
    assert_agrees(&decoded, &table("velodyne_vlp16_single.csv"));
    assert_eq!(decoded.merged, 0);
    let [other] = &others[..] else {
        panic!("{} other packets", others.len())
    };
    let position = Position::new(other).unwrap();
    assert_eq!(position.pps(), Pps::Locked);
    assert!(position.has_fix() && position.sentence().unwrap().starts_with("$GPRMC,"));
}

#[test]
fn dual_returns_merge_as_the_other_program_merges() {
    let (decoded, _) = decode("velodyne_vlp16_dual.pcap");
    let rows = table("velodyne_vlp16_dual.csv");
    assert_agrees(&decoded, &rows);
    let merged = rows.iter().filter(|row| row.kind == 3).count() as u64;
    assert_eq!(decoded.merged, merged);
}

#[test]
fn the_counts_of_a_scan_are_those_of_decoding() {
    for name in ["velodyne_vlp16_single.pcap", "velodyne_vlp16_dual.pcap"] {
        let bytes = fs::read(data(name)).unwrap();
        let mut reader = DatagramReader::new(&bytes[..]).unwrap();
        let mut tally = (0, 0);
        while let Some(datagram) = reader.next().unwrap() {
            if let Some(model) = claimants(datagram.payload).next() {
                assert_eq!(model.recognise(datagram.payload), Some(PacketKind::Data));
                let own = model.tally(datagram.payload);
                tally = (
                    tally.0 + own.points as usize,
                    tally.1 + u64::from(own.merged),
                );
            }
        }
        let (decoded, _) = decode(name);
        assert_eq!(tally, (decoded.cloud.len(), decoded.merged));
    }
}
