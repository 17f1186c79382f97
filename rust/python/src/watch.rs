//! Static surfaces watched: cells of echoes, sums over them, and windows of a capture.

mod adjust;

use lidar_deflect_core::stream::{Beside, ScanReport, SweepOptions};
use lidar_deflect_core::time::Timestamp;
use lidar_deflect_core::watch::{
    self, CellGrid, Heights, Reference, SeenPlane, Window, WindowTaker,
};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays;
use crate::capture::CaptureScan;
use crate::capture::reading::ReadingFeed;
use crate::error::BorderResult;

/// Adds this file's functions and classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<CellPass>()?;
    module.add_function(wrap_pyfunction!(echo_cells, module)?)?;
    module.add_function(wrap_pyfunction!(cell_positions, module)?)?;
    module.add_function(wrap_pyfunction!(cell_heights, module)?)?;
    adjust::register(module)
}

/// Step of azimuth in degrees, steps to a turn, last beam with cells of its own.
pub type GridRow = (f32, u32, u16);

pub fn grid_of((step_deg, steps, last_ring): GridRow) -> CellGrid {
    CellGrid {
        step_deg,
        steps: steps.max(1),
        last_ring,
    }
}

/// Cell of every echo, (n,), from its beam and azimuth.
#[pyfunction]
fn echo_cells<'py>(
    py: Python<'py>,
    ring: PyReadonlyArray1<'py, u16>,
    azimuth_deg: PyReadonlyArray1<'py, f32>,
    grid: GridRow,
) -> BorderResult<Bound<'py, PyArray1<u32>>> {
    let ring = arrays::values("ring", &ring)?;
    let azimuth_deg = arrays::column("azimuth_deg", &azimuth_deg, ring.len())?;
    let grid = grid_of(grid);
    let cells = py.detach(|| grid.cells(ring, azimuth_deg));
    Ok(cells.into_pyarray(py))
}

/// Numbers of echoes, and sums over them.
type CellSums<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>);

/// Numbers of echoes by cell, (size,), and sums of their places, (3, size).
#[pyfunction]
fn cell_positions<'py>(
    py: Python<'py>,
    cells: PyReadonlyArray1<'py, u32>,
    xyz: PyReadonlyArray2<'py, f32>,
    size: usize,
) -> BorderResult<CellSums<'py>> {
    let cells = arrays::values("cells", &cells)?;
    let xyz = arrays::points("xyz", &xyz)?;
    arrays::expect_rows("xyz", xyz.len(), cells.len())?;
    let (count, sums) = py.detach(|| watch::positions(cells, xyz, size));
    let sums = arrays::table(py, sums.concat(), size)?;
    Ok((count.into_pyarray(py), sums))
}

/// Numbers, sums and squares, each (cells,), of heights above the reference of echoes within the gate.
///
/// `plane`, `height_m` and `gate_m` go by cell; `along` (planes, 3), sensor axes, and `beneath_m` by plane.
#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)] // columns
fn cell_heights<'py>(
    py: Python<'py>,
    cells: PyReadonlyArray1<'py, u32>,
    xyz: PyReadonlyArray2<'py, f32>,
    plane: PyReadonlyArray1<'py, i64>,
    height_m: PyReadonlyArray1<'py, f64>,
    gate_m: PyReadonlyArray1<'py, f64>,
    along: PyReadonlyArray2<'py, f64>,
    beneath_m: PyReadonlyArray1<'py, f64>,
) -> BorderResult<(
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
)> {
    let cells = arrays::values("cells", &cells)?;
    let xyz = arrays::points("xyz", &xyz)?;
    arrays::expect_rows("xyz", xyz.len(), cells.len())?;
    let plane = arrays::values("plane", &plane)?;
    let along = arrays::points("along", &along)?;
    let beneath_m = arrays::column("beneath_m", &beneath_m, along.len())?.iter();
    let seen = |(along, beneath_m): (&[f64; 3], &f64)| SeenPlane {
        along: *along,
        beneath_m: *beneath_m,
    };
    let planes: Vec<SeenPlane> = along.iter().zip(beneath_m).map(seen).collect();
    let reference = Reference {
        plane,
        height_m: arrays::column("height_m", &height_m, plane.len())?,
        gate_m: arrays::column("gate_m", &gate_m, plane.len())?,
    };
    let found = py.detach(|| watch::heights(cells, xyz, &reference, &planes));
    let Heights {
        count,
        sum_m,
        squares_m2,
    } = found;
    Ok((
        count.into_pyarray(py),
        sum_m.into_pyarray(py),
        squares_m2.into_pyarray(py),
    ))
}

