//! Holds out of a capture: scan lines inside a box, with their ends.

use lidar_deflect_core::beam::echoes::Seen;
use lidar_deflect_core::beam::gather::Gather;
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::stream::{SweepOptions, SweepReader};
use lidar_deflect_core::time::Timestamp;
use numpy::{PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays;
use crate::capture::CaptureScan;
use crate::capture::feed::{Feed, Want};
use crate::error::BorderResult;

/// What the lidars saw of the blade in a stretch of time.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct BeamSeen {
    pub seen: Seen,
}

#[pymethods]
impl BeamSeen {
    fn __len__(&self) -> usize {
        self.seen.echoes.len()
    }

    fn __repr__(&self) -> String {
        let (echoes, edges) = (self.seen.echoes.len(), self.seen.edges.len());
        format!("<BeamSeen: {echoes} echoes, {edges} ends of scan lines>")
    }
}

/// Reads what lidars (numbers in the scan) with poses (lidars, 4, 4) saw inside of a box (2, 3) in
/// each of the windows, in time order.
#[pyfunction]
#[pyo3(signature = (scan, *, lidars, poses, cut_azimuth_deg, box_m, windows_ns, progress=None))]
#[allow(clippy::too_many_arguments)] // keywords of Python
pub fn beam_seen(
    py: Python<'_>,
    scan: &CaptureScan,
    lidars: Vec<usize>,
    poses: PyReadonlyArray3<'_, f64>,
    cut_azimuth_deg: Vec<f64>,
    box_m: PyReadonlyArray2<'_, f64>,
    windows_ns: Vec<(i64, i64)>,
    progress: Option<Py<PyAny>>,
) -> BorderResult<Vec<BeamSeen>> {
    let corners = arrays::points("box_m", &box_m)?;
    arrays::expect_rows("box_m", corners.len(), 2)?;
    let matrices = arrays::matrices("poses", &poses, lidars.len())?;
    let poses: Result<Vec<_>, _> = matrices.iter().map(WorldFromSensor::from_matrix).collect();
    let pass = PassThrough::new(corners[0], corners[1])?;
    let options = SweepOptions {
        lidars: Some(lidars.clone()),
        cut_azimuth_rad: cuts(&lidars, &cut_azimuth_deg),
        start: windows_ns.iter().map(|w| Timestamp(w.0)).min(),
        stop: windows_ns.iter().map(|w| Timestamp(w.1)).max(),
    };
    let mut gather = Gather::new(poses?, pass, windows_ns);
    let mut feed = Feed::open(py, &scan.paths)?;
    let mut reader = SweepReader::new(&scan.report, &options)?;
    loop {
        let more = feed.block(py, progress.as_ref(), |datagram| {
            reader.push(datagram);
            take(&mut reader, &mut gather, &lidars);
            if reader.is_done() {
                Want::Stop
            } else {
                Want::More
            }
        })?;
        if !more || reader.is_done() {
            break;
        }
    }
    py.detach(|| {
        reader.finish();
        take(&mut reader, &mut gather, &lidars);
    });
    Ok(gather
        .finish()
        .into_iter()
        .map(|seen| BeamSeen { seen })
        .collect())
}

fn take(reader: &mut SweepReader, gather: &mut Gather, lidars: &[usize]) {
    while let Some(mut sweep) = reader.pop() {
        let number = sweep.lidar;
        if let Some(place) = lidars.iter().position(|lidar| *lidar == number) {
            sweep.lidar = place;
            gather.push(&sweep);
        }
        reader.recycle(number, sweep.cloud);
    }
}

/// Cut azimuths by number of the lidar, as the reader wants them.
fn cuts(lidars: &[usize], degrees: &[f64]) -> Vec<f64> {
    let mut by_number = vec![0.0; lidars.iter().max().map_or(0, |last| last + 1)];
    for (number, cut) in lidars.iter().zip(degrees) {
        by_number[*number] = cut.to_radians();
    }
    by_number
}
