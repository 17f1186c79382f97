//! All echoes of a hold, of all lidars in one reading.

use lidar_deflect_core::stream::{Beside, HoldEchoes, SweepOptions};
use lidar_deflect_core::time::Timestamp;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

use super::CaptureScan;
use super::reading::ReadingFeed;
use crate::arrays;
use crate::error::BorderResult;

/// Places, beams, azimuths and intensities of one lidar.
type Columns<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<u16>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
);

/// Gathers the echoes of lidars, by their numbers, from packets in [`start_ns`, `stop_ns`); intensities are
/// empty where they are not asked for.
#[pyfunction]
#[pyo3(signature = (scan, *, lidars, start_ns, stop_ns, with_intensity=true, threads=None))]
pub fn hold_echoes<'py>(
    py: Python<'py>,
    scan: &CaptureScan,
    lidars: Vec<usize>,
    start_ns: i64,
    stop_ns: i64,
    with_intensity: bool,
    threads: Option<usize>,
) -> BorderResult<Vec<Columns<'py>>> {
    let (start, stop) = (Timestamp(start_ns), Timestamp(stop_ns));
    let lidar = |number: &usize| {
        let options = SweepOptions {
            start: Some(start),
            stop: Some(stop),
            ..SweepOptions::of(&[*number], &[0.0])
        };
        let info = scan.report.lidars.get(*number);
        let echoes = info.map(|info| HoldEchoes::of(info, start, stop, with_intensity));
        (options, echoes.unwrap_or_default())
    };
    let beside = Beside::new(&scan.report, lidars.iter().map(lidar))?;
    let mut feed = ReadingFeed::open(py, &scan.paths, beside)?;
    while !feed.has_ended() {
        feed.read_on(py, threads, None)?;
    }
    let takers = feed.reading.into_takers();
    takers.map(|echoes| Ok(columns(py, echoes)?)).collect()
}

fn columns(py: Python<'_>, echoes: HoldEchoes) -> PyResult<Columns<'_>> {
    Ok((
        arrays::rows(py, echoes.xyz_m)?,
        echoes.ring.into_pyarray(py),
        echoes.azimuth_deg.into_pyarray(py),
        echoes.intensity.into_pyarray(py),
    ))
}
