//! The paper's first pass, and beside it the windows in which tripods are watched: one reading for both.

use lidar_deflect_core::paper::reader::WatchedReader;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use super::{DistancePass, FramePlan};
use crate::capture::reading::ReadingFeed;
use crate::error::BorderResult;
use crate::watch::{GridRow, WindowRow, Windows, grid_of, ready};

/// Reads a capture into frames, and gives the echoes on watched cells, window by window.
#[pyclass(module = "lidar_deflect._native")]
pub struct WatchedPass {
    feed: ReadingFeed<WatchedReader>,
    /// Number of each lidar of the plan among those that are watched.
    places: Vec<Option<usize>>,
    /// Until it is asked for.
    survey: Option<DistancePass>,
}

#[pymethods]
impl WatchedPass {
    /// Frames as planned; `lidars` by number, of each one turn in `every` and the cells that are watched,
    /// windows of `window_ns` from the start of the plan on.
    #[new]
    #[pyo3(signature = (plan, *, lidars, every, watched, grid, window_ns))]
    fn new(
        py: Python<'_>,
        plan: &FramePlan,
        lidars: Vec<usize>,
        every: Vec<u32>,
        watched: Vec<PyReadonlyArray1<'_, bool>>,
        grid: GridRow,
        window_ns: i64,
    ) -> BorderResult<Self> {
        let windows = Windows {
            grid: grid_of(grid),
            start_ns: plan.plan.start.0,
            stop_ns: plan.plan.stop.0,
            window_ns,
        };
        let of = |lidar: &usize| lidars.iter().position(|watched| watched == lidar);
        let places: Vec<Option<usize>> = plan.plan.lidars.iter().map(of).collect();
        let taken = windows.takers(&plan.report, &lidars, &every, &watched)?;
        let mut taken: Vec<_> = taken.into_iter().map(Some).collect();
        let lidars = plan.plan.lidars.iter().zip(&places);
        let takers = lidars.map(|(lidar, place)| {
            let own = place.and_then(|place| taken[place].take());
            own.unwrap_or_else(|| windows.idle(*lidar))
        });
        let reader = WatchedReader::watched(&plan.report, &plan.plan, takers.collect())?;
        Ok(Self {
            feed: ReadingFeed::open(py, &plan.paths, reader)?,
            places,
            survey: Some(DistancePass::fed(plan)),
        })
    }

    /// The next windows that are over; None when there are no more.
    #[pyo3(signature = (threads=None, progress=None))]
    fn advance<'py>(
        &mut self,
        py: Python<'py>,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> BorderResult<Option<Vec<WindowRow<'py>>>> {
        if self.feed.has_ended() {
            return Ok(None);
        }
        self.feed.read_on(py, threads, progress.as_ref())?;
        let is_last = self.feed.has_ended();
        let reading = &mut self.feed.reading;
        let frames = std::iter::from_fn(|| reading.pop()).collect();
        if let Some(survey) = &mut self.survey {
            survey.take(frames);
        }
        let all = self.places.iter().zip(reading.windows());
        let takers = all.filter_map(|(place, taker)| place.map(|place| (place, taker)));
        Ok(Some(ready(py, takers, is_last)?))
    }

    /// The first pass over the frames so far; None where it was taken before.
    fn survey(&mut self) -> Option<DistancePass> {
        self.survey.take()
    }
}
