//! The network adjustment: holds of several lidars and what is known in, poses and covariance out.

use lidar_deflect_core::register::hold::{self, Beam, Echoes, Hold, HoldParams};
use lidar_deflect_core::register::judged::Judged;
use lidar_deflect_core::register::network::{self, Adjusted, Network, Priors};
use lidar_deflect_core::register::search::{self, Yard};
use lidar_deflect_core::register::sheet::{self, Looked, Sheet};
use lidar_deflect_core::register::sight::Sight;
use lidar_deflect_core::register::start;
use lidar_deflect_core::register::state::{LidarState, State};
use lidar_deflect_core::register::surface::{Surface, SurfaceFrame};
use lidar_deflect_core::register::survey::Known;
use lidar_deflect_core::register::target::{self, Target, Wanted};
use nalgebra::{DMatrix, Matrix3, Rotation3, Unit, Vector3};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays;
use crate::compute::{compute, interruptible};
use crate::error::BorderResult;

/// What one lidar sees while nothing moves: mean rays per channel and azimuth cell.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct StaticHold(Hold);

#[pymethods]
impl StaticHold {
    /// Adds up the sweeps of a hold.
    #[staticmethod]
    #[pyo3(signature = (xyz, ring, azimuth_deg, intensity, *, step_deg, min_count))]
    fn add_up(
        py: Python<'_>,
        xyz: PyReadonlyArray2<'_, f32>,
        ring: PyReadonlyArray1<'_, u16>,
        azimuth_deg: PyReadonlyArray1<'_, f32>,
        intensity: Option<PyReadonlyArray1<'_, f32>>,
        step_deg: f64,
        min_count: usize,
    ) -> BorderResult<Self> {
        let xyz_m = arrays::points("xyz", &xyz)?;
        let echoes = Echoes {
            xyz_m,
            ring: arrays::column("ring", &ring, xyz_m.len())?,
            azimuth_deg: arrays::column("azimuth_deg", &azimuth_deg, xyz_m.len())?,
            intensity: match &intensity {
                Some(values) => arrays::column("intensity", values, xyz_m.len())?,
                None => &[],
            },
        };
        let params = HoldParams::new(step_deg, min_count)?;
        Ok(Self(compute(py, Some(1), || {
            hold::add_up(&echoes, &params)
        })?))
    }

    /// A hold whose mean rays are known already, by ring and azimuth.
    #[staticmethod]
    #[pyo3(signature = (direction, range_m, sigma_m, ring, cell, intensity, *, cells))]
    fn of_rays(
        direction: PyReadonlyArray2<'_, f64>,
        range_m: PyReadonlyArray1<'_, f64>,
        sigma_m: PyReadonlyArray1<'_, f64>,
        ring: PyReadonlyArray1<'_, u16>,
        cell: PyReadonlyArray1<'_, u32>,
        intensity: PyReadonlyArray1<'_, f32>,
        cells: u32,
    ) -> BorderResult<Self> {
        let directions = arrays::points("direction", &direction)?;
        let count = directions.len();
        let (range_m, sigma_m) = (
            arrays::column("range_m", &range_m, count)?,
            arrays::column("sigma_m", &sigma_m, count)?,
        );
        let ring = arrays::column("ring", &ring, count)?;
        let cell = arrays::column("cell", &cell, count)?;
        let intensity = arrays::column("intensity", &intensity, count)?;
        let rays = hold::of_rays(directions, range_m, sigma_m, ring, cell, intensity, cells)?;
        Ok(Self(rays))
    }

