//! Is every file that is no capture named for what it is, with a next step?

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use lidar_deflect_core::error::Coded;
use lidar_deflect_files::{CaptureSet, FileError};
use support::{folder, gzip, pcap, write, zstd};

fn refuse(paths: &[PathBuf]) -> FileError {
    match CaptureSet::open(paths) {
        Ok(_) => panic!("{paths:?} was opened"),
        Err(error) => error,
    }
}

/// Code and words of the message, and that there is a hint and the path.
fn expect(path: &Path, code: &str, words: &str) {
    let error = refuse(&[path.into()]);
    assert_eq!(error.code(), code, "{error}");
    assert!(error.to_string().contains(words), "{error}");
    assert!(
        error.to_string().starts_with(&path.display().to_string()),
        "{error}"
    );
    assert!(error.hint().is_some_and(|hint| !hint.is_empty()));
}

#[test]
fn files_of_other_kinds_are_named() {
    let folder = folder("kinds");
    let cases: [(&str, &[u8], &str, &str); 11] = [
        ("a.pcap", b"", "capture.empty", "an empty file"),
        (
            "b.pcap",
            b"time,x,y\n0,1,2\n",
            "capture.unknown_format",
            "found text",
        ),
        (
            "c.xz",
            b"\xFD7zXZ\0rest",
            "capture.compression",
            "an xz file",
        ),
        (
            "d.bz2",
            b"BZh91AY&SY",
            "capture.compression",
            "a bzip2 file",
        ),
        (
            "e.lz4",
            b"\x04\x22\x4D\x18rest",
            "capture.compression",
            "an lz4 file",
        ),
        (
            "f.bag",
            b"#ROSBAG V2.0\nrest\0",
            "capture.bag",
            "a ROS 1 bag",
        ),
        (
            "g.db3",
            b"SQLite format 3\0rest",
            "capture.bag",
            "a ROS 2 bag",
        ),
        (
            "h.mcap",
            b"\x89MCAP0\r\nrest",
            "capture.bag",
            "an MCAP file",
        ),
        (
            "i.zip",
            b"PK\x03\x04rest\0",
            "capture.archive",
            "a ZIP archive",
        ),
        (
            "j.pcap",
            b"\0\x01\x02\xFF",
            "capture.unknown_format",
            "no known kind",
        ),
        (
            "k.pcap",
            b"\xD4\xC3",
            "capture.unknown_format",
            "no known kind",
        ),
    ];
    for (name, bytes, code, words) in cases {
        expect(&write(&folder, name, bytes), code, words);
    }
}

#[test]
fn compressed_files_of_other_kinds_are_told_by_their_first_bytes() {
    let folder = folder("compressed_kinds");
    let table = gzip(b"time,x,y\n");
    expect(
        &write(&folder, "table.csv.gz", &table),
        "capture.unknown_format",
        "found 74 69 6D 65",
    );
    expect(
        &write(&folder, "empty.gz", &gzip(b"")),
        "capture.unknown_format",
        "found nothing",
    );
    expect(
        &write(&folder, "empty.zst", &zstd(b"")),
        "capture.unknown_format",
        "found nothing",
    );
    expect(
        &write(&folder, "cut.gz", &table[..5]),
        "capture.unknown_format",
        "found nothing",
    );
    let mut broken = gzip(&pcap(1, 0..1000));
    broken[12..40].fill(0xFF);
    expect(
        &write(&folder, "broken.gz", &broken),
        "capture.read",
        "cannot be read",
    );
}

#[test]
fn paths_that_lead_to_no_file() {
    let folder = folder("paths");
    expect(
        &folder.join("nowhere.pcap"),
        "capture.not_found",
        "no such file",
    );
    expect(
        &folder.join("nowhere").join("run.pcap"),
        "capture.not_found",
        "no such file",
    );
    expect(&folder, "capture.directory", "found a directory");
    let file = write(&folder, "run.pcap", &pcap(1, [0]));
    expect(&file.join("below"), "capture.not_found", "no such file");
    assert!(refuse(&[folder.join("nowhere.pcap")]).is_not_found());
    assert_eq!(refuse(&[]).code(), "capture.none_given");
}

#[test]
fn one_file_given_twice_is_refused() {
    let folder = folder("twice");
    let file = write(&folder, "run.pcap", &pcap(1, [0]));
    let again = folder.join(".").join("run.pcap");
    assert_eq!(refuse(&[file, again]).code(), "capture.given_twice");
}

#[test]
fn one_bad_file_of_several_is_named() {
    let folder = folder("several");
    let good = write(&folder, "good.pcap", &pcap(1, [0]));
    let bad = write(&folder, "notes.txt", b"wind 3 m/s");
    let error = refuse(&[good, bad]).to_string();
    assert!(error.contains("notes.txt"), "{error}");
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_read() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder("rights");
    let path = write(&folder, "secret.pcap", &pcap(1, [0]));
    fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::read(&path).is_ok() {
        return println!("skipped: the user of this test may read everything");
    }
    expect(&path, "capture.unreadable", "cannot be read");
}

/// Every prefix of compressed captures ends or is refused, and never loses what is whole.
#[test]
fn compressed_captures_may_be_cut_anywhere() {
    let folder = folder("cut");
    let plain = pcap(1, (0..60).map(|n| n * 1_234_567));
    for (name, packed) in [("gz", gzip(&plain)), ("zst", zstd(&plain))] {
        let mut best = 0;
        for len in 1..packed.len() {
            let path = write(&folder, &format!("cut.{name}"), &packed[..len]);
            let Ok(mut set) = CaptureSet::open(&[path]) else {
                assert_eq!(best, 0, "{name} of {len} bytes is refused");
                continue;
            };
            let found = support::read(&mut set).unwrap().len();
            assert!(found >= best, "{name} of {len} bytes");
            best = found;
            assert!(
                !set.facts()[0].facts.warnings.is_empty(),
                "{name} of {len} bytes"
            );
        }
    }
}
