//! Points in the order of arrival, in blocks of numpy columns.

use lidar_deflect_core::stream::{PointBlock, PointReader, SweepOptions};
use lidar_deflect_core::time::Timestamp;
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::CaptureScan;
use super::feed::{Feed, Want};
use crate::error::BorderResult;

/// Reads a capture and gives its points in blocks.
#[pyclass(module = "lidar_deflect._native")]
pub struct PointIterator {
    feed: Feed,
    reader: PointReader,
    block_points: usize,
    progress: Option<Py<PyAny>>,
    is_finished: bool,
}

#[pymethods]
impl PointIterator {
    /// `lidars` are numbers; `start_ns` and `stop_ns` are UTC; blocks hold about `block_points`.
    #[new]
    #[pyo3(signature = (scan, *, lidars, block_points, start_ns=None, stop_ns=None, progress=None))]
    fn new(
        py: Python<'_>,
        scan: &CaptureScan,
        lidars: Vec<usize>,
        block_points: usize,
        start_ns: Option<i64>,
        stop_ns: Option<i64>,
        progress: Option<Py<PyAny>>,
    ) -> BorderResult<Self> {
        let options = SweepOptions {
            lidars: Some(lidars),
            start: start_ns.map(Timestamp),
            stop: stop_ns.map(Timestamp),
            ..SweepOptions::default()
        };
        Ok(Self {
            feed: Feed::open(py, &scan.paths)?,
            reader: PointReader::new(&scan.report, &options)?,
            block_points: block_points.max(1),
            progress,
            is_finished: false,
        })
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__<'py>(&mut self, py: Python<'py>) -> BorderResult<Option<Bound<'py, PyDict>>> {
        while !self.is_finished && self.reader.waiting() < self.block_points {
            let (reader, wanted) = (&mut self.reader, self.block_points);
            let goes_on = self.feed.block(py, self.progress.as_ref(), |datagram| {
                reader.push(datagram);
                if reader.is_done() {
                    Want::Stop
                } else if reader.waiting() >= wanted {
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
        if self.reader.waiting() == 0 {
            return Ok(None);
        }
        let block = self.reader.take();
        Ok(Some(columns(py, block)?))
    }

    /// Second returns that were merged into the first so far.
    #[getter]
    fn merged(&self) -> u64 {
        self.reader.merged()
    }

    /// Blocks of packets that were left out so far, by reason.
    #[getter]
    fn drops(&self) -> Vec<(&'static str, u64)> {
        self.reader.drops().iter().collect()
    }
}

fn columns(py: Python<'_>, block: PointBlock) -> PyResult<Bound<'_, PyDict>> {
    let columns = PyDict::new(py);
    let points = block.lidar.len();
    let mut cloud = block.cloud;
    let azimuth_deg = cloud.take_azimuth_deg();
    let return_kind = cloud.take_return_kind_codes();
    let xyz = cloud.xyz_m.into_flattened().into_pyarray(py);
    columns.set_item("time_ns", cloud.time_ns.into_pyarray(py))?;
    columns.set_item("lidar", block.lidar.into_pyarray(py))?;
    columns.set_item("sweep", block.sweep.into_pyarray(py))?;
    columns.set_item("frame_id", block.frame_id.into_pyarray(py))?;
    columns.set_item("has_frame_id", block.has_frame_id.into_pyarray(py))?;
    columns.set_item("packet", cloud.packet.into_pyarray(py))?;
    columns.set_item("block", cloud.block.into_pyarray(py))?;
    columns.set_item("ring", cloud.ring.into_pyarray(py))?;
    columns.set_item("azimuth_deg", azimuth_deg.into_pyarray(py))?;
    columns.set_item("range_m", cloud.range_m.into_pyarray(py))?;
    columns.set_item("xyz", xyz.reshape([points, 3])?)?;
    columns.set_item("intensity", cloud.intensity.into_pyarray(py))?;
    columns.set_item("return_index", cloud.return_index.into_pyarray(py))?;
    columns.set_item("return_kind", return_kind.into_pyarray(py))?;
    Ok(columns)
}
