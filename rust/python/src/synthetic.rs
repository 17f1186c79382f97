//! The simulator: a scene as a dictionary in, a capture and truth out.

mod given;

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use lidar_deflect_core::capture::PcapWriter;
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::packet::writer::WRITERS;
use lidar_deflect_core::synthetic::Simulation;
use lidar_deflect_core::synthetic::contour::CONTOUR_POINTS;
use lidar_deflect_core::synthetic::lidar::Lidar;
use lidar_deflect_core::synthetic::reference;
use lidar_deflect_core::synthetic::truth::SectionTruth;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::compute::compute;
use crate::error::BorderResult;
use given::SceneIn;

/// Adds this file's classes and functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(reference_blades, module)?)?;
    module.add_function(wrap_pyfunction!(simulated_sensors, module)?)?;
    module.add_class::<PySimulation>()
}

/// Names of the reference blades.
#[pyfunction]
fn reference_blades() -> Vec<&'static str> {
    reference::names().collect()
}

/// Ids of the sensors that can be simulated.
#[pyfunction]
fn simulated_sensors() -> Vec<&'static str> {
    WRITERS.iter().map(|writer| writer.id()).collect()
}

/// Id of the model that reads a sensor's packets, and the files that describe the unit.
type UnitOut = (&'static str, Vec<(String, Vec<u8>)>);

/// A simulated test under way; writes its capture as it goes.
#[pyclass(name = "Simulation", module = "lidar_deflect._native")]
struct PySimulation {
    simulation: Simulation,
    writer: Option<PcapWriter<BufWriter<File>>>,
}

#[pymethods]
impl PySimulation {
    /// Builds and bends the blade of a scene given as nested dictionaries in SI units.
    #[new]
    fn new(py: Python<'_>, scene: SceneIn) -> BorderResult<Self> {
        let plan = scene.plan()?;
        let simulation = py.detach(|| Simulation::new(plan))?;
        Ok(Self {
            simulation,
            writer: None,
        })
    }

    /// Scene time from start to end, seconds.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.simulation.duration_ns() as f64 * 1e-9
    }

    /// Scene time that is simulated, seconds.
    #[getter]
    fn done_s(&self) -> f64 {
        self.simulation.done_ns() as f64 * 1e-9
    }

    /// Begins the capture at `path`.
    fn create(&mut self, path: PathBuf) -> PyResult<()> {
        let file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        self.writer = Some(PcapWriter::new(file)?);
        Ok(())
    }

    /// Simulates and writes a quarter of a second; false when all is written.
    #[pyo3(signature = (*, threads))]
    fn advance(&mut self, py: Python<'_>, threads: Option<usize>) -> BorderResult<bool> {
        let Self { simulation, writer } = self;
        let Some(writer) = writer.as_mut() else {
            return Err(PyValueError::new_err("create() comes before advance()").into());
        };
        let step = || -> std::io::Result<bool> {
            let goes_on = simulation.advance(writer)?;
            if !goes_on {
                writer.flush()?;
            }
            Ok(goes_on)
        };
        Ok(compute(py, threads, step)?.map_err(PyErr::from)?)
    }

    /// Packets sent and lost of each lidar.
    fn packets(&self) -> Vec<(u32, u32)> {
        self.simulation.packets()
    }

    /// `world_from_sensor` of each lidar, 4 x 4 row by row.
    fn poses(&self) -> Vec<[[f64; 4]; 4]> {
        let matrix = |lidar: &Lidar| lidar.world_from_sensor.to_matrix().transpose().into();
        self.simulation.lidars.iter().map(matrix).collect()
    }

    /// `world_from_sensor` of each lidar at the end, 4 x 4 row by row.
    fn last_poses(&self) -> Vec<[[f64; 4]; 4]> {
        let end_ns = self.simulation.duration_ns() as f64;
        let matrix = |lidar: &Lidar| {
            let (rotation, position_m) = lidar.pose(end_ns);
            let pose = WorldFromSensor::new(rotation, position_m);
            pose.to_matrix().transpose().into()
        };
        self.simulation.lidars.iter().map(matrix).collect()
    }

    /// Range offset of each lidar by ring, metres: what is added to the true range.
    fn range_offsets_m(&self) -> Vec<Vec<f64>> {
        let lidars = self.simulation.lidars.iter();
        lidars.map(|lidar| lidar.range_offset_m.clone()).collect()
    }

    /// Of each lidar the id of the model that reads it, and the files that describe the unit.
    fn units(&self) -> Vec<UnitOut> {
        let unit = |lidar: &Lidar| {
            let writer = lidar.plan.sensor.writer;
            let files = writer.files().into_iter();
            let files = files.map(|file| (file.name, file.content)).collect();
            (writer.model().id(), files)
        };
        self.simulation.lidars.iter().map(unit).collect()
    }

    /// x of the wall at places (y, z), metres; none where there is no wall.
    fn wall_m(&self, places: Vec<(f64, f64)>) -> Vec<f64> {
        let wall = self.simulation.terrain.wall.iter();
        wall.flat_map(|wall| places.iter().map(|(y, z)| wall.at(*y, *z)))
            .collect()
    }

    /// Truth at scene times: (times, sections, 13) with middle, leading edge, trailing edge, chord
    /// direction and twist (rad).
    #[pyo3(signature = (sections_m, times_s, *, threads))]
    fn truth<'py>(
        &self,
        py: Python<'py>,
        sections_m: Vec<f64>,
        times_s: PyReadonlyArray1<'py, f64>,
        threads: Option<usize>,
    ) -> BorderResult<Bound<'py, PyArray3<f64>>> {
        let times = arrays::column("times_s", &times_s, times_s.len())?;
        let rows = compute(py, threads, || self.simulation.truth(&sections_m, times))?;
        let flat: Vec<f64> = rows.iter().flatten().flat_map(SectionTruth::row).collect();
        Ok(flat
            .into_pyarray(py)
            .reshape([times.len(), sections_m.len(), 13])?)
    }

    /// Share of full load at scene times.
    fn load<'py>(
        &self,
        py: Python<'py>,
        times_s: PyReadonlyArray1<'py, f64>,
    ) -> BorderResult<Bound<'py, PyArray1<f64>>> {
        let times = arrays::column("times_s", &times_s, times_s.len())?.iter();
        let shares: Vec<f64> = times.map(|time| self.simulation.share(*time)).collect();
        Ok(shares.into_pyarray(py))
    }

    /// Height of the ground at places (x, z), metres.
    fn ground_m(&self, places: Vec<(f64, f64)>) -> Vec<f64> {
        let height = |(x, z)| self.simulation.terrain.ground.height_m(x, z);
        places.into_iter().map(height).collect()
    }

    /// The drawing: columns by station.
    fn nominal<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let nominal = &self.simulation.blade.nominal;
        let columns = PyDict::new(py);
        for (name, values) in [
            ("s_m", &nominal.s_m),
            ("chord_m", &nominal.chord_m),
            ("twist_rad", &nominal.twist_rad),
            ("rel_thickness", &nominal.rel_thickness),
            ("prebend_m", &nominal.prebend_m),
            ("axis_fraction", &nominal.axis_fraction),
            ("ei_edge_nm2", &nominal.ei_edge_nm2),
            ("ei_flap_nm2", &nominal.ei_flap_nm2),
            ("gj_nm2", &nominal.gj_nm2),
        ] {
            columns.set_item(name, values.clone().into_pyarray(py))?;
        }
        Ok(columns)
    }

    /// Contours as drawn: (stations * points, 3) with arc length, `x_c` and `y_c`.
    fn contours<'py>(&self, py: Python<'py>) -> BorderResult<Bound<'py, PyArray2<f64>>> {
        let blade = &self.simulation.blade;
        let stations = &blade.nominal.s_m;
        let rows = stations
            .iter()
            .flat_map(|s| blade.nominal_contour(*s).map(|[x, y]| [*s, x, y]));
        let flat: Vec<f64> = rows.flatten().collect();
        Ok(flat
            .into_pyarray(py)
            .reshape([stations.len() * CONTOUR_POINTS, 3])?)
    }
}
