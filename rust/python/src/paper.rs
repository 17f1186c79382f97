//! The paper's two passes over a capture, in blocks of frames.

mod feed;
mod near;
mod params;
mod steps;
mod watched;

use lidar_deflect_core::error::InvalidValue;
use lidar_deflect_core::paper::frames::Frame;
use lidar_deflect_core::paper::kept::KeptFrames;
use lidar_deflect_core::paper::series::{ContourSeries, DistanceRanges, Sampling};
use lidar_deflect_core::paper::tip::Plane;
use nalgebra::Point3;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::arrays;
use crate::compute::compute;
use crate::error::BorderResult;
use feed::FrameFeed;
pub use feed::FramePlan;
pub use params::FrameParams;

/// Memory that frames may fill between the passes: some minutes of a test.
const KEPT_BYTES: usize = 64 << 20;

/// Adds this file's classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<FramePlan>()?;
    module.add_class::<FrameParams>()?;
    module.add_class::<DistancePass>()?;
    module.add_class::<watched::WatchedPass>()?;
    module.add_class::<ContourPass>()?;
    near::register(module)?;
    steps::register(module)
}

/// First pass: how far the blade is from each lidar over the whole test.
#[pyclass(module = "lidar_deflect._native")]
pub struct DistancePass {
    feed: Option<FrameFeed>, // none where the frames come from elsewhere
    sensors_m: Vec<Point3<f64>>,
    ranges: DistanceRanges,
    kept: KeptFrames,
}

#[pymethods]
impl DistancePass {
    #[new]
    fn new(py: Python<'_>, plan: &FramePlan) -> BorderResult<Self> {
        Ok(Self {
            feed: Some(FrameFeed::open(py, plan)?),
            ..Self::fed(plan)
        })
    }

    /// Works through the next frames; False when there are no more.
    #[pyo3(signature = (count, threads=None, progress=None))]
    fn advance(
        &mut self,
        py: Python<'_>,
        count: usize,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> BorderResult<bool> {
        let Some(feed) = &mut self.feed else {
            return Ok(false);
        };
        let frames = feed.frames(py, count, threads, progress.as_ref())?;
        let more = !frames.is_empty();
        self.take(frames);
        Ok(more)
    }

    /// Smallest and largest distance of each lidar, (lidars, 2), metres; NaN without any.
    fn ranges_m<'py>(&self, py: Python<'py>) -> BorderResult<Bound<'py, PyArray2<f64>>> {
        let ranges = self
            .ranges
            .ranges_m()
            .iter()
            .map(|range| range.unwrap_or([f64::NAN; 2]));
        Ok(arrays::rows(py, ranges.collect())?)
    }
}

impl DistancePass {
    /// To be fed with the frames of a plan.
    fn fed(plan: &FramePlan) -> Self {
        let sensors_m = plan.sensors_m();
        Self {
            feed: None,
            ranges: DistanceRanges::new(sensors_m.len()),
            sensors_m,
            kept: KeptFrames::new(KEPT_BYTES),
        }
    }

    fn take(&mut self, frames: Vec<Frame>) {
        self.ranges.extend(&frames, &self.sensors_m);
        self.kept.extend(frames);
    }
}

/// Second pass: contour curves of every frame.
#[pyclass(module = "lidar_deflect._native")]
pub struct ContourPass {
    kept: KeptFrames,
    feed: Option<FrameFeed>, // none where the first pass kept all frames
    lidars: usize,
    series: ContourSeries,
}

#[pymethods]
impl ContourPass {
    #[new]
    /// Takes over the frames that the first pass of the same plan kept.
    #[pyo3(signature = (plan, params, first_pass, *, sample_every, sample_points))]
    fn new(
        py: Python<'_>,
        plan: &FramePlan,
        params: &FrameParams,
        first_pass: &mut DistancePass,
        sample_every: usize,
        sample_points: usize,
    ) -> BorderResult<Self> {
        let sampling = Sampling {
            every: sample_every,
            points: sample_points,
        };
        let series = ContourSeries::new(params.core(plan.sensors_m()), sampling);
        let kept = std::mem::replace(&mut first_pass.kept, KeptFrames::new(0));
        let open = |first| FrameFeed::open_from(py, plan, first);
        Ok(Self {
            feed: kept.next().map(open).transpose()?,
            kept,
            lidars: plan.sensors_m().len(),
            series,
        })
    }

    /// Works through the next frames; False when there are no more.
    #[pyo3(signature = (count, threads=None, progress=None))]
    fn advance(
        &mut self,
        py: Python<'_>,
        count: usize,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> BorderResult<bool> {
        let mut frames = self.kept.take(count);
        if let Some(feed) = self.feed.as_mut().filter(|_| frames.is_empty()) {
            frames = feed.frames(py, count, threads, progress.as_ref())?;
        }
        let series = &mut self.series;
        compute(py, threads, || series.extend(&frames))?;
        Ok(!frames.is_empty())
    }

    /// Middles of the frames, (t,), nanoseconds.
    fn time_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let times: Vec<i64> = self
            .series
            .frames()
            .iter()
            .map(|frame| frame.time.0)
            .collect();
        times.into_pyarray(py)
    }

