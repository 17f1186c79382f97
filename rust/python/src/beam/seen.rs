//! Holds out of a capture: scan lines inside a box, with their ends.

use std::sync::Arc;

use lidar_deflect_core::beam::echoes::Seen;
use lidar_deflect_core::beam::gather::{Gather, GatherPlan};
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::stand::Stands;
use numpy::{PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays;
use crate::capture::CaptureScan;
use crate::capture::reading::ReadingFeed;
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
    feed: ReadingFeed<Gather>,
    threads: Option<usize>,
}

#[pymethods]
impl BeamFeed {
    /// For lidars (numbers in the scan) with poses (lidars, 4, 4), inside of a box (2, 3), in windows
    /// in the order of their starts. `moves`: lidar, when it left its place, since when it has its next
    /// one, that pose (4 x 4); what is seen from there goes by number of the move behind the lidars.
    #[new]
    #[pyo3(signature = (
        scan, *, lidars, poses, cut_azimuth_deg, box_m, windows_ns, moves=Vec::new(), threads=None
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
        threads: Option<usize>,
    ) -> BorderResult<Self> {
        let corners = arrays::points("box_m", &box_m)?;
        arrays::expect_rows("box_m", corners.len(), 2)?;
        let matrices = arrays::matrices("poses", &poses, lidars.len())?;
        let poses: Result<Vec<_>, _> = matrices.iter().map(WorldFromSensor::from_matrix).collect();
        arrays::expect_rows("cut_azimuth_deg", cut_azimuth_deg.len(), lidars.len())?;
        let cuts_rad: Vec<f64> = cut_azimuth_deg.into_iter().map(f64::to_radians).collect();
        let plan = GatherPlan {
            lidars: &lidars,
            cuts_rad: &cuts_rad,
            stands: Stands::of(&poses?, &arrays::moves(&moves)?)?,
            pass: PassThrough::new(corners[0], corners[1])?,
        };
        let gather = Gather::new(&scan.report, plan, &windows_ns)?;
        Ok(Self {
            feed: ReadingFeed::open(py, &scan.paths, gather)?,
            threads,
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
                && let Some(seen) = self.feed.reading.pop()
            {
                windows.push(BeamSeen {
                    seen: Arc::new(seen),
                });
            }
            if windows.len() == count || self.feed.has_ended() {
                return Ok(windows);
            }
            self.feed.read_on(py, self.threads, progress.as_ref())?;
        }
    }
}
