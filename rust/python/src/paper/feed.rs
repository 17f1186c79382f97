//! Frames out of a capture: its files and the reader of frames, in batches.

use std::path::PathBuf;
use std::sync::Arc;

use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::frames::Frame;
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::paper::reader::{self, FrameReader};
use lidar_deflect_core::stream::ScanReport;
use lidar_deflect_core::time::Timestamp;
use nalgebra::{Matrix4, Point3};
use numpy::{PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays;
use crate::capture::CaptureScan;
use crate::capture::reading::ReadingFeed;
use crate::error::BorderResult;

/// Which frames to make of which capture.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct FramePlan {
    /// Files of the capture.
    pub paths: Vec<PathBuf>,
    /// What is known of it.
    pub report: Arc<ScanReport>,
    /// The frames.
    pub plan: reader::FramePlan,
}

#[pymethods]
impl FramePlan {
    /// Frames at `first_ns` and every `period_ns` from it, of lidars by their numbers in the scan,
    /// with poses (lidars, 4, 4) and box (2, 3), from packets in [`start_ns`, `stop_ns`).
    /// `moves`: lidar, when it left its place, since when it has its next one, that pose (4 x 4).
    #[new]
    #[pyo3(signature = (
        scan, *, lidars, poses, cut_azimuth_deg, box_m, first_ns, period_ns, start_ns, stop_ns,
        moves=Vec::new()
    ))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        scan: &CaptureScan,
        lidars: Vec<usize>,
        poses: PyReadonlyArray3<'_, f64>,
        cut_azimuth_deg: Vec<f64>,
        box_m: PyReadonlyArray2<'_, f64>,
        first_ns: i64,
        period_ns: i64,
        start_ns: i64,
        stop_ns: i64,
        moves: Vec<arrays::MoveRow>,
    ) -> BorderResult<Self> {
        let corners = arrays::points("box_m", &box_m)?;
        arrays::expect_rows("box_m", corners.len(), 2)?;
        let poses = arrays::matrices("poses", &poses, lidars.len())?;
        let pose = |matrix: &Matrix4<f64>| WorldFromSensor::from_matrix(matrix);
        let plan = reader::FramePlan {
            poses: poses.iter().map(pose).collect::<Result<_, _>>()?,
            moves: arrays::moves(&moves)?,
            lidars,
            cut_azimuth_rad: cut_azimuth_deg.into_iter().map(f64::to_radians).collect(),
            pass: PassThrough::new(corners[0], corners[1])?,
            first: Timestamp(first_ns),
            period_ns,
            start: Timestamp(start_ns),
            stop: Timestamp(stop_ns),
        };
        Ok(Self {
            paths: scan.paths.clone(),
            report: Arc::clone(&scan.report),
            plan,
        })
    }
}

impl FramePlan {
    /// Optical centres, metres, world frame.
    pub fn sensors_m(&self) -> Vec<Point3<f64>> {
        self.plan
            .poses
            .iter()
            .map(|pose| pose.translation_m().into())
            .collect()
    }
}

/// A capture on its way into frames.
pub struct FrameFeed(ReadingFeed<FrameReader>);

impl FrameFeed {
    /// Opens the files of a plan.
    pub fn open(py: Python<'_>, plan: &FramePlan) -> BorderResult<Self> {
        Self::of(py, plan, &plan.plan)
    }

    /// The same for the frames from `first` on.
    pub fn open_from(py: Python<'_>, plan: &FramePlan, first: Timestamp) -> BorderResult<Self> {
        Self::of(py, plan, &plan.plan.from(first))
    }

    fn of(py: Python<'_>, plan: &FramePlan, frames: &reader::FramePlan) -> BorderResult<Self> {
        let reader = FrameReader::new(&plan.report, frames)?;
        Ok(Self(ReadingFeed::open(py, &plan.paths, reader)?))
    }

    /// The next `count` frames, fewer at the end, none after it.
    pub fn frames(
        &mut self,
        py: Python<'_>,
        count: usize,
        threads: Option<usize>,
        progress: Option<&Py<PyAny>>,
    ) -> BorderResult<Vec<Frame>> {
        let mut frames = Vec::with_capacity(count);
        loop {
            while frames.len() < count
                && let Some(frame) = self.0.reading.pop()
            {
                frames.push(frame);
            }
            if frames.len() == count || self.0.has_ended() {
                return Ok(frames);
            }
            self.0.read_on(py, threads, progress)?;
        }
    }
}
