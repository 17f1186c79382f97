//! Captures across the border: a scan, sweeps, and the files between.

mod columns;
mod cut;
mod describe;
pub mod feed;
mod hold;
mod points;
pub mod reading;
mod sweeps;

use std::path::PathBuf;
use std::sync::Arc;

use lidar_deflect_core::packet::{self, unit::UnitFile};
use lidar_deflect_core::stream::{Given, Scan, ScanOptions, ScanReport, Source};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::BorderResult;
use feed::Feed;

/// What a scan of a capture found: the base for everything that reads the capture again.
#[pyclass(frozen, name = "CaptureScan", module = "lidar_deflect._native")]
pub struct CaptureScan {
    /// Files of the capture.
    pub paths: Vec<PathBuf>,
    /// What was found.
    pub report: Arc<ScanReport>,
    files: feed::FilesReport,
}

#[pymethods]
impl CaptureScan {
    /// Names of the lidars, `address:port`, in the order of their numbers.
    #[getter]
    fn lidars(&self) -> Vec<String> {
        let lidars = self.report.lidars.iter();
        lidars.map(|lidar| lidar.key.to_string()).collect()
    }

    /// UTC of the first accepted lidar packet, nanoseconds.
    #[getter]
    fn first_time_ns(&self) -> Option<i64> {
        self.report.first.map(|time| time.0)
    }

    /// UTC of the end of the last lidar packet, nanoseconds.
    #[getter]
    fn last_time_ns(&self) -> Option<i64> {
        self.report.last.map(|time| time.0)
    }

    /// Everything that was found, as plain dictionaries.
    fn describe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        describe::scan(py, &self.report, &self.files)
    }

    /// Columns of counts per second and lidar.
    fn health<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns::health(py, &self.report)
    }
}

/// Reads a capture once and tells what is in it.
///
/// `sensors` are pairs of a source and a model id; `units` are files of single units: source or none,
/// name, content, and whether the user named it; `progress` is called with bytes done and total.
#[pyfunction]
#[pyo3(signature = (paths, *, sensors, units, progress=None))]
fn scan_capture(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    sensors: Vec<(String, String)>,
    units: Vec<UnitEntry>,
    progress: Option<Py<PyAny>>,
) -> BorderResult<CaptureScan> {
    let options = options(&sensors, units)?;
    let (mut report, mut files) = scan_once(py, &paths, options, progress.as_ref())?;
    if let Some(options) = report.split() {
        (report, files) = scan_once(py, &paths, options, progress.as_ref())?;
    }
    if !report.lidars.is_empty() {
        report.check_units()?;
    }
    Ok(CaptureScan {
        paths,
        report: Arc::new(report),
        files,
    })
}

/// Source or none, name, content, and whether the user named the file.
type UnitEntry = (Option<String>, String, Vec<u8>, bool);

fn options(sensors: &[(String, String)], units: Vec<UnitEntry>) -> BorderResult<ScanOptions> {
    let mut options = ScanOptions::default();
    for (source, id) in sensors {
        let named = (Source::parse(source)?, packet::model(id)?);
        options.models.push(named);
    }
    for (source, name, content, is_named) in units {
        options.units.push(Given {
            source: source.as_deref().map(Source::parse).transpose()?,
            file: UnitFile::new(name, content),
            is_named,
        });
    }
    Ok(options)
}

fn scan_once(
    py: Python<'_>,
    paths: &[PathBuf],
    options: ScanOptions,
    progress: Option<&Py<PyAny>>,
) -> BorderResult<(ScanReport, feed::FilesReport)> {
    let mut feed = Feed::open(py, paths)?;
    let mut scan = Scan::new(options);
    // One by one: what a scan does to a packet is less than putting it aside for another thread.
    while feed.block(py, progress, |datagram| {
        scan.push(datagram);
        feed::Want::More
    })? {}
    let report = py.detach(|| scan.finish());
    Ok((report, feed.report()))
}

/// Reads `head_s` seconds of a capture and its last records.
///
/// What is counted is of the head; the second value gives the end of the last packet of each lidar
/// that is seen in the tail, by name, UTC in nanoseconds.
#[pyfunction]
#[pyo3(signature = (paths, *, sensors, units, head_s))]
#[allow(clippy::needless_pass_by_value)] // Python hands over values, not borrows
fn scan_quickly(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    sensors: Vec<(String, String)>,
    units: Vec<UnitEntry>,
    head_s: f64,
) -> BorderResult<(CaptureScan, Vec<(String, i64)>)> {
    let options = options(&sensors, units)?;
    let mut feed = Feed::open(py, &paths)?;
    let mut scan = Scan::new(options.clone());
    let mut first = None;
    while feed.block(py, None, |datagram| {
        scan.push(datagram);
        let first = *first.get_or_insert(datagram.time);
        if datagram.time.seconds_since(first) > head_s {
            feed::Want::Stop
        } else {
            feed::Want::More
        }
    })? {}
    let report = scan.finish();
    let ends = py.detach(|| feed::ends(&paths, &options));
    let scan = CaptureScan {
        paths,
        report: Arc::new(report),
        files: feed.report(),
    };
    Ok((scan, ends))
}

/// Looks at the first bytes of all files, so that what is no capture is told at once.
#[pyfunction]
fn check_captures(py: Python<'_>, paths: Vec<PathBuf>) -> BorderResult<()> {
    Feed::open(py, &paths).map(|_| ())
}

/// Ids of the sensor models that are known, with their names.
#[pyfunction]
fn sensor_models() -> Vec<(&'static str, &'static str)> {
    let models = packet::MODELS.iter();
    models.map(|model| (model.id(), model.title())).collect()
}

/// Id of the sensor model with this name; dashes and capitals do not matter, older names are taken too.
#[pyfunction]
fn sensor_id(name: &str) -> Option<&'static str> {
    packet::model(name).ok().map(packet::Model::id)
}

/// What is decoded of each model and how that was proven: id, name, how it is recognised, returns,
/// files of a unit, proof.
#[pyfunction]
fn sensor_table() -> Vec<[String; 6]> {
    let rows = packet::proof::rows();
    rows.map(|row| {
        let title = packet::model(row.id).map_or(row.id, |model| model.title());
        let texts = [row.id, title, row.recognised, row.returns, row.unit];
        let [id, title, recognised, returns, unit] = texts.map(str::to_owned);
        [id, title, recognised, returns, unit, row.proof.describe()]
    })
    .collect()
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<CaptureScan>()?;
    module.add_class::<sweeps::Sweep>()?;
    module.add_class::<sweeps::SweepIterator>()?;
    module.add_class::<points::PointIterator>()?;
    module.add_function(wrap_pyfunction!(cut::cut_capture, module)?)?;
    module.add_function(wrap_pyfunction!(hold::hold_echoes, module)?)?;
    module.add_function(wrap_pyfunction!(scan_capture, module)?)?;
    module.add_function(wrap_pyfunction!(scan_quickly, module)?)?;
    module.add_function(wrap_pyfunction!(check_captures, module)?)?;
    module.add_function(wrap_pyfunction!(sensor_table, module)?)?;
    module.add_function(wrap_pyfunction!(sensor_id, module)?)?;
    module.add_function(wrap_pyfunction!(sensor_models, module)?)
}
