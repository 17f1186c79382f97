//! Captures on disk, for tests.
#![allow(dead_code)] // each test crate uses a part of it

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use flate2::{Compression, write::GzEncoder};
use lidar_deflect_core::capture::PcapWriter;
use lidar_deflect_core::time::Timestamp;
use lidar_deflect_files::{CaptureSet, FileError};

/// A folder of its own for one test.
pub fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// A pcap with one datagram of one lidar at each of these instants; the payload tells both.
pub fn pcap(lidar: u8, times_ns: impl IntoIterator<Item = i64>) -> Vec<u8> {
    let mut writer = PcapWriter::new(Vec::new()).unwrap();
    for time in times_ns {
        let source = format!("192.168.1.{lidar}:2368").parse().unwrap();
        let payload = [&[lidar][..], &time.to_le_bytes()].concat();
        let destination = "192.168.1.255:2368".parse().unwrap();
        writer
            .write_udp(Timestamp(time), source, destination, &payload)
            .unwrap();
    }
    writer.into_inner()
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn zstd(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 1).unwrap()
}

/// Writes the file and returns its path.
pub fn write(folder: &std::path::Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// Lidar and time of every datagram; checks that the stamps are those in the payloads.
pub fn read(set: &mut CaptureSet) -> Result<Vec<(u8, i64)>, FileError> {
    let mut found = Vec::new();
    while let Some(datagram) = set.next()? {
        let (lidar, time) = datagram.payload.split_first().unwrap();
        assert_eq!(datagram.time.0.to_le_bytes(), time);
        found.push((*lidar, datagram.time.0));
    }
    Ok(found)
}
