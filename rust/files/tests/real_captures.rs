//! Do real captures hold the datagrams that others counted in them?

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lidar_deflect_core::capture::{DatagramBatch, DatagramReader, Format};
use lidar_deflect_core::cloud::PointCloud;
use lidar_deflect_core::frame::Sensor;
use lidar_deflect_core::stream::{Abreast, Reading, Scan, ScanOptions, SweepOptions, SweepReader};
use lidar_deflect_core::sweep::Sweep;
use lidar_deflect_files::CaptureSet;

/// Source address, destination port and payload length.
type Stream = (String, u16, usize);

/// What the manifest says about one capture.
#[derive(Debug, Default)]
struct Expected {
    file: String,
    records: u64,
    fragments: u64,
    streams: BTreeMap<Stream, u64>,
}

fn captures() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/captures");
    if folder.join("MANIFEST.json").is_file() {
        return Some(folder);
    }
    println!("skipped: the shared captures are not beside this project");
    None
}

/// The value behind `"key": ` in a line of indented JSON.
fn value<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    let rest = line.trim().strip_prefix(&format!("\"{key}\": "))?;
    Some(rest.trim_end_matches(',').trim_matches('"'))
}

fn manifest(folder: &Path) -> Vec<Expected> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.json")).unwrap();
    let mut all: Vec<Expected> = Vec::new();
    let mut stream = (String::new(), 0, 0);
    for line in text.lines() {
        if let Some(file) = value(line, "file").filter(|file| file.contains(".pcap")) {
            all.push(Expected {
                file: file.into(),
                ..Expected::default()
            });
        }
        let Some(expected) = all.last_mut() else {
            continue;
        };
        if let Some(records) = value(line, "records") {
            expected.records = records.parse().unwrap();
        } else if let Some(fragments) = value(line, "ip_fragment_records") {
            expected.fragments = fragments.parse().unwrap();
        } else if let Some(address) = value(line, "src_ip") {
            stream.0 = address.into();
        } else if let Some(port) = value(line, "dst_port") {
            stream.1 = port.parse().unwrap();
        } else if let Some(len) = value(line, "payload_bytes") {
            stream.2 = len.parse().unwrap();
        } else if let Some(count) = value(line, "datagrams") {
            *expected.streams.entry(stream.clone()).or_default() += count.parse::<u64>().unwrap();
        }
    }
    all
}

fn count_streams(set: &mut CaptureSet) -> BTreeMap<Stream, u64> {
    let mut streams = BTreeMap::new();
    while let Some(datagram) = set.next().unwrap() {
        let source = datagram.source.ip().to_string();
        let stream = (source, datagram.destination.port(), datagram.payload.len());
        *streams.entry(stream).or_default() += 1;
    }
    streams
}

#[test]
fn every_stream_has_the_datagrams_of_the_manifest() {
    let Some(folder) = captures() else { return };
    let all = manifest(&folder);
    assert!(all.len() >= 14, "the manifest names {} captures", all.len());
    for expected in all {
        let mut set = CaptureSet::open(&[folder.join(&expected.file)]).unwrap();
        let streams = count_streams(&mut set);
        assert_eq!(streams, expected.streams, "{}", expected.file);
        let facts = &set.facts()[0].facts;
        assert_eq!(facts.records, expected.records, "{}", expected.file);
        assert_eq!(
            set.fragments().fragments,
            expected.fragments,
            "{}",
            expected.file
        );
        assert_eq!(set.fragments().incomplete, 0, "{}", expected.file);
        assert_eq!(set.bytes_done(), set.bytes_total(), "{}", expected.file);
        let is_ng = expected.file.ends_with("pcapng");
        assert_eq!(facts.format == Some(Format::PcapNg), is_ng);
        println!(
            "{}: {} datagrams, drops {:?}",
            expected.file,
            streams.values().sum::<u64>(),
            set.drops()
        );
    }
}

