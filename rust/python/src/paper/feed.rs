//! Frames out of a capture: files, sweeps and the assembler in one line.

use std::path::PathBuf;
use std::sync::Arc;

use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::frames::{Frame, FrameAssembler};
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::stream::{ScanReport, SweepOptions, SweepReader};
use lidar_deflect_core::time::Timestamp;
use nalgebra::{Matrix4, Point3};
use numpy::{PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays;
use crate::capture::CaptureScan;
use crate::capture::feed::{Feed, Want};
use crate::error::BorderResult;

/// Which frames to make of which capture.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct FramePlan {
    paths: Vec<PathBuf>,
    report: Arc<ScanReport>,
    options: SweepOptions,
    /// Numbers of the lidars within the scan, in the order of the shares.
    lidars: Vec<usize>,
    poses: Vec<WorldFromSensor>,
    pass: PassThrough,
    first: Timestamp,
    period_ns: i64,
}

#[pymethods]
impl FramePlan {
    /// Frames at `first_ns` and every `period_ns` from it, of lidars by their numbers in the scan,
    /// with poses (lidars, 4, 4) and box (2, 3), from packets in [`start_ns`, `stop_ns`).
    #[new]
    #[pyo3(signature = (
        scan, *, lidars, poses, cut_azimuth_deg, box_m, first_ns, period_ns, start_ns, stop_ns
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
    ) -> BorderResult<Self> {
        let corners = arrays::points("box_m", &box_m)?;
        arrays::expect_rows("box_m", corners.len(), 2)?;
        let poses = arrays::matrices("poses", &poses, lidars.len())?;
        let pose = |matrix: &Matrix4<f64>| WorldFromSensor::from_matrix(matrix);
        Ok(Self {
            paths: scan.paths.clone(),
            report: Arc::clone(&scan.report),
            options: SweepOptions {
                lidars: Some(lidars.clone()),
                cut_azimuth_rad: cuts(&lidars, &cut_azimuth_deg),
                start: Some(Timestamp(start_ns)),
                stop: Some(Timestamp(stop_ns)),
            },
            poses: poses.iter().map(pose).collect::<Result<_, _>>()?,
            lidars,
            pass: PassThrough::new(corners[0], corners[1])?,
            first: Timestamp(first_ns),
            period_ns,
        })
    }
}

impl FramePlan {
    /// Optical centres, metres, world frame.
    pub fn sensors_m(&self) -> Vec<Point3<f64>> {
        self.poses
            .iter()
            .map(|pose| pose.translation_m().into())
            .collect()
    }
}

/// Cut azimuths by number of the lidar, as the reader wants them.
pub fn cuts(lidars: &[usize], degrees: &[f64]) -> Vec<f64> {
    let mut by_number = vec![0.0; lidars.iter().max().map_or(0, |last| last + 1)];
    for (number, cut) in lidars.iter().zip(degrees) {
        by_number[*number] = cut.to_radians();
    }
    by_number
}

/// A capture on its way through reader and assembler.
pub struct FrameFeed {
    feed: Feed,
    reader: SweepReader,
    assembler: FrameAssembler,
    /// Place of each lidar's share, by its number within the scan.
    place: Vec<Option<usize>>,
    sensors_m: Vec<Point3<f64>>,
    ended: bool,
}

impl FrameFeed {
    /// Opens the files of a plan.
    pub fn open(py: Python<'_>, plan: &FramePlan) -> BorderResult<Self> {
        let assembler =
            FrameAssembler::new(plan.poses.clone(), plan.pass, plan.first, plan.period_ns)?;
        let mut place = vec![None; plan.report.lidars.len()];
        for (index, number) in plan.lidars.iter().enumerate() {
            place[*number] = Some(index);
        }
        Ok(Self {
            feed: Feed::open(py, &plan.paths)?,
            reader: SweepReader::new(&plan.report, &plan.options)?,
            assembler,
            place,
            sensors_m: plan.sensors_m(),
            ended: false,
        })
    }

    /// Optical centres of the lidars, metres, world frame.
    pub fn sensors_m(&self) -> &[Point3<f64>] {
        &self.sensors_m
    }

    /// The next `count` frames, fewer at the end, none after it.
    pub fn frames(
        &mut self,
        py: Python<'_>,
        count: usize,
        progress: Option<&Py<PyAny>>,
    ) -> BorderResult<Vec<Frame>> {
        let mut frames = Vec::with_capacity(count);
        loop {
            while frames.len() < count
                && let Some(frame) = self.assembler.pop()
            {
                frames.push(frame);
            }
            if frames.len() == count || self.ended {
                return Ok(frames);
            }
            self.read_on(py, progress)?;
        }
    }

    fn read_on(&mut self, py: Python<'_>, progress: Option<&Py<PyAny>>) -> BorderResult<()> {
        let Self {
            feed,
            reader,
            assembler,
            place,
            ..
        } = self;
        let more = feed.block(py, progress, |datagram| {
            reader.push(datagram);
            let taken = take(reader, assembler, place);
            match (reader.is_done(), taken) {
                (true, _) => Want::Stop,
                (false, true) => Want::Pause,
                (false, false) => Want::More,
            }
        })?;
        if !more || reader.is_done() {
            py.detach(|| {
                reader.finish();
                take(reader, assembler, place);
                assembler.finish();
            });
            self.ended = true;
        }
        Ok(())
    }
}

/// Hands complete sweeps on; whether there were any.
fn take(reader: &mut SweepReader, assembler: &mut FrameAssembler, place: &[Option<usize>]) -> bool {
    let mut any = false;
    while let Some(mut sweep) = reader.pop() {
        let number = sweep.lidar;
        if let Some(index) = place.get(number).copied().flatten() {
            sweep.lidar = index;
            assembler.push(&sweep);
        }
        reader.recycle(number, sweep.cloud);
        any = true;
    }
    any
}
