//! The simulator: a scene as a dictionary in, a capture and truth out.

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;
use std::sync::Arc;

use lidar_deflect_core::capture::PcapWriter;
use lidar_deflect_core::error::InvalidValue;
use lidar_deflect_core::synthetic::blade::{BuildErrors, Orientation};
use lidar_deflect_core::synthetic::contour::CONTOUR_POINTS;
use lidar_deflect_core::synthetic::echo::Optics;
use lidar_deflect_core::synthetic::lidar::{self, Clock, LidarPlan};
use lidar_deflect_core::synthetic::motion::{Schedule, Sway};
use lidar_deflect_core::synthetic::network::NetworkPlan;
use lidar_deflect_core::synthetic::plan::{self, SaddlePlan};
use lidar_deflect_core::synthetic::reference::{self, Stations};
use lidar_deflect_core::synthetic::sensor::Sensor;
use lidar_deflect_core::synthetic::terrain::{Crate, GroundPlan, Wall};
use lidar_deflect_core::synthetic::truth::SectionTruth;
use lidar_deflect_core::synthetic::{ScenePlan, Simulation};
use lidar_deflect_core::time::Timestamp;
use nalgebra::Vector3;
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

/// Adds this file's classes and functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(reference_blades, module)?)?;
    module.add_class::<PySimulation>()
}

