//! Sweeps as objects with numpy columns that own the memory of the core's columns.

use std::sync::{Mutex, PoisonError};

use lidar_deflect_core::cloud::PointCloud;
use lidar_deflect_core::frame;
use lidar_deflect_core::stream::{SweepOptions, Sweeps, sweeps};
use lidar_deflect_core::sweep::Sweep as CoreSweep;
use lidar_deflect_core::time::Timestamp;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use super::CaptureScan;
use super::reading::ReadingFeed;
use crate::error::BorderResult;

/// One turn of one lidar.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct Sweep {
    /// Name of the lidar.
    #[pyo3(get)]
    lidar: String,
    #[pyo3(get)]
    index: u32,
    #[pyo3(get)]
    start_ns: i64,
    #[pyo3(get)]
    end_ns: i64,
    #[pyo3(get)]
    coverage: f32,
    #[pyo3(get)]
    packets: u32,
    #[pyo3(get)]
    lost: u32,
    #[pyo3(get)]
    xyz: Py<PyArray2<f32>>,
    #[pyo3(get)]
    time_ns: Py<PyArray1<i64>>,
    #[pyo3(get)]
    ring: Py<PyArray1<u16>>,
    #[pyo3(get)]
    range_m: Py<PyArray1<f32>>,
    #[pyo3(get)]
    azimuth_deg: Py<PyArray1<f32>>,
    #[pyo3(get)]
    intensity: Py<PyArray1<u16>>,
    #[pyo3(get)]
    return_index: Py<PyArray1<u8>>,
    #[pyo3(get)]
    return_kind: Py<PyArray1<u8>>,
    #[pyo3(get)]
    packet: Py<PyArray1<u32>>,
    #[pyo3(get)]
    block: Py<PyArray1<u16>>,
    points: usize,
}

impl Sweep {
    fn new(py: Python<'_>, lidar: String, sweep: CoreSweep) -> PyResult<Self> {
        let mut cloud = sweep.cloud;
        let points = cloud.len();
        let azimuth_deg = cloud.take_azimuth_deg();
        let return_kind = cloud.take_return_kind_codes();
        let xyz = cloud.xyz_m.into_flattened().into_pyarray(py);
        Ok(Self {
            lidar,
            index: sweep.index,
            start_ns: sweep.start.0,
            end_ns: sweep.end.0,
            coverage: sweep.coverage,
            packets: sweep.packets,
            lost: sweep.lost,
            xyz: xyz.reshape([points, 3])?.unbind(),
            time_ns: cloud.time_ns.into_pyarray(py).unbind(),
            ring: cloud.ring.into_pyarray(py).unbind(),
            range_m: cloud.range_m.into_pyarray(py).unbind(),
            azimuth_deg: azimuth_deg.into_pyarray(py).unbind(),
            intensity: cloud.intensity.into_pyarray(py).unbind(),
            return_index: cloud.return_index.into_pyarray(py).unbind(),
            return_kind: return_kind.into_pyarray(py).unbind(),
            packet: cloud.packet.into_pyarray(py).unbind(),
            block: cloud.block.into_pyarray(py).unbind(),
            points,
        })
    }
}

#[pymethods]
impl Sweep {
    fn __len__(&self) -> usize {
        self.points
    }

    fn __repr__(&self) -> String {
        let (points, lost, percent) = (self.points, self.lost, 100.0 * self.coverage);
        let (lidar, index) = (&self.lidar, self.index);
        format!("<Sweep {index} of {lidar}: {points} points, {percent:.1} % seen, {lost} lost>")
    }
}

type SweepFeed = ReadingFeed<Box<dyn Sweeps<PointCloud<frame::Sensor>>>>;

/// Reads a capture and gives its sweeps one by one.
#[pyclass(module = "lidar_deflect._native")]
pub struct SweepIterator {
    feed: Mutex<SweepFeed>, // never locked: what waits for other threads is of one thread
    names: Vec<String>,
    progress: Option<Py<PyAny>>,
}

#[pymethods]
impl SweepIterator {
    /// `lidars` are numbers; `names`, `cut_rad` and `every` go by number; `start_ns` and `stop_ns` are UTC. Of the
    /// turns those are given whose number is a multiple of `every`.
    #[new]
    #[allow(clippy::too_many_arguments)] // keywords in Python
    #[pyo3(signature = (
        scan, *, lidars, names, cut_rad, every, start_ns=None, stop_ns=None, progress=None
    ))]
    fn new(
        py: Python<'_>,
        scan: &CaptureScan,
        lidars: Vec<usize>,
        names: Vec<String>,
        cut_rad: Vec<f64>,
        every: Vec<u32>,
        start_ns: Option<i64>,
        stop_ns: Option<i64>,
        progress: Option<Py<PyAny>>,
    ) -> BorderResult<Self> {
        let options = SweepOptions {
            lidars: Some(lidars),
            cut_azimuth_rad: cut_rad,
            every,
            start: start_ns.map(Timestamp),
            stop: stop_ns.map(Timestamp),
            ..SweepOptions::default()
        };
        let reading = sweeps(&scan.report, &options)?;
        Ok(Self {
            feed: Mutex::new(ReadingFeed::open(py, &scan.paths, reading)?),
            names,
            progress,
        })
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&mut self, py: Python<'_>) -> BorderResult<Option<Sweep>> {
        let feed = self.feed.get_mut().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(sweep) = feed.reading.pop() {
                let name = self.names.get(sweep.lidar).cloned().unwrap_or_default();
                return Ok(Some(Sweep::new(py, name, sweep)?));
            }
            if feed.has_ended() {
                return Ok(None);
            }
            feed.read_on(py, None, self.progress.as_ref())?;
        }
    }

    /// Second returns that were merged into the first so far.
    #[getter]
    fn merged(&mut self) -> u64 {
        let feed = self.feed.get_mut().unwrap_or_else(PoisonError::into_inner);
        feed.reading.merged()
    }
}
