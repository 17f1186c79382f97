//! Do several files give one stream in the order of time, whatever they are packed in?

mod support;

use std::path::PathBuf;

use lidar_deflect_core::capture::PcapWriter;
use lidar_deflect_core::time::Timestamp;
use lidar_deflect_files::CaptureSet;
use support::{folder, gzip, pcap, read, write, zstd};

const SECOND: i64 = 1_000_000_000;

#[test]
fn every_packing_gives_the_same() {
    let folder = folder("every_packing");
    let plain = pcap(1, (0..5000).map(|n| n * SECOND));
    let (head, tail) = plain.split_at(70_001);
    let skippable = [0x53, 0x2A, 0x4D, 0x18, 3, 0, 0, 0, 1, 2, 3].to_vec();
    let cases = [
        ("plain", plain.clone()),
        ("gz", gzip(&plain)),
        (
            "gz of members",
            [gzip(head), gzip(b""), gzip(tail)].concat(),
        ),
        ("zst", zstd(&plain)),
        (
            "zst of frames",
            [zstd(head), skippable.clone(), zstd(tail), skippable.clone()].concat(),
        ),
        (
            "zst behind a skippable frame",
            [skippable, zstd(&plain)].concat(),
        ),
    ];
    for (name, bytes) in cases {
        // The suffix says the opposite of the content: it does not count.
        let suffix = if name == "plain" { "pcap.gz" } else { "pcap" };
        let path = write(
            &folder,
            &format!("{}.{suffix}", name.replace(' ', "_")),
            &bytes,
        );
        let mut set = CaptureSet::open(&[path]).unwrap();
        assert_eq!(
            (set.bytes_total(), set.bytes_done() > 0),
            (bytes.len() as u64, true)
        );
        assert_eq!(read(&mut set).unwrap().len(), 5000, "{name}");
        assert_eq!(set.bytes_done(), set.bytes_total(), "{name}");
        assert_eq!(set.facts()[0].facts.bytes, plain.len() as u64);
    }
}

#[test]
fn rotated_files_are_read_in_the_order_of_time() {
    let folder = folder("rotated");
    // tcpdump -C counts without leading zeros: the order of names is 0, 1, 10, 11, 2, ...
    let mut paths: Vec<PathBuf> = (0..12)
        .map(|n| {
            let times = (0..100).map(|i| (n * 100 + i) * SECOND);
            let bytes = pcap(1, times);
            let bytes = if n % 2 == 0 { bytes } else { gzip(&bytes) };
            write(&folder, &format!("run.pcap{n}"), &bytes)
        })
        .collect();
    paths.sort();
    let mut set = CaptureSet::open(&paths).unwrap();
    let expected: Vec<_> = (0..1200).map(|n| (1, n * SECOND)).collect();
    assert_eq!(read(&mut set).unwrap(), expected);
    let starts: Vec<_> = set
        .facts()
        .iter()
        .map(|file| file.facts.first_time)
        .collect();
    assert!(starts.is_sorted() && starts.len() == 12);
    assert_eq!(set.bytes_done(), set.bytes_total());
}

#[test]
fn files_of_one_lidar_each_are_merged() {
    let folder = folder("parallel");
    // Lidars send every 10 s, 3 s apart; the third begins late and the fourth is silent.
    let times = |lidar: i64| (lidar * lidar * 4..200).map(move |n| (n * 10 + lidar * 3) * SECOND);
    let mut paths: Vec<PathBuf> = (0..3u8)
        .map(|lidar| {
            write(
                &folder,
                &format!("{lidar}"),
                &pcap(lidar, times(lidar.into())),
            )
        })
        .collect();
    paths.insert(1, write(&folder, "silent", &pcap(9, [])));
    let mut set = CaptureSet::open(&paths).unwrap();
    let mut expected: Vec<(u8, i64)> = (0..3u8)
        .flat_map(|lidar| times(lidar.into()).map(move |time| (lidar, time)))
        .collect();
    expected.sort_by_key(|(_, time)| *time);
    assert_eq!(read(&mut set).unwrap(), expected);
    let total: u64 = set.facts().iter().map(|file| file.facts.records).sum();
    assert_eq!(total, expected.len() as u64);
}

