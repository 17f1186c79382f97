//! A shorter capture out of a long one.

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use lidar_deflect_core::capture::PcapWriter;
use lidar_deflect_core::stream::{CaptureCut, SweepOptions};
use lidar_deflect_core::time::Timestamp;
use pyo3::prelude::*;

use super::CaptureScan;
use super::feed::{Feed, Want};
use crate::error::BorderResult;

/// Writes the datagrams of lidars between two times as a new capture; gives their number.
///
/// Data packets are chosen by their own time, so that none of the span is missing at its end.
#[pyfunction]
#[pyo3(signature = (scan, out, *, lidars, start_ns=None, stop_ns=None, progress=None))]
pub fn cut_capture(
    py: Python<'_>,
    scan: &CaptureScan,
    out: PathBuf,
    lidars: Vec<usize>,
    start_ns: Option<i64>,
    stop_ns: Option<i64>,
    progress: Option<Py<PyAny>>,
) -> BorderResult<u64> {
    let options = SweepOptions {
        lidars: Some(lidars),
        start: start_ns.map(Timestamp),
        stop: stop_ns.map(Timestamp),
        ..SweepOptions::default()
    };
    let mut cut = CaptureCut::new(&scan.report, &options);
    let mut writer = PcapWriter::new(BufWriter::new(File::create(out)?))?;
    let mut feed = Feed::open(py, &scan.paths)?;
    let mut written = 0;
    let mut failure = None;
    while feed.block(py, progress.as_ref(), |datagram| {
        if !cut.wants(datagram) {
            return Want::More;
        }
        let (from, to) = (datagram.source, datagram.destination);
        match writer.write_udp(datagram.time, from, to, datagram.payload) {
            Ok(()) => {
                written += 1;
                Want::More
            }
            Err(error) => {
                failure = Some(error);
                Want::Stop
            }
        }
    })? {}
    match failure {
        Some(error) => Err(error.into()),
        None => {
            writer.flush()?;
            Ok(written)
        }
    }
}