/// Which windows of which cells are gathered.
pub struct Windows {
    /// How echoes fall into cells.
    pub grid: CellGrid,
    /// Packets from here on.
    pub start_ns: i64,
    /// Packets before this.
    pub stop_ns: i64,
    /// Length of a window.
    pub window_ns: i64,
}

impl Windows {
    /// What each lidar is asked for, and what takes it: one turn in `every`, the cells that are watched.
    pub fn takers(
        &self,
        report: &ScanReport,
        lidars: &[usize],
        every: &[u32],
        watched: &[PyReadonlyArray1<'_, bool>],
    ) -> BorderResult<Vec<(SweepOptions, WindowTaker)>> {
        arrays::expect_rows("every", every.len(), lidars.len())?;
        arrays::expect_rows("watched", watched.len(), lidars.len())?;
        let lidars = lidars.iter().zip(every).zip(watched);
        let takers = lidars.map(|((number, every), watched)| {
            let watched = arrays::values("watched", watched)?.to_vec();
            let info = report.lidars.get(*number);
            let points = info.map_or(0.0, |info| info.points_within(self.window_ns));
            let usual = (points / f64::from((*every).max(1))) as usize;
            let (grid, start_ns) = (self.grid, self.start_ns);
            let taker = WindowTaker::new(grid, watched, start_ns, self.window_ns, usual);
            Ok((self.options(*number, *every), taker))
        });
        takers.collect()
    }

    /// For a lidar that is not watched: as little as can be.
    pub fn idle(&self, lidar: usize) -> (SweepOptions, WindowTaker) {
        (self.options(lidar, u32::MAX), WindowTaker::idle(self.grid))
    }

    fn options(&self, lidar: usize, every: u32) -> SweepOptions {
        SweepOptions {
            start: Some(Timestamp(self.start_ns)),
            stop: Some(Timestamp(self.stop_ns)),
            ..SweepOptions::of(&[lidar], &[0.0]).one_in(every)
        }
    }
}

/// Reads a capture and gives the echoes on watched cells, window by window.
#[pyclass(module = "lidar_deflect._native")]
pub struct CellPass {
    feed: ReadingFeed<Beside<WindowTaker>>,
}

/// Place of the lidar, cells, places of the echoes, start and end.
pub type WindowRow<'py> = (
    usize,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray2<f32>>,
    i64,
    i64,
);

#[pymethods]
impl CellPass {
    /// Lidars by number, of each one turn in `every` and the cells that are watched; packets in
    /// [`start_ns`, `stop_ns`), windows of `window_ns` from `start_ns` on.
    #[new]
    #[pyo3(signature = (scan, *, lidars, every, watched, grid, start_ns, stop_ns, window_ns))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        py: Python<'_>,
        scan: &CaptureScan,
        lidars: Vec<usize>,
        every: Vec<u32>,
        watched: Vec<PyReadonlyArray1<'_, bool>>,
        grid: GridRow,
        start_ns: i64,
        stop_ns: i64,
        window_ns: i64,
    ) -> BorderResult<Self> {
        let windows = Windows {
            grid: grid_of(grid),
            start_ns,
            stop_ns,
            window_ns,
        };
        let takers = windows.takers(&scan.report, &lidars, &every, &watched)?;
        let beside = Beside::new(&scan.report, takers)?;
        Ok(Self {
            feed: ReadingFeed::open(py, &scan.paths, beside)?,
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
        let takers = self.feed.reading.takers().enumerate();
        Ok(Some(ready(py, takers, is_last)?))
    }
}

/// The windows that are over of lidars by their places.
pub fn ready<'py, 'a>(
    py: Python<'py>,
    takers: impl Iterator<Item = (usize, &'a mut WindowTaker)>,
    is_last: bool,
) -> PyResult<Vec<WindowRow<'py>>> {
    takers
        .flat_map(|(place, taker)| {
            taker
                .ready(is_last)
                .into_iter()
                .map(move |own| (place, own))
        })
        .map(|(place, window)| row(py, place, window))
        .collect()
}

/// One window as Python gets it.
fn row(py: Python<'_>, place: usize, window: Window) -> PyResult<WindowRow<'_>> {
    let cells = window.cell.into_pyarray(py);
    let xyz = arrays::rows(py, window.xyz_m)?;
    Ok((place, cells, xyz, window.from_ns, window.to_ns))
}
