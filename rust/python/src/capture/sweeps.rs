//! Sweeps as objects with numpy columns that own the memory of the core's columns.

use lidar_deflect_core::stream::{SweepOptions, SweepReader};
use lidar_deflect_core::sweep::Sweep as CoreSweep;
use lidar_deflect_core::time::Timestamp;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use super::CaptureScan;
use super::feed::{Feed, Want};
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
        let points = sweep.cloud.len();
        let azimuth_deg = sweep.cloud.azimuth_deg();
        let return_kind = sweep.cloud.return_kind_codes();
        let cloud = sweep.cloud;
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

/// Reads a capture and gives its sweeps one by one.
#[pyclass(module = "lidar_deflect._native")]
pub struct SweepIterator {
    feed: Feed,
    reader: SweepReader,
    names: Vec<String>,
    progress: Option<Py<PyAny>>,
    is_finished: bool,
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
        Ok(Self {
            feed: Feed::open(py, &scan.paths)?,
            reader: SweepReader::new(&scan.report, &options)?,
            names,
            progress,
            is_finished: false,
        })
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&mut self, py: Python<'_>) -> BorderResult<Option<Sweep>> {
        loop {
            if let Some(sweep) = self.reader.pop() {
                let name = self.names.get(sweep.lidar).cloned().unwrap_or_default();
                return Ok(Some(Sweep::new(py, name, sweep)?));
            }
            if self.is_finished {
                return Ok(None);
            }
            let reader = &mut self.reader;
            let progress = self.progress.as_ref();
            let goes_on = self.feed.block(py, progress, |datagram| {
                reader.push(datagram);
                if reader.is_done() {
                    Want::Stop
                } else if reader.has_ready() {
                    Want::Pause
                } else {
                    Want::More
                }
            })?;
            if !goes_on {
                py.detach(|| self.reader.finish());
                self.is_finished = true;
            }
        }
    }

    /// Second returns that were merged into the first so far.
    #[getter]
    fn merged(&self) -> u64 {
        self.reader.merged()
    }
}
