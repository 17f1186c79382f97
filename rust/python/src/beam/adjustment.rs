//! The adjustment of all holds, step by step.

use std::sync::atomic::Ordering;

use lidar_deflect_core::beam::adjust::{Adjustment, Gates, Hold, Problem, Stage};
use lidar_deflect_core::beam::carry::{Knowledge, Spread};
use lidar_deflect_core::beam::clocks::{ClockNews, Clocks};
use lidar_deflect_core::beam::family::{Loading, Trust};
use lidar_deflect_core::beam::rig::Rig;
use lidar_deflect_core::beam::shape::{Shape, ShapeTrust};
use lidar_deflect_core::beam::solution::Solution;
use lidar_deflect_core::beam::track::{Followed, Stretch, load_knots};
use lidar_deflect_core::beam::weights::{EdgeMet, Tally, Used, Weights};
use lidar_deflect_core::error::InvalidValue;
use lidar_deflect_core::frame::WorldFromSensor;
use nalgebra::{DMatrix, DVector, Vector3};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use super::blade::BeamBlade;
use super::seen::BeamSeen;
use crate::arrays;
use crate::compute::{compute, compute_until};
use crate::error::BorderResult;

/// Holds, blade and lidars in one adjustment.
#[pyclass(module = "lidar_deflect._native")]
pub struct BeamAdjustment {
    core: Adjustment,
    /// At the present estimate, once it is asked for.
    solution: Option<Solution>,
    /// Of the sections asked for last.
    knowledge: Option<Knowledge>,
    /// What became of the data in the last step, by hold.
    tallies: Vec<Tally>,
    threads: Option<usize>,
}

/// States, their spreads and what became of the data.
type Told<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyDict>,
);

/// Information and what it asks for.
type News<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