    /// The mean rays as columns.
    fn beams<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let beams = &self.0.beams;
        let columns = PyDict::new(py);
        columns.set_item(
            "direction",
            arrays::rows(
                py,
                column(beams, |b| -> [f64; 3] { b.direction.into_inner().into() }),
            )?,
        )?;
        columns.set_item("range_m", column(beams, |b| b.range_m).into_pyarray(py))?;
        columns.set_item("sigma_m", column(beams, |b| b.sigma_m).into_pyarray(py))?;
        columns.set_item("ring", column(beams, |b| b.ring).into_pyarray(py))?;
        columns.set_item("cell", column(beams, |b| b.cell).into_pyarray(py))?;
        columns.set_item("intensity", column(beams, |b| b.intensity).into_pyarray(py))?;
        Ok(columns)
    }

    /// Azimuth cells of a turn.
    #[getter]
    fn cells(&self) -> u32 {
        self.0.cells
    }

    /// Cells without a clear range, and cells with too few echoes.
    #[getter]
    fn dropped(&self) -> (usize, usize) {
        (self.0.unclear, self.0.sparse)
    }

    /// The ground beneath: normal and offset in the sensor frame; None where none is seen.
    fn ground(
        &self,
        up_in_sensor: PyReadonlyArray1<'_, f64>,
    ) -> BorderResult<Option<([f64; 3], f64)>> {
        let up = arrays::direction("up_in_sensor", &up_in_sensor)?;
        Ok(start::ground(&self.0, &up).map(|plane| (plane.normal.into(), plane.offset_m)))
    }

    /// Turn about the vertical of a levelled lidar that brings what is bright onto targets, given from
    /// its optical centre in the world's axes with half their size; and how many agree.
    fn turn_to_targets(
        &self,
        levelled: Rows3,
        targets: Vec<([f64; 3], f64)>,
        range_rad: f64,
    ) -> Option<(f64, usize)> {
        let wanted: Vec<Wanted> = targets
            .iter()
            .map(|(from_m, half_m)| Wanted {
                from_m: Vector3::from(*from_m),
                half_m: *half_m,
            })
            .collect();
        let clusters = target::clusters(&self.0);
        target::turn(&clusters, &rotation(&levelled), &wanted, range_rad)
    }

    /// The sheet nearest to a place of the sensor frame, which hangs by the vertical `up`: middle, lean,
    /// deviations across its upright edges, along them and along the ray, shares of channels; echoes.
    fn sheet(
        &self,
        expected_m: [f64; 3],
        up: [f64; 3],
        size_m: f64,
        within_m: f64,
    ) -> Option<(RawSheet, usize)> {
        let looked = Looked {
            expected_m: Vector3::from(expected_m),
            up: Unit::try_new(Vector3::from(up), 1e-9)?,
            size_m,
            within_m,
        };
        let (found, echoes) = sheet::sheet(&self.0, &target::clusters(&self.0), &looked)?;
        let seen = (
            found.centre_m.into(),
            found.lean,
            found.sigma_m,
            found.shares,
        );
        Some((seen, echoes))
    }

    /// How it stands, from the surveyed surfaces and targets that it sees, and its place where that was
    /// surveyed: rotation, position, whether nothing else fits nearly as well; None where nothing fits.
    fn stand(
        &self,
        surfaces: Vec<RawSurface>,
        targets: Vec<([f64; 3], Option<f64>)>,
        position_m: Option<[f64; 3]>,
    ) -> Option<(Rows3, [f64; 3], bool)> {
        let surfaces: Vec<_> = surfaces.iter().map(surface).collect();
        let targets: Vec<_> = targets.iter().map(as_target).collect();
        let yard = Yard {
            surfaces: &surfaces,
            targets: &targets,
            position_m: position_m.map(Vector3::from),
        };
        let found = search::stand(&self.0, &yard)?;
        let rotation: Rows3 = found.stand.rotation.matrix().transpose().into();
        Some((rotation, found.stand.position_m.into(), found.is_clear()))
    }

    fn __len__(&self) -> usize {
        self.0.beams.len()
    }
}

fn column<T>(beams: &[Beam], value: impl Fn(&Beam) -> T) -> Vec<T> {
    beams.iter().map(value).collect()
}

type Rows3 = [[f64; 3]; 3];

/// A lidar before the adjustment.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct RawLidar {
    rotation: Rows3,
    position_m: [f64; 3],
    channels: usize,
}

/// A surface before the adjustment.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct RawSurface {
    origin_m: [f64; 3],
    normal: [f64; 3],
    half_m: [f64; 2],
}

/// Lidar, target, centre in the sensor's frame (m), its deviations across the ray and along it (m).
type RawSheet = ([f64; 3], f64, [f64; 3], Vec<(u16, f64)>);
type RawSight = (usize, usize, RawSheet);

/// What is known besides the scans, kind by kind.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct RawKnown {
    control: Vec<(usize, [f64; 3], f64)>,
    position: Vec<(usize, [f64; 3], [f64; 3], f64)>,
    mounting: Vec<(usize, Rows3, f64)>,
    gravity: Vec<(usize, [f64; 3], f64)>,
    distance: Vec<([usize; 2], f64, f64)>,
    target: Vec<(usize, [f64; 3], f64)>,
    sight: Vec<RawSight>,
}

fn rotation(rows: &Rows3) -> Rotation3<f64> {
    Rotation3::from_matrix(&Matrix3::from_fn(|i, j| rows[i][j]))
}

