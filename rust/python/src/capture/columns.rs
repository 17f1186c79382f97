//! Tables of a scan as numpy columns.

use lidar_deflect_core::stream::{Health, ScanReport};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Counts per second and lidar; NaN where a number is missing.
pub fn health<'py>(py: Python<'py>, report: &ScanReport) -> PyResult<Bound<'py, PyDict>> {
    let rows: Vec<Health> = report.health().collect();
    let columns = PyDict::new(py);
    let counts = |of: fn(&Health) -> u64| column(&rows, of).into_pyarray(py);
    let reals = |of: fn(&Health) -> f64| column(&rows, of).into_pyarray(py);
    let names: Vec<String> = report.lidars.iter().map(|l| l.key.to_string()).collect();
    let lidar: Vec<&str> = rows.iter().map(|row| names[row.lidar].as_str()).collect();
    columns.set_item("time_ns", column(&rows, |row| row.time.0).into_pyarray(py))?;
    columns.set_item("lidar", lidar)?;
    columns.set_item("packets", counts(|row| row.counts.packets))?;
    columns.set_item("lost", counts(|row| row.counts.lost))?;
    columns.set_item("duplicated", counts(|row| row.counts.duplicated))?;
    columns.set_item("late", counts(|row| row.counts.late))?;
    columns.set_item("foreign", counts(|row| row.foreign))?;
    columns.set_item("points", counts(|row| row.points))?;
    columns.set_item("rpm", reals(|row| row.rpm.unwrap_or(f64::NAN)))?;
    let offset = reals(|row| row.clock_offset_s.unwrap_or(f64::NAN));
    columns.set_item("clock_offset_s", offset)?;
    columns.set_item("coverage", reals(|row| row.coverage))?;
    Ok(columns)
}

fn column<T>(rows: &[Health], of: fn(&Health) -> T) -> Vec<T> {
    rows.iter().map(of).collect()
}
