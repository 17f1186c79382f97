//! How fast does a capture go through each stage? For `benches/peers`, which runs it beside other programs.
//!
//! `cargo run --release --example throughput -- JOB CAPTURE`, JOB one of `bytes` (read and decompress alone), `datagrams`,
//! `scan`, `sweeps` (with the scan before it) and `stream` (with a look at the head instead): prints seconds, datagrams and points.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::Instant;

use lidar_deflect_core::stream::{Scan, ScanOptions, ScanReport, SweepOptions, SweepReader};
use lidar_deflect_files::CaptureSet;

/// Datagrams of a look at the head: two seconds of a small lidar.
const HEAD: u64 = 1500;

type Outcome = Result<(u64, u64), Box<dyn std::error::Error>>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut given = std::env::args().skip(1);
    let (job, path) = given.next().zip(given.next()).ok_or("JOB and CAPTURE")?;
    let paths = [PathBuf::from(path)];
    let begun = Instant::now();
    let (count, points) = match job.as_str() {
        "bytes" => bytes(&paths[0])?,
        "datagrams" => datagrams(&paths)?,
        "scan" => (scan(&paths, u64::MAX)?.datagrams, 0),
        "sweeps" => sweeps(&paths, u64::MAX)?,
        "stream" => sweeps(&paths, HEAD)?,
        _ => return Err("JOB is bytes, datagrams, scan, sweeps or stream".into()),
    };
    println!("{} {count} {points}", begun.elapsed().as_secs_f64());
    Ok(())
}

/// The decompressor alone.
fn bytes(path: &Path) -> Outcome {
    let file = BufReader::with_capacity(256 * 1024, File::open(path)?);
    let mut reader: Box<dyn Read> = match path.extension().and_then(|end| end.to_str()) {
        Some("gz") => Box::new(flate2::bufread::MultiGzDecoder::new(file)),
        Some("zst") => Box::new(zstd::Decoder::with_buffer(file)?),
        _ => Box::new(file),
    };
    let (mut room, mut count) = (vec![0; 256 * 1024], 0);
    loop {
        match reader.read(&mut room)? {
            0 => return Ok((count, 0)),
            read => count += read as u64,
        }
    }
}

fn datagrams(paths: &[PathBuf]) -> Outcome {
    let (mut set, mut count) = (CaptureSet::open(paths)?, 0);
    while set.next()?.is_some() {
        count += 1;
    }
    Ok((count, 0))
}

/// The first so many datagrams at most.
fn scan(paths: &[PathBuf], most: u64) -> Result<ScanReport, Box<dyn std::error::Error>> {
    let (mut set, mut scan) = (CaptureSet::open(paths)?, Scan::new(ScanOptions::default()));
    let mut count = 0;
    while count < most
        && let Some(datagram) = set.next()?
    {
        scan.push(&datagram);
        count += 1;
    }
    Ok(scan.finish())
}

fn sweeps(paths: &[PathBuf], head: u64) -> Outcome {
    let report = scan(paths, head)?;
    let mut reader = SweepReader::new(&report, &SweepOptions::default())?;
    let (mut set, mut count, mut points) = (CaptureSet::open(paths)?, 0, 0);
    while let Some(datagram) = set.next()? {
        count += 1;
        reader.push(&datagram);
        while let Some(sweep) = reader.pop() {
            points += sweep.cloud.len() as u64;
            reader.recycle(sweep.lidar, sweep.cloud);
        }
    }
    Ok((count, points))
}
