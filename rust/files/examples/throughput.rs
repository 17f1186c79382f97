//! How fast does a capture go through each stage? For `benches/peers`, which runs it beside other programs.
//!
//! `cargo run --release --example throughput -- JOB CAPTURE`, JOB one of `bytes` (read and decompress alone), `datagrams`,
//! `scan`, `sweeps` (with the scan before it), `stream` (with a look at the head instead) and `two` (the same on two
//! threads): prints seconds, datagrams and points.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::Instant;

use lidar_deflect_core::capture::DatagramBatch;
use lidar_deflect_core::cloud::PointCloud;
use lidar_deflect_core::frame::Sensor;
use lidar_deflect_core::stream::{
    Abreast, Reading, Scan, ScanOptions, ScanReport, SweepOptions, SweepReader,
};
use lidar_deflect_files::{CaptureSet, FileError};
use rayon::ThreadPoolBuilder;

/// Datagrams of a look at the head: two seconds of a small lidar.
const HEAD: u64 = 1500;

/// Bytes of a batch, as the extension reads them.
const BATCH_BYTES: usize = 1 << 19;

type Failure = Box<dyn std::error::Error + Send + Sync>;
type Outcome = Result<(u64, u64), Failure>;

fn main() -> Result<(), Failure> {
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
        "two" => ThreadPoolBuilder::new()
            .num_threads(2)
            .build()?
            .install(|| abreast(&paths))?,
        _ => return Err("JOB is bytes, datagrams, scan, sweeps, stream or two".into()),
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
fn scan(paths: &[PathBuf], most: u64) -> Result<ScanReport, Failure> {
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

/// As `stream`, turns decoded side by side while the next half megabyte is read.
fn abreast(paths: &[PathBuf]) -> Outcome {
    let report = scan(paths, HEAD)?;
    let reader = Abreast::<PointCloud<Sensor>>::new(&report, &SweepOptions::default())?;
    let mut reader = reader.ok_or("turns of this sensor cannot be decoded apart")?;
    let (mut set, mut count, mut points) = (CaptureSet::open(paths)?, 0, 0);
    let [mut batch, mut ahead] = [DatagramBatch::default(), DatagramBatch::default()];
    loop {
        let fill = || fill(&mut set, &mut ahead);
        let (read, ()) = rayon::join(fill, || reader.push(&batch));
        count += read?;
        if ahead.is_empty() {
            reader.finish();
        }
        while let Some(sweep) = reader.pop() {
            points += sweep.cloud.len() as u64;
            reader.recycle(sweep.lidar, sweep.cloud);
        }
        if ahead.is_empty() {
            return Ok((count, points));
        }
        std::mem::swap(&mut batch, &mut ahead);
    }
}

/// Reads the next datagrams, none behind the last.
fn fill(set: &mut CaptureSet, batch: &mut DatagramBatch) -> Result<u64, FileError> {
    batch.clear();
    let mut count = 0;
    while batch.bytes() < BATCH_BYTES
        && let Some(datagram) = set.next()?
    {
        batch.push(&datagram);
        count += 1;
    }
    Ok(count)
}
