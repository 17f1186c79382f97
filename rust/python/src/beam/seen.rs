//! Holds out of a capture: scan lines inside a box, with their ends.

use std::sync::Arc;

use lidar_deflect_core::beam::echoes::Seen;
use lidar_deflect_core::beam::gather::Gather;
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::stand::Stands;
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
    pub seen: Arc<Seen>,
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

/// Reads a capture once and tells what its lidars saw in one window after the other.
#[pyclass(module = "lidar_deflect._native")]
pub struct BeamFeed {
    feed: Feed,
    reader: SweepReader,
    gather: Gather,
    lidars: Vec<usize>,
    has_ended: bool,
}

#[pymethods]
impl BeamFeed {
    /// For lidars (numbers in the scan) with poses (lidars, 4, 4), inside of a box (2, 3), in windows
    /// in the order of their starts. `moves`: lidar, when it left its place, since when it has its next
    /// one, that pose (4 x 4); what is seen from there goes by number of the move behind the lidars.
    #[new]
    #[pyo3(signature = (
        scan, *, lidars, poses, cut_azimuth_deg, box_m, windows_ns, moves=Vec::new()
    ))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        py: Python<'_>,
        scan: &CaptureScan,
        lidars: Vec<usize>,
        poses: PyReadonlyArray3<'_, f64>,
        cut_azimuth_deg: Vec<f64>,
        box_m: PyReadonlyArray2<'_, f64>,
        windows_ns: Vec<(i64, i64)>,
        moves: Vec<arrays::MoveRow>,
    ) -> BorderResult<Self> {
        let corners = arrays::points("box_m", &box_m)?;
        arrays::expect_rows("box_m", corners.len(), 2)?;
        let matrices = arrays::matrices("poses", &poses, lidars.len())?;
        let poses: Result<Vec<_>, _> = matrices.iter().map(WorldFromSensor::from_matrix).collect();
        let stands = Stands::of(&poses?, &arrays::moves(&moves)?)?;
        let pass = PassThrough::new(corners[0], corners[1])?;
        let cuts_rad: Vec<f64> = cut_azimuth_deg.into_iter().map(f64::to_radians).collect();
        let options = SweepOptions {
            start: windows_ns.iter().map(|w| Timestamp(w.0)).min(),
            stop: windows_ns.iter().map(|w| Timestamp(w.1)).max(),
            ..SweepOptions::of(&lidars, &cuts_rad)
                .towards(&lidars, stands.iter().map(|own| pass.bearings(own)))
        };
        Ok(Self {
            feed: Feed::open(py, &scan.paths)?,
            reader: SweepReader::new(&scan.report, &options)?,
            gather: Gather::new(stands, pass, &windows_ns),
            lidars,
            has_ended: false,
        })
    }

    /// What was seen in the next `count` windows; fewer at the end.
    #[pyo3(signature = (count, progress=None))]
    fn take(
        &mut self,
        py: Python<'_>,
        count: usize,
        progress: Option<Py<PyAny>>,
    ) -> BorderResult<Vec<BeamSeen>> {
        let mut windows = Vec::with_capacity(count);
        loop {
            while windows.len() < count
                && let Some(seen) = self.gather.pop()
            {
                windows.push(BeamSeen {
                    seen: Arc::new(seen),
                });
            }
            if windows.len() == count || self.has_ended {
                return Ok(windows);
            }
            self.read_on(py, progress.as_ref())?;
        }
    }
}

impl BeamFeed {
    fn read_on(&mut self, py: Python<'_>, progress: Option<&Py<PyAny>>) -> BorderResult<()> {
        let Self {
            feed,
            reader,
            gather,
            lidars,
            ..
        } = self;
        let more = feed.block(py, progress, |datagram| {
            reader.push(datagram);
            hand_over(reader, gather, lidars);
            if reader.is_done() {
                Want::Stop
            } else {
                Want::More
            }
        })?;
        if !more || reader.is_done() {
            py.detach(|| {
                reader.finish();
                hand_over(reader, gather, lidars);
                gather.finish();
            });
            self.has_ended = true;
        }
        Ok(())
    }
}

fn hand_over(reader: &mut SweepReader, gather: &mut Gather, lidars: &[usize]) {
    while let Some(mut sweep) = reader.pop() {
        let number = sweep.lidar;
        if let Some(place) = lidars.iter().position(|lidar| *lidar == number) {
            sweep.lidar = place;
            gather.push(&sweep);
        }
        reader.recycle(number, sweep.cloud);
    }
}