impl RawKnown {
    fn all(&self) -> Vec<Known> {
        let control = self
            .control
            .iter()
            .map(|(surface, xyz_m, u_m)| Known::Control {
                surface: *surface,
                xyz_m: Vector3::from(*xyz_m),
                u_m: *u_m,
            });
        let position = self
            .position
            .iter()
            .map(|(lidar, mark_m, arm, u_m)| Known::Position {
                lidar: *lidar,
                mark_m: Vector3::from(*mark_m),
                lever_arm_m: Vector3::from(*arm),
                u_m: *u_m,
            });
        let mounting = self
            .mounting
            .iter()
            .map(|(lidar, nominal, u_rad)| Known::Mounting {
                lidar: *lidar,
                nominal: rotation(nominal),
                u_rad: *u_rad,
            });
        let gravity = self
            .gravity
            .iter()
            .map(|(lidar, up, u_rad)| Known::Gravity {
                lidar: *lidar,
                up_in_sensor: Unit::new_normalize(Vector3::from(*up)),
                u_rad: *u_rad,
            });
        let distance = self
            .distance
            .iter()
            .map(|(between, m, u_m)| Known::Distance {
                between: *between,
                m: *m,
                u_m: *u_m,
            });
        let target = self
            .target
            .iter()
            .map(|(target, xyz_m, u_m)| Known::Target {
                target: *target,
                xyz_m: Vector3::from(*xyz_m),
                u_m: *u_m,
            });
        let sight = self
            .sight
            .iter()
            .map(|(lidar, target, (centre_m, lean, sigma_m, shares))| {
                Known::Sight(Sight {
                    lidar: *lidar,
                    target: *target,
                    seen: Sheet {
                        centre_m: Vector3::from(*centre_m),
                        lean: *lean,
                        sigma_m: *sigma_m,
                        shares: shares.clone(),
                    },
                })
            });
        let survey = control.chain(position).chain(mounting).chain(gravity);
        survey.chain(distance).chain(target).chain(sight).collect()
    }

    /// Kinds with the number of entries of each, in the order of `all`.
    fn kinds(&self) -> [(&'static str, usize); 7] {
        [
            ("control", self.control.len()),
            ("position", self.position.len()),
            ("mounting", self.mounting.len()),
            ("gravity", self.gravity.len()),
            ("distance", self.distance.len()),
            ("target", self.target.len()),
            ("sight", self.sight.len()),
        ]
    }
}

/// Adjusts poses, nuisances and surfaces to everything that is known; see `lidar_deflect.network`.
#[pyfunction]
#[pyo3(signature = (holds, lidars, surfaces, targets, known, *, priors))]
fn adjust_network<'py>(
    py: Python<'py>,
    holds: Vec<PyRef<'py, StaticHold>>,
    lidars: Vec<RawLidar>,
    surfaces: Vec<RawSurface>,
    targets: Vec<([f64; 3], Option<f64>)>,
    known: RawKnown,
    priors: [f64; 3],
) -> BorderResult<Bound<'py, PyDict>> {
    arrays::expect_rows("lidars", lidars.len(), holds.len())?;
    let network = Network {
        start: State {
            lidars: lidars.iter().map(|raw| lidar(raw, targets.len())).collect(),
            surfaces: surfaces.iter().map(surface).collect(),
            targets: targets.iter().map(as_target).collect(),
        },
        holds: holds.iter().map(|hold| hold.0.clone()).collect(),
        known: known.all(),
        priors: Priors {
            channel_offset_u_m: priors[0],
            elevation_u_rad: priors[1],
            range_scale_u: priors[2],
        },
    };
    network.check()?;
    drop(holds);
    let adjusted = interruptible(py, |stop| network::adjust(&network, stop))??;
    Ok(described(py, &adjusted, &known.kinds())?)
}

fn lidar(raw: &RawLidar, targets: usize) -> LidarState {
    LidarState {
        rotation: rotation(&raw.rotation),
        position_m: Vector3::from(raw.position_m),
        elevation_rad: 0.0,
        scale: 0.0,
        offsets_m: vec![0.0; raw.channels],
        retro_m: 0.0,
        skins_m: vec![0.0; targets],
        slant_m: 0.0,
    }
}

fn as_target((centre_m, radius_m): &([f64; 3], Option<f64>)) -> Target {
    Target {
        centre_m: Vector3::from(*centre_m),
        radius_m: *radius_m,
    }
}

fn surface(raw: &RawSurface) -> Surface {
    let normal = Unit::new_normalize(Vector3::from(raw.normal));
    Surface::flat(SurfaceFrame::new(
        Vector3::from(raw.origin_m),
        normal,
        raw.half_m,
    ))
}