#[test]
fn equal_stamps_keep_the_order_of_the_files_given() {
    let folder = folder("equal");
    let paths: Vec<PathBuf> = [3, 1, 2]
        .iter()
        .map(|lidar| write(&folder, &format!("{lidar}"), &pcap(*lidar, [5, 5, 7])))
        .collect();
    let mut set = CaptureSet::open(&paths).unwrap();
    let lidars: Vec<u8> = read(&mut set)
        .unwrap()
        .into_iter()
        .map(|(lidar, _)| lidar)
        .collect();
    assert_eq!(lidars, [3, 3, 1, 1, 2, 2, 3, 1, 2]);
}

/// A rotation may fall between the fragments of one datagram.
#[test]
fn fragments_of_one_datagram_may_lie_in_two_files() {
    let folder = folder("fragments");
    let (source, destination) = (
        "10.0.0.1:7502".parse().unwrap(),
        "10.0.0.2:7502".parse().unwrap(),
    );
    let mut writer = PcapWriter::new(Vec::new()).unwrap();
    let payload: Vec<u8> = (0..12_608).map(|i| (i % 251) as u8).collect();
    writer
        .write_udp(Timestamp(0), source, destination, &payload)
        .unwrap();
    let bytes = writer.into_inner();
    let record = 16 + 14 + 1500;
    let second = [&bytes[..24], &bytes[24 + 4 * record..]].concat();
    let paths = [
        write(&folder, "a", &bytes[..24 + 4 * record]),
        write(&folder, "b", &second),
    ];
    let mut set = CaptureSet::open(&paths).unwrap();
    assert_eq!(set.next().unwrap().unwrap().payload, payload);
    assert_eq!(set.current_file(), Some(paths[1].as_path()));
    assert!(set.next().unwrap().is_none());
    assert_eq!(set.drops().iter().count(), 0);
}

#[test]
fn truncated_files_of_a_set_are_warnings() {
    let folder = folder("truncated");
    let first = pcap(1, [0, SECOND]);
    let second = gzip(&pcap(1, (2..2000).map(|n| n * SECOND)));
    let paths = [
        write(&folder, "a", &first[..first.len() - 1]),
        write(&folder, "b", &second[..second.len() / 2]),
    ];
    let mut set = CaptureSet::open(&paths).unwrap();
    let found = read(&mut set).unwrap();
    assert!(
        found.starts_with(&[(1, 0), (1, 2 * SECOND)]) && found.len() > 500,
        "{}",
        found.len()
    );
    let warnings: Vec<usize> = set
        .facts()
        .iter()
        .map(|file| file.facts.warnings.len())
        .collect();
    assert!(
        warnings[0] == 1 && (1..=2).contains(&warnings[1]),
        "{warnings:?}"
    );
}

#[test]
fn garbage_in_one_file_is_told_once_and_the_others_go_on() {
    let folder = folder("garbage");
    let mut broken = pcap(1, [0, 2, 4]);
    broken.truncate(broken.len() - 67); // one record of 16 + 14 + 28 + 9 bytes
    broken.extend([0xFF; 100]);
    let paths = [
        write(&folder, "broken.pcap", &broken),
        write(&folder, "sound.pcap", &pcap(2, [1, 3, 5])),
    ];
    let mut set = CaptureSet::open(&paths).unwrap();
    let error = read(&mut set).unwrap_err().to_string();
    assert!(error.contains("broken.pcap: record 2 (byte 158"), "{error}");
    assert_eq!(read(&mut set).unwrap(), [(2, 3), (2, 5)]);
}

/// A day of rotated files must not need as many open files, nor a buffer for each.
#[cfg(target_os = "linux")]
#[test]
fn a_rotated_set_holds_one_file_open_at_a_time() {
    let folder = folder("lazy");
    let paths: Vec<PathBuf> = (0..40i64)
        .map(|n| write(&folder, &format!("{n}"), &pcap(1, [2 * n, 2 * n + 1])))
        .collect();
    let open_files = || {
        let links = std::fs::read_dir("/proc/self/fd").unwrap().flatten();
        let targets = links.filter_map(|link| std::fs::read_link(link.path()).ok());
        targets.filter(|target| target.starts_with(&folder)).count()
    };
    let mut set = CaptureSet::open(&paths).unwrap();
    assert_eq!(open_files(), 0);
    let mut count = 0;
    while set.next().unwrap().is_some() {
        assert_eq!(open_files(), 1);
        count += 1;
    }
    assert_eq!((count, open_files()), (80, 0));
}

#[test]
fn a_set_can_be_read_on_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<CaptureSet>();
}