#[pymethods]
impl BeamAdjustment {
    /// `forces_n` (holds, saddles, 3) in world axes; `rig_prior` and `rig_covariance` of every lidar's
    /// rotation, translation, elevation, scale and channel offsets; `clock_s` the deviations of their clocks.
    #[new]
    #[pyo3(signature = (
        blade, seen, *, spans_ns, forces_n, full_n, poses, channels, clock_s, rig_prior, rig_covariance, from_m,
        trust, shape_trust, noise_m, surface_m, edge_rad, echoes, threads=None
    ))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        py: Python<'_>,
        blade: &BeamBlade,
        seen: Vec<PyRef<'_, BeamSeen>>,
        spans_ns: Vec<(i64, i64)>,
        forces_n: PyReadonlyArray3<'_, f64>,
        full_n: PyReadonlyArray2<'_, f64>,
        poses: PyReadonlyArray3<'_, f64>,
        channels: Vec<usize>,
        clock_s: Vec<f64>,
        rig_prior: PyReadonlyArray1<'_, f64>,
        rig_covariance: PyReadonlyArray2<'_, f64>,
        from_m: f64,
        trust: [f64; 8],
        shape_trust: [f64; 11],
        noise_m: f64,
        surface_m: f64,
        edge_rad: f64,
        echoes: usize,
        threads: Option<usize>,
    ) -> BorderResult<Self> {
        let forces = forces_n.as_array();
        arrays::expect_rows("forces_n", forces.shape()[0], seen.len())?;
        arrays::expect_rows("spans_ns", spans_ns.len(), seen.len())?;
        let hold = |place: usize| Hold {
            seen: seen[place].seen.clone(),
            span_ns: spans_ns[place],
            loading: Loading {
                force_n: forces
                    .index_axis(numpy::ndarray::Axis(0), place)
                    .outer_iter()
                    .map(|f| Vector3::new(f[0], f[1], f[2]))
                    .collect(),
                full_n: full_n
                    .as_array()
                    .outer_iter()
                    .map(|f| f.iter().map(|x| x * x).sum::<f64>().sqrt())
                    .sum(),
            },
        };
        let [
            span_modes,
            stiffness,
            stiffness_tip,
            weight,
            prebend,
            free_rad_m,
            root_rad,
            coupling,
        ] = trust;
        let [
            chord,
            chord_waves,
            tip,
            setting_rad,
            twist_waves_rad,
            axis_fraction,
            form,
            waves_m,
            slow_knot_m,
            wave_knot_m,
            bend,
        ] = shape_trust;
        let shape = ShapeTrust {
            chord,
            chord_waves,
            tip,
            setting_rad,
            twist_waves_rad,
            axis_fraction,
            form,
            waves_m,
            slow_knot_m,
            wave_knot_m,
            bend,
        };
        let problem = Problem {
            mesh: blade.mesh.clone().doubted(stiffness_tip),
            saddles: blade.saddles.clone(),
            trust: Trust {
                span_modes: span_modes as usize,
                stiffness,
                stiffness_tip,
                weight,
                prebend,
                free_rad_m,
                root_rad,
                coupling,
            },
            shape: Shape::new(&blade.mesh, shape, from_m),
            full_n: full_n
                .as_array()
                .outer_iter()
                .map(|f| Vector3::new(f[0], f[1], f[2]))
                .collect(),
            holds: (0..seen.len()).map(hold).collect(),
        };
        let matrices = arrays::matrices("poses", &poses, channels.len())?;
        let poses: Result<Vec<_>, _> = matrices.iter().map(WorldFromSensor::from_matrix).collect();
        let covariance = rig_covariance.as_array();
        let (rows, columns) = covariance.dim();
        let weights = Weights {
            noise_m: vec![noise_m; channels.len()],
            surface_m,
            edge_rad,
            echoes,
            common: Vec::new(),
            learned: 0,
        };
        let rig = Rig::new(
            poses?,
            channels,
            clock_s,
            DVector::from_iterator(
                rig_prior.as_array().len(),
                rig_prior.as_array().iter().copied(),
            ),
            DMatrix::from_fn(rows, columns, |i, j| covariance[(i, j)]),
        )?;
        let core = compute(py, threads, || Adjustment::new(problem, rig, weights))??;
        Ok(Self {
            core,
            solution: None,
            knowledge: None,
            tallies: Vec::new(),
            threads,
        })
    }

    /// One step with data inside of the gates.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        echo_m: f64,
        edge_m: f64,
        stage: &str,
    ) -> BorderResult<Bound<'py, PyDict>> {
        (self.solution, self.knowledge) = (None, None);
        let core = &mut self.core;
        let gates = Gates {
            echo_m,
            edge_m,
            stage: stage_named(stage)?,
        };
        let step = compute(py, self.threads, || core.step(&gates))??;
        let told = PyDict::new(py);
        told.set_item("largest", step.largest)?;
        told.set_item("moved_m", step.moved_m)?;
        self.tallies = step.tallies;
        told.set_item("noise_m", self.core.weights.noise_m.clone())?;
        told.set_item("surface_m", self.core.weights.surface_m)?;
        Ok(told)
    }

    /// What became of the data in the last step, by hold.
    fn told<'py>(&self, py: Python<'py>) -> BorderResult<Vec<Bound<'py, PyDict>>> {
        let holds: PyResult<Vec<_>> = self.tallies.iter().map(|t| tally(py, t)).collect();
        Ok(holds?)
    }

    /// Values (holds * sections, 4) and joint covariance of x, y, z, twist of the sections, to which
    /// `states` and `follow` keep from then on.
    #[allow(clippy::type_complexity)] // the two that Python unpacks
    fn sections<'py>(
        &mut self,
        py: Python<'py>,
        s_m: Vec<f64>,
        echo_m: f64,
        edge_m: f64,
    ) -> BorderResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let threads = self.threads;
        let (core, solution) = self.solve(py, echo_m, edge_m)?;
        let (found, knowledge) = compute(py, threads, || core.knowledge(&s_m, solution))?;
        self.knowledge = Some(knowledge);
        let count = found.covariance.nrows();
        let values = found.values.as_flattened().to_vec();
        let covariance = found.covariance.as_slice().to_vec();
        Ok((
            arrays::table(py, values, 4)?,
            arrays::table(py, covariance, count)?,
        ))
    }

    /// States of the sections within a hold at instants, (times * sections, 4), and their spreads
    /// (times * sections, 13): covariance of x, y, z as xx, yy, zz, xy, xz, yz, the same of the
    /// deflection from the first hold, variance of the twist; beyond the first `each` sections those
    /// of the middle instant.
    #[allow(clippy::type_complexity)] // the two that Python unpacks
    fn states<'py>(
        &self,
        py: Python<'py>,
        hold: usize,
        times_ns: Vec<i64>,
        each: usize,
    ) -> BorderResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let (core, knowledge) = (&self.core, self.known()?);
        let (values, spreads) = compute(py, self.threads, || {
            core.instants(knowledge, hold, &times_ns, each)
        })?;
        Ok((arrays::rows(py, values)?, spread_rows(py, &spreads)?))
    }

    /// Instants at which `follow` wants the load of a stretch of time.
    #[staticmethod]
    fn load_knots(span_ns: (i64, i64)) -> Vec<i64> {
        load_knots(span_ns)
    }

    /// Follows stretches of time (what was seen, span, load at its knots, instants): per stretch the
    /// states (times * sections, 4), their spreads as in `states`, and what became of the data; `None`
    /// where the blade was not found.
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn follow<'py>(
        &self,
        py: Python<'py>,
        seen: Vec<PyRef<'py, BeamSeen>>,
        spans_ns: Vec<(i64, i64)>,
        loads: Vec<Vec<f64>>,
        times_ns: Vec<Vec<i64>>,
        hold_loads: Vec<f64>,
        gates: Vec<(f64, f64)>,
        sway_m: [f64; 4],
    ) -> BorderResult<Vec<Option<Told<'py>>>> {
        let stretches: Vec<Stretch> = seen
            .iter()
            .zip(spans_ns.iter().zip(&loads))
            .map(|(seen, (span, load))| Stretch {
                seen: seen.seen.clone(),
                span_ns: *span,
                load: load.clone(),
                sway_m,
            })
            .collect();
        let gates: Vec<Gates> = gates
            .iter()
            .map(|(echo_m, edge_m)| Gates {
                echo_m: *echo_m,
                edge_m: *edge_m,
                stage: Stage::All,
            })
            .collect();
        let reference = (&self.core, self.known()?);
        let follow = |(stretch, times): (&Stretch, &Vec<i64>)| {
            let mut part = reference.0.stretch(stretch, &hold_loads).ok()?;
            let between = stretch.between(&hold_loads);
            part.follow(reference, between, times, &gates).ok()
        };
        let found: Vec<_> = compute_until(py, self.threads, |stop| {
            let goes_on = |_: &_| !stop.load(Ordering::Relaxed);
            let both = stretches.par_iter().zip(times_ns.par_iter());
            // One by one: some take longer than others.
            let both = both.with_max_len(1);
            both.map(|both| goes_on(&both).then(|| follow(both)).flatten())
                .collect()
        })?;
        let hand = |followed: Option<Followed>| -> PyResult<_> {
            let Some(f) = followed else { return Ok(None) };
            let told = tally(py, &f.tally)?;
            told.set_item(
                "clocks",
                f.clocks.map(|news| clock_news(py, &news)).transpose()?,
            )?;
            let parts = (
                arrays::rows(py, f.values)?,
                spread_rows(py, &f.spreads)?,
                told,
            );
            Ok(Some(parts))
        };
        Ok(found.into_iter().map(hand).collect::<PyResult<Vec<_>>>()?)
    }

    /// What is known of the lidars' clocks in stretches: offsets and deviations in seconds, and whether their
    /// mean is held, where offsets are looked for.
    fn set_clocks(&mut self, offset_s: Vec<f64>, deviation_s: Vec<f64>, tied: bool) {
        self.core.clocks = Some(Clocks {
            offset_s,
            deviation_s,
            tied,
        });
    }

    /// All unknowns, in standard deviations; those of the lidars in their own units.
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let mut values = self.core.values.as_slice().to_vec();
        let first = self.core.layout.lidar_at(0);
        for (place, value) in self.core.rig.values.iter().enumerate() {
            values[first + place] = *value;
        }
        values.into_pyarray(py)
    }

    /// Names of what values rest on, and the variance that each gives to x, y, z, the changes dx, dy, dz
    /// and d since the first hold, and the twist, (groups, holds * sections * 8).
    fn budget<'py>(
        &mut self,
        py: Python<'py>,
        s_m: Vec<f64>,
        echo_m: f64,
        edge_m: f64,
    ) -> BorderResult<(Vec<&'static str>, Bound<'py, PyArray2<f64>>)> {
        let threads = self.threads;
        let (core, solution) = self.solve(py, echo_m, edge_m)?;
        let found = compute(py, threads, || core.budget(&s_m, solution))?;
        let names = found.groups.iter().map(|group| group.0).collect();
        let values = found.groups.into_iter().flat_map(|group| group.1).collect();
        let count = 8 * s_m.len() * self.core.problem.holds.len();
        Ok((names, arrays::table(py, values, count)?))
    }

    /// By unknown: its group, by how much the data moved it, its standard deviation before and after.
    #[allow(clippy::type_complexity)] // the two that Python unpacks
    fn posterior<'py>(
        &mut self,
        py: Python<'py>,
        echo_m: f64,
        edge_m: f64,
    ) -> BorderResult<(Vec<&'static str>, Bound<'py, PyArray2<f64>>)> {
        let threads = self.threads;
        let (core, solution) = self.solve(py, echo_m, edge_m)?;
        let found = compute(py, threads, || core.posterior(solution))??;
        let names = found.iter().map(|known| known.0).collect();
        let values = found.iter().flat_map(|known| known.1).collect();
        Ok((names, arrays::table(py, values, 3)?))
    }

    /// Free axial strain of every hold, as if nothing kept its length, and the joint covariance.
    #[allow(clippy::type_complexity)] // the two that Python unpacks
    fn strains<'py>(
        &mut self,
        py: Python<'py>,
        echo_m: f64,
        edge_m: f64,
    ) -> BorderResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>)> {
        let (_, solution) = self.solve(py, echo_m, edge_m)?;
        let (strain, covariance) = (&solution.strain, &solution.strain_covariance);
        let count = strain.len();
        Ok((
            strain.as_slice().to_vec().into_pyarray(py),
            arrays::table(py, covariance.as_slice().to_vec(), count)?,
        ))
    }

    /// Outlines of the sections in every hold, (holds * sections * points, 4): x, y, z in metres and
    /// the standard deviation along the normal.
    fn outlines<'py>(
        &mut self,
        py: Python<'py>,
        s_m: Vec<f64>,
        echo_m: f64,
        edge_m: f64,
    ) -> BorderResult<Bound<'py, PyArray2<f64>>> {
        let threads = self.threads;
        let (core, solution) = self.solve(py, echo_m, edge_m)?;
        let found = compute(py, threads, || core.outlines(&s_m, solution))?;
        Ok(arrays::rows(py, found)?)
    }

    /// Edges that end where the silhouette is not: hold, lidar, side (0 leading, 1 trailing edge), and
    /// how far outside of it, rad.
    fn loose_edges(&self) -> Vec<(usize, usize, usize, f64)> {
        self.core.loose_edges()
    }

    /// Where groups of unknowns start.
    fn layout<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let layout = &self.core.layout;
        let told = PyDict::new(py);
        told.set_item("own", layout.own_at(0))?;
        told.set_item("sway", layout.sway_at(0))?;
        told.set_item("rig", layout.lidar_at(0))?;
        told.set_item("shape", layout.shape_at())?;
        told.set_item("edge", layout.edge_at())?;
        told.set_item("len", layout.len())?;
        Ok(told)
    }
}