    /// Present, lost, overhead and used of every lidar, each (t, lidars).
    #[allow(clippy::type_complexity)] // the four columns that Python unpacks
    fn uses<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyArray2<bool>>,
        Bound<'py, PyArray2<bool>>,
        Bound<'py, PyArray2<bool>>,
        Bound<'py, PyArray2<u32>>,
    )> {
        let lidars = self.lidars;
        Ok((
            arrays::table(py, self.series.uses(|used| used.present), lidars)?,
            arrays::table(py, self.series.uses(|used| used.lost), lidars)?,
            arrays::table(py, self.series.uses(|used| used.overhead), lidars)?,
            arrays::table(py, self.series.uses(|used| used.used), lidars)?,
        ))
    }

    /// What keeps each frame from a tip on a plane, None where nothing does.
    fn failures(&self, plane: &str) -> BorderResult<Vec<Option<&'static str>>> {
        Ok(self.series.failures(plane_named(plane)?))
    }

    /// First and last z of the contours, (t, 2), metres; NaN without contours.
    fn seen_z_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::rows(py, self.series.seen_z_m())
    }

    /// z of the tip, (t,), metres; NaN where there is none.
    fn tip_z_m<'py>(
        &self,
        py: Python<'py>,
        plane: &str,
    ) -> BorderResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.series.tip_z_m(plane_named(plane)?).into_pyarray(py))
    }

    /// Arc length from each z to the tip, (t, len(z)), metres.
    fn arc_to_tip_m<'py>(
        &self,
        py: Python<'py>,
        plane: &str,
        z_m: PyReadonlyArray1<'py, f64>,
    ) -> BorderResult<Bound<'py, PyArray2<f64>>> {
        let (plane, places) = (plane_named(plane)?, arrays::values("z_m", &z_m)?);
        let lengths = compute(py, None, || self.series.arc_to_tip_m(plane, places))?;
        Ok(arrays::table(py, lengths, places.len())?)
    }

    /// Points so far before the tip, `(t, len(to_tip), 3)`, metres.
    fn sections_m<'py>(
        &self,
        py: Python<'py>,
        plane: &str,
        to_tip_m: PyReadonlyArray1<'py, f64>,
    ) -> BorderResult<Bound<'py, PyArray3<f64>>> {
        let (plane, lengths) = (plane_named(plane)?, arrays::values("to_tip_m", &to_tip_m)?);
        let points = compute(py, None, || self.series.sections_m(plane, lengths))?;
        Ok(arrays::tables(py, points, lengths.len())?)
    }

    /// Points of the mid-chord line at each z, (t, len(z), 3), metres.
    fn points_at_m<'py>(
        &self,
        py: Python<'py>,
        z_m: PyReadonlyArray1<'py, f64>,
    ) -> BorderResult<Bound<'py, PyArray3<f64>>> {
        let places = arrays::values("z_m", &z_m)?;
        Ok(arrays::tables(
            py,
            self.series.points_at_m(places),
            places.len(),
        )?)
    }

    /// Leading minus trailing edge at each z, (t, len(z), 3), metres.
    fn chords_at_m<'py>(
        &self,
        py: Python<'py>,
        z_m: PyReadonlyArray1<'py, f64>,
    ) -> BorderResult<Bound<'py, PyArray3<f64>>> {
        let places = arrays::values("z_m", &z_m)?;
        Ok(arrays::tables(
            py,
            self.series.chords_at_m(places),
            places.len(),
        )?)
    }

    /// Time, lidar, ring and place of the blade points that were kept.
    #[allow(clippy::type_complexity)] // the four columns that Python unpacks
    fn sampled_points<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray1<u32>>,
        Bound<'py, PyArray1<u32>>,
        Bound<'py, PyArray2<f32>>,
    )> {
        let points = self.series.sampled_points();
        Ok((
            points.time_ns.into_pyarray(py),
            points.lidar.into_pyarray(py),
            points.ring.into_pyarray(py),
            arrays::rows(py, points.xyz_m)?,
        ))
    }

    /// Time, reason, count and place of the contour samples that were left out.
    #[allow(clippy::type_complexity)] // the four columns that Python unpacks
    fn rejected<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyArray1<i64>>,
        Vec<&'static str>,
        Bound<'py, PyArray1<u32>>,
        Bound<'py, PyArray2<f64>>,
    )> {
        let left_out = self.series.left_out();
        Ok((
            left_out.time_ns.into_pyarray(py),
            left_out.reason,
            left_out.count.into_pyarray(py),
            arrays::rows(py, left_out.centre_m)?,
        ))
    }
}

fn plane_named(name: &str) -> Result<Plane, InvalidValue> {
    match name {
        "xoz" => Ok(Plane::Xoz),
        "yoz" => Ok(Plane::Yoz),
        _ => Err(InvalidValue {
            name: "plane",
            expected: "xoz or yoz".into(),
            found: name.into(),
        }),
    }
}