/// Names of the reference blades.
#[pyfunction]
fn reference_blades() -> Vec<&'static str> {
    reference::names().collect()
}

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
        let matrix = |lidar: &lidar::Lidar| lidar.world_from_sensor.to_matrix().transpose().into();
        self.simulation.lidars.iter().map(matrix).collect()
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

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SceneIn {
    seed: u64,
    start_ns: i64,
    blade: BladeIn,
    direction: [f64; 3],
    follower: bool,
    saddles: Vec<SaddleIn>,
    show_saddles: bool,
    cable_radius_m: f64,
    levels: Vec<f64>,
    hold_s: f64,
    ramp_s: f64,
    sways: Vec<SwayIn>,
    root_turn_rad: [f64; 3],
    ground: GroundIn,
    wall: Option<WallIn>,
    boxes: Vec<BoxIn>,
    lidars: Vec<LidarIn>,
    optics: OpticsIn,
    network: NetworkIn,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct BladeIn {
    reference: String,
    length_m: Option<f64>,
    leading_edge: [f64; 3],
    suction_side: [f64; 3],
    chord_u: f64,
    setting_u_rad: f64,
    prebend_u: f64,
    stiffness_u: f64,
    waves_m: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SaddleIn {
    s_m: f64,
    force_n: f64,
    lever_m: [f64; 2],
    anchor_m: [f64; 3],
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SwayIn {
    direction: [f64; 3],
    order: u8,
    frequency_hz: f64,
    amplitude_m: f64,
    phase_rad: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct GroundIn {
    height_m: f64,
    slope: [f64; 2],
    roughness_m: f64,
    correlation_m: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct WallIn {
    x_m: f64,
    slope: f64,
    z_m: [f64; 2],
    top_m: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct BoxIn {
    middle_m: [f64; 3],
    size_m: [f64; 3],
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct LidarIn {
    model: String,
    address: [u8; 4],
    port: u16,
    position_m: [f64; 3],
    axes: [[f64; 3]; 3],
    tilt_rad: f64,
    rpm: f64,
    clock_offset_ns: i64,
    clock_drift: f64,
    clock_locked: bool,
    channel_offset_m: f64,
    unit_offset_m: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct OpticsIn {
    beam_rad: f64,
    noise_m: f64,
    dropout: f64,
    merge_m: f64,
    range_at_10_percent_m: f64,
    max_range_m: f64,
    grazing_rad: f64,
    incidence_bias_m: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct NetworkIn {
    loss: f64,
    bursts_per_s: f64,
    burst_packets: f64,
    duplicates: f64,
    late: f64,
    jitter_s: f64,
    foreign_hz: f64,
    position_hz: f64,
}

impl SceneIn {
    fn plan(self) -> Result<ScenePlan, InvalidValue> {
        let blade = &self.blade;
        Ok(ScenePlan {
            seed: self.seed,
            start: Timestamp(self.start_ns),
            stations: Stations::reference(&blade.reference, blade.length_m)?,
            orientation: Orientation {
                leading_edge: blade.leading_edge.into(),
                suction_side: blade.suction_side.into(),
            },
            errors: BuildErrors {
                chord: blade.chord_u,
                setting_rad: blade.setting_u_rad,
                prebend: blade.prebend_u,
                stiffness: blade.stiffness_u,
                waves_m: blade.waves_m,
            },
            direction: self.direction.into(),
            follower: self.follower,
            saddles: self.saddles.into_iter().map(SaddlePlan::from).collect(),
            show_saddles: self.show_saddles,
            cable_radius_m: self.cable_radius_m,
            schedule: Schedule {
                levels: self.levels,
                hold_s: self.hold_s,
                ramp_s: self.ramp_s,
            },
            sways: self.sways.into_iter().map(Sway::from).collect(),
            root_turn_rad: self.root_turn_rad.into(),
            ground: self.ground.into(),
            wall: self.wall.map(Wall::from),
            boxes: self.boxes.into_iter().map(Crate::from).collect(),
            lidars: self
                .lidars
                .into_iter()
                .map(LidarIn::plan)
                .collect::<Result<_, _>>()?,
            optics: self.optics.into(),
            network: self.network.into(),
        })
    }
}

impl From<SaddleIn> for SaddlePlan {
    fn from(given: SaddleIn) -> Self {
        Self {
            s_m: given.s_m,
            force_n: given.force_n,
            lever_m: given.lever_m,
            anchor_m: given.anchor_m.into(),
        }
    }
}

impl From<SwayIn> for Sway {
    fn from(given: SwayIn) -> Self {
        Self {
            direction: given.direction.into(),
            order: given.order,
            frequency_hz: given.frequency_hz,
            amplitude_m: given.amplitude_m,
            phase_rad: given.phase_rad,
        }
    }
}

impl From<GroundIn> for GroundPlan {
    fn from(given: GroundIn) -> Self {
        Self {
            height_m: given.height_m,
            slope: given.slope,
            roughness_m: given.roughness_m,
            correlation_m: given.correlation_m,
        }
    }
}

impl From<WallIn> for Wall {
    fn from(given: WallIn) -> Self {
        Self {
            x_m: given.x_m,
            slope: given.slope,
            z_m: given.z_m,
            top_m: given.top_m,
        }
    }
}

impl From<BoxIn> for Crate {
    fn from(given: BoxIn) -> Self {
        Self {
            middle_m: given.middle_m.into(),
            half_m: Vector3::from(given.size_m) * 0.5,
        }
    }
}

impl LidarIn {
    fn plan(self) -> Result<LidarPlan, InvalidValue> {
        Ok(LidarPlan {
            sensor: Arc::new(Sensor::new(&self.model)?),
            address: self.address,
            port: self.port,
            position_m: self.position_m.into(),
            axes: plan::axes(self.axes.map(Vector3::from))?,
            tilt_rad: self.tilt_rad,
            rpm: self.rpm,
            clock: Clock {
                offset_ns: self.clock_offset_ns,
                drift: self.clock_drift,
                locked: self.clock_locked,
            },
            channel_offset_m: self.channel_offset_m,
            unit_offset_m: self.unit_offset_m,
        })
    }
}

impl From<OpticsIn> for Optics {
    fn from(given: OpticsIn) -> Self {
        Self {
            beam_rad: given.beam_rad,
            noise_m: given.noise_m,
            dropout: given.dropout,
            merge_m: given.merge_m,
            range_at_10_percent_m: given.range_at_10_percent_m,
            max_range_m: given.max_range_m,
            grazing_rad: given.grazing_rad,
            incidence_bias_m: given.incidence_bias_m,
        }
    }
}

impl From<NetworkIn> for NetworkPlan {
    fn from(given: NetworkIn) -> Self {
        Self {
            loss: given.loss,
            bursts_per_s: given.bursts_per_s,
            burst_packets: given.burst_packets,
            duplicates: given.duplicates,
            late: given.late,
            jitter_s: given.jitter_s,
            foreign_hz: given.foreign_hz,
            position_hz: given.position_hz,
        }
    }
}