impl BeamAdjustment {
    /// The normal equations with data inside of the gates, solved unless they are already.
    fn solve(
        &mut self,
        py: Python<'_>,
        echo_m: f64,
        edge_m: f64,
    ) -> BorderResult<(&Adjustment, &Solution)> {
        let is_same = |s: &Solution| s.gates.echo_m == echo_m && s.gates.edge_m == edge_m;
        let solution = match self.solution.take().filter(is_same) {
            Some(solution) => solution,
            None => {
                let (core, gates) = (&self.core, last_gates(echo_m, edge_m));
                compute(py, self.threads, || core.solution(&gates))??
            }
        };
        Ok((&self.core, self.solution.insert(solution)))
    }

    fn known(&self) -> Result<&Knowledge, InvalidValue> {
        self.knowledge.as_ref().ok_or_else(|| InvalidValue {
            name: "sections",
            expected: "asked for after the last step".into(),
            found: "states before them".into(),
        })
    }
}

/// Rows of 13 as `states` tells.
fn spread_rows<'py>(py: Python<'py>, spreads: &[Spread]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    const PLACES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    let of = |spread: &Spread| {
        let both = [spread.position, spread.deflection];
        let entries = both
            .into_iter()
            .flat_map(|block| PLACES.map(|place| block[place]));
        entries.chain([spread.twist]).collect::<Vec<f64>>()
    };
    arrays::table(py, spreads.iter().flat_map(of).collect(), 13)
}

