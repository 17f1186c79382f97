//! A scan as plain dictionaries; what they mean stands in `capture.py`.

use lidar_deflect_core::clock::ClockModel;
use lidar_deflect_core::drops::Drops;
use lidar_deflect_core::error::{Coded, UnitError};
use lidar_deflect_core::stream::{OtherStream, PositionFacts, ScanReport, StreamInfo};
use lidar_deflect_files::FileFacts;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use super::feed::FilesReport;

type Dict<'py> = PyResult<Bound<'py, PyDict>>;

pub fn scan<'py>(py: Python<'py>, report: &ScanReport, files: &FilesReport) -> Dict<'py> {
    let all = PyDict::new(py);
    all.set_item("captures", list(py, &files.files, |f| file(py, f))?)?;
    all.set_item("streams", list(py, &report.lidars, |s| stream(py, s))?)?;
    all.set_item("other_streams", list(py, &report.others, |o| other(py, o))?)?;
    let mut drops = files.drops.clone();
    drops.merge(&report.drops);
    all.set_item("drops", drops_list(py, &drops)?)?;
    all.set_item("datagrams", report.datagrams)?;
    let pauses: Vec<(i64, i64)> = report.pauses.iter().map(|p| (p.from.0, p.to.0)).collect();
    all.set_item("pauses_ns", pauses)?;
    let unused = report.unused_units();
    let unused: Vec<(&str, String)> = unused
        .map(|file| (file.name.as_str(), file.first_line()))
        .collect();
    all.set_item("unused_files", unused)?;
    let fragments = PyDict::new(py);
    fragments.set_item("fragments", files.fragments.fragments)?;
    fragments.set_item("datagrams", files.fragments.datagrams)?;
    fragments.set_item("incomplete", files.fragments.incomplete)?;
    all.set_item("fragments", fragments)?;
    Ok(all)
}

fn list<'py, T>(
    py: Python<'py>,
    items: &[T],
    describe: impl Fn(&T) -> Dict<'py>,
) -> PyResult<Bound<'py, PyList>> {
    let dicts: Vec<Bound<'py, PyDict>> = items.iter().map(describe).collect::<PyResult<_>>()?;
    PyList::new(py, dicts)
}

fn drops_list<'py>(py: Python<'py>, drops: &Drops) -> PyResult<Bound<'py, PyList>> {
    let pairs: Vec<(&str, u64)> = drops.iter().collect();
    list(py, &pairs, |(reason, count)| {
        let pair = PyDict::new(py);
        pair.set_item("reason", *reason)?;
        pair.set_item("count", *count)?;
        Ok(pair)
    })
}

fn stream<'py>(py: Python<'py>, info: &StreamInfo) -> Dict<'py> {
    let dict = PyDict::new(py);
    dict.set_item("source", info.key.address.to_string())?;
    dict.set_item("port", info.key.port)?;
    dict.set_item("source_port", info.key.source_port)?;
    dict.set_item("lidar", info.key.to_string())?;
    dict.set_item("model", info.model.id())?;
    dict.set_item("title", info.model.title())?;
    dict.set_item("candidates", info.candidates.clone())?;
    let beams = match &info.calibration {
        Ok(calibration) => calibration.describe(),
        Err(error) => beams_error(error),
    };
    dict.set_item("beams", beams)?;
    dict.set_item("named", info.is_named)?;
    dict.set_item("return_mode", info.return_mode)?;
    let is_turning = info.model.has_rotor() && info.rpm > 0.0;
    dict.set_item("rpm", is_turning.then_some(info.rpm))?;
    dict.set_item("packets", info.counts.packets)?;
    dict.set_item("lost", info.counts.lost)?;
    dict.set_item("duplicated", info.counts.duplicated)?;
    dict.set_item("late", info.counts.late)?;
    dict.set_item("too_late", info.counts.too_late)?;
    dict.set_item("foreign", info.foreign)?;
    dict.set_item("points", info.points)?;
    dict.set_item("merged", info.merged)?;
    dict.set_item("first_ns", info.first.0)?;
    dict.set_item("last_ns", info.last.0)?;
    dict.set_item(
        "field_of_view_deg",
        360.0 - info.view.blind_rad().to_degrees(),
    )?;
    dict.set_item("clock", clock(py, &info.clock)?)?;
    dict.set_item(
        "position",
        info.position
            .as_ref()
            .map(|p| position(py, p))
            .transpose()?,
    )?;
    dict.set_item("conflict", info.conflict.clone())?;
    dict.set_item("notes", info.notes.clone())?;
    Ok(dict)
}

fn beams_error(error: &UnitError) -> String {
    match error.hint() {
        Some(hint) => format!("missing: {error}; {hint}"),
        None => format!("missing: {error}"),
    }
}

fn clock<'py>(py: Python<'py>, model: &ClockModel) -> Dict<'py> {
    let dict = PyDict::new(py);
    let segments = model.segments();
    let main = model.main();
    dict.set_item("kind", main.map(|line| line.kind.name()))?;
    dict.set_item("offset_s", main.map(|line| line.offset_ns as f64 / 1e9))?;
    dict.set_item("drift_ppm", main.map(|line| line.drift * 1e6))?;
    dict.set_item("jumps", segments.len().saturating_sub(1))?;
    Ok(dict)
}

fn position<'py>(py: Python<'py>, facts: &PositionFacts) -> Dict<'py> {
    let dict = PyDict::new(py);
    dict.set_item("packets", facts.packets)?;
    dict.set_item("port", facts.port)?;
    dict.set_item("pps", facts.pps.name())?;
    dict.set_item("locked", facts.locked)?;
    dict.set_item("nmea", facts.sentence.clone())?;
    Ok(dict)
}

fn other<'py>(py: Python<'py>, stream: &OtherStream) -> Dict<'py> {
    let dict = PyDict::new(py);
    dict.set_item("source", stream.key.address.to_string())?;
    dict.set_item("port", stream.key.port)?;
    dict.set_item("packets", stream.packets)?;
    dict.set_item("positions", stream.positions)?;
    dict.set_item("companions", stream.companions)?;
    dict.set_item("payload_bytes", stream.payload_len)?;
    dict.set_item("rate_hz", stream.rate_hz)?;
    let closest = stream.closest.as_ref();
    dict.set_item("closest_model", closest.and_then(|near| near.may_be))?;
    dict.set_item("why_not", closest.map(|near| near.why.as_str()))?;
    Ok(dict)
}

fn file<'py>(py: Python<'py>, facts: &FileFacts) -> Dict<'py> {
    let dict = PyDict::new(py);
    let seen = &facts.facts;
    dict.set_item("path", &facts.path)?;
    dict.set_item("size_bytes", facts.size)?;
    dict.set_item("format", seen.format.map(|format| format.to_string()))?;
    dict.set_item("records", seen.records)?;
    dict.set_item("first_host_ns", seen.first_time.map(|time| time.0))?;
    dict.set_item("last_host_ns", seen.last_time.map(|time| time.0))?;
    let warnings: Vec<String> = seen.warnings.iter().map(ToString::to_string).collect();
    dict.set_item("warnings", warnings)?;
    Ok(dict)
}