/// All at once, as recordings of several sensors: nothing is lost in the merge and time goes on.
#[test]
fn all_captures_merge_by_time() {
    let Some(folder) = captures() else { return };
    let all = manifest(&folder);
    let paths: Vec<PathBuf> = all
        .iter()
        .map(|expected| folder.join(&expected.file))
        .collect();
    let mut set = CaptureSet::open(&paths).unwrap();
    let mut expected: BTreeMap<Stream, u64> = BTreeMap::new();
    for (stream, count) in all.into_iter().flat_map(|expected| expected.streams) {
        *expected.entry(stream).or_default() += count;
    }
    assert_eq!(count_streams(&mut set), expected);
}

/// The simulated scenes are gzip files of the size of a real test.
#[test]
fn a_scene_is_read_to_its_end() {
    let scene =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes/edge/capture.pcap.gz");
    if !scene.is_file() {
        return println!("skipped: the shared scenes are not beside this project");
    }
    let start = std::time::Instant::now();
    let mut set = CaptureSet::open(&[scene]).unwrap();
    let streams = count_streams(&mut set);
    let facts = &set.facts()[0].facts;
    println!(
        "{} records in {:?}: {streams:?}, drops {:?}",
        facts.records,
        start.elapsed(),
        set.drops()
    );
    let dropped: u64 = set.drops().iter().map(|(_, count)| count).sum();
    assert_eq!(streams.values().sum::<u64>() + dropped, facts.records);
    assert!(facts.warnings.is_empty());
    let lidars = streams
        .iter()
        .filter(|(stream, count)| stream.2 == 1206 && **count > 10_000);
    assert_eq!(lidars.count(), 4);
}

/// The plain reader of the core sees the same as the set does.
#[test]
fn the_reader_of_the_core_agrees() {
    let Some(folder) = captures() else { return };
    let bytes = std::fs::read(folder.join("ouster_two_sensors_same_ports.pcap")).unwrap();
    let mut reader = DatagramReader::new(&bytes[..]).unwrap();
    let mut lengths = Vec::new();
    while let Some(datagram) = reader.next().unwrap() {
        lengths.push(datagram.payload.len());
    }
    lengths.sort_unstable();
    assert_eq!(lengths, [48, 48, 12_608, 16_640]);
    assert_eq!(reader.fragments().datagrams, 2);
}

/// Sweeps of a whole capture, written out: decoded packet by packet, and turn by turn side by side.
fn sweeps_both_ways(path: &Path) -> Option<[Vec<String>; 2]> {
    let mut batch = DatagramBatch::default();
    let mut set = CaptureSet::open(&[path.to_path_buf()]).unwrap();
    let mut scan = Scan::new(ScanOptions::default());
    while let Some(datagram) = set.next().unwrap() {
        scan.push(&datagram);
        batch.push(&datagram);
    }
    let (report, options) = (scan.finish(), SweepOptions::default());
    let mut one = SweepReader::new(&report, &options).ok()?;
    batch.iter().for_each(|datagram| one.push(&datagram));
    one.finish();
    let mut many = Abreast::<PointCloud<Sensor>>::new(&report, &options).unwrap()?;
    many.push(&batch);
    many.finish();
    assert_eq!(many.is_done(), one.is_done());
    let written = |sweep: Sweep| format!("{sweep:?}");
    Some([
        std::iter::from_fn(|| one.pop()).map(written).collect(),
        std::iter::from_fn(|| many.pop()).map(written).collect(),
    ])
}

/// Whatever the sensor, and whatever its packets have in common.
#[test]
fn turns_decoded_side_by_side_are_those_of_one_thread() {
    let Some(folder) = captures() else { return };
    let (mut compared, mut seen) = (0, 0);
    for expected in manifest(&folder) {
        let Some([one, many]) = sweeps_both_ways(&folder.join(&expected.file)) else {
            continue; // needs a file of the unit
        };
        assert!(one == many, "{}", expected.file);
        compared += 1;
        seen += one.len();
    }
    assert!(
        compared >= 8 && seen > 40,
        "{compared} captures, {seen} sweeps"
    );
}