/// Information of the clocks' offsets (lidars, lidars) in 1/s^2, and that times the offsets, 1/s.
fn clock_news<'py>(py: Python<'py>, news: &ClockNews) -> PyResult<News<'py>> {
    let rows: Vec<Vec<f64>> = news
        .information
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect();
    Ok((
        PyArray2::from_vec2(py, &rows)?,
        news.right.as_slice().to_vec().into_pyarray(py),
    ))
}

fn tally<'py>(py: Python<'py>, tally: &Tally) -> PyResult<Bound<'py, PyDict>> {
    let told = met(py, &tally.used)?;
    let edge = |e: &EdgeMet| (e.lidar, e.side, e.residual_rad / e.step_rad);
    told.set_item("edges", tally.edges.iter().map(edge).collect::<Vec<_>>())?;
    told.set_item("missed", tally.missed)?;
    told.set_item("rejected", met(py, &tally.rejected)?)?;
    told.set_item("unfit", tally.unfit)?;
    told.set_item("edges_left_out", tally.edges_left_out)?;
    Ok(told)
}

/// Columns of echoes that met the model.
fn met<'py>(py: Python<'py>, echoes: &[Used]) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("time_ns", column(py, echoes.iter().map(|e| e.time_ns)))?;
    told.set_item("lidar", column(py, echoes.iter().map(|e| e.lidar as u32)))?;
    told.set_item("ring", column(py, echoes.iter().map(|e| e.ring as u32)))?;
    told.set_item("s_m", column(py, echoes.iter().map(|e| e.s_m)))?;
    told.set_item(
        "residual_m",
        column(py, echoes.iter().map(|e| e.residual_m)),
    )?;
    told.set_item("chord", column(py, echoes.iter().map(|e| e.chord)))?;
    let points: Vec<[f64; 3]> = echoes.iter().map(|e| e.point.into()).collect();
    told.set_item("xyz_m", arrays::rows(py, points)?)?;
    Ok(told)
}

fn column<T: numpy::Element>(
    py: Python<'_>,
    values: impl Iterator<Item = T>,
) -> Bound<'_, PyArray1<T>> {
    values.collect::<Vec<T>>().into_pyarray(py)
}

fn last_gates(echo_m: f64, edge_m: f64) -> Gates {
    Gates {
        echo_m,
        edge_m,
        stage: Stage::All,
    }
}

fn stage_named(name: &str) -> Result<Stage, InvalidValue> {
    match name {
        "loads" => Ok(Stage::Loads),
        "blade" => Ok(Stage::Blade),
        "surface" => Ok(Stage::Surface),
        "all" => Ok(Stage::All),
        _ => Err(InvalidValue {
            name: "stage",
            expected: "loads, blade, surface or all".into(),
            found: name.into(),
        }),
    }
}