fn described<'py>(
    py: Python<'py>,
    adjusted: &Adjusted,
    kinds: &[(&'static str, usize)],
) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let lidars = PyList::empty(py);
    for (lidar, at) in adjusted.state.lidars.iter().zip(&adjusted.layout.lidars) {
        let entry = PyDict::new(py);
        let rows: Rows3 = lidar.rotation.matrix().transpose().into();
        entry.set_item("rotation", arrays::rows(py, rows.to_vec())?)?;
        entry.set_item("position_m", lidar.position_m.as_slice())?;
        entry.set_item("elevation_rad", lidar.elevation_rad)?;
        entry.set_item("scale", lidar.scale)?;
        entry.set_item("offsets_m", lidar.offsets_m.clone().into_pyarray(py))?;
        entry.set_item("retro_m", lidar.retro_m)?;
        entry.set_item("slant_m", lidar.slant_m)?;
        entry.set_item("at", *at)?;
        lidars.append(entry)?;
    }
    all.set_item("lidars", lidars)?;
    all.set_item("surfaces", surfaces_of(py, adjusted)?)?;
    all.set_item(
        "targets",
        column3(py, adjusted.state.targets.iter().map(|t| &t.centre_m))?,
    )?;
    all.set_item("covariance", square(py, &adjusted.covariance)?)?;
    let met = |value: fn(&lidar_deflect_core::register::select::Met) -> usize| {
        adjusted
            .met
            .iter()
            .map(value)
            .map(|v| v as u32)
            .collect::<Vec<_>>()
            .into_pyarray(py)
    };
    all.set_item("met_lidar", met(|m| m.lidar))?;
    all.set_item("met_beam", met(|m| m.beam))?;
    all.set_item("met_surface", met(|m| m.surface))?;
    all.set_item("residuals", arrays::rows(py, adjusted.residuals.clone())?)?;
    all.set_item("met_xyz_m", column3(py, adjusted.points().iter())?)?;
    let mut rest = adjusted.judged.as_slice();
    for (kind, count) in kinds {
        let (own, after) = rest.split_at(*count);
        all.set_item(*kind, judged(py, own)?)?;
        rest = after;
    }
    let seen = adjusted.seen.iter();
    let seen: Vec<_> = seen
        .map(|s| (s.lidar, s.target, s.count, s.rms_m))
        .collect();
    all.set_item("seen", seen)?;
    all.set_item("offset_u_m", adjusted.offset_u_m)?;
    all.set_item("steps", adjusted.steps)?;
    all.set_item("converged", adjusted.converged)?;
    Ok(all)
}

fn column3<'a, 'py>(
    py: Python<'py>,
    values: impl Iterator<Item = &'a Vector3<f64>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    arrays::rows(py, values.map(|v| [v.x, v.y, v.z]).collect())
}

fn square<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    // Symmetric: the order of rows and columns is the same.
    let values = matrix.as_slice().to_vec().into_pyarray(py);
    values.reshape([matrix.nrows(), matrix.ncols()])
}

fn surfaces_of<'py>(py: Python<'py>, adjusted: &Adjusted) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for surface in &adjusted.state.surfaces {
        let entry = PyDict::new(py);
        let frame = &surface.frame;
        let (_, gradient, _) = surface.above(&frame.origin_m);
        entry.set_item("origin_m", frame.origin_m.as_slice())?;
        entry.set_item("normal", gradient.normalize().as_slice())?;
        entry.set_item("half_m", frame.half_m)?;
        entry.set_item("coefficients_m", surface.coefficients)?;
        if let Some(field) = &surface.field {
            let rough = field.roughness();
            entry.set_item("roughness_m", rough.sigma_m)?;
            entry.set_item("correlation_m", rough.correlation_m)?;
            entry.set_item("nugget_m", rough.nugget_m)?;
            entry.set_item("nodes", field.len())?;
        }
        list.append(entry)?;
    }
    Ok(list)
}

/// Per entry and row: residual, sigma, redundancy, studentised, left out.
fn judged<'py>(py: Python<'py>, entries: &[Vec<Judged>]) -> PyResult<Bound<'py, PyList>> {
    let rows = |entry: &Vec<Judged>| -> Vec<(f64, f64, f64, f64, bool)> {
        let row = |j: &Judged| (j.residual, j.sigma, j.redundancy, j.studentised, j.left_out);
        entry.iter().map(row).collect()
    };
    PyList::new(py, entries.iter().map(rows))
}

/// Adds this file's classes and functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<StaticHold>()?;
    module.add_function(wrap_pyfunction!(adjust_network, module)?)
}
