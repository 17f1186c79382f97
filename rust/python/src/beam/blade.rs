//! The blade of a drawing.

use lidar_deflect_core::beam::design::{Design, Outlines, Stations};
use lidar_deflect_core::beam::mesh::Mesh;
use lidar_deflect_core::beam::start::forces_for;
use nalgebra::Vector3;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays;
use crate::compute::compute;
use crate::error::BorderResult;

/// A checked drawing cut into elements, with the places where load enters.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct BeamBlade {
    pub mesh: Mesh,
    pub saddles: Vec<usize>,
}

#[pymethods]
impl BeamBlade {
    /// `stations` (n, 8): s, chord, twist in rad, prebend, axis fraction, edgewise, flapwise and
    /// torsional stiffness; `outlines` (m, points, 2) at `outline_s_m`.
    #[new]
    #[pyo3(signature = (stations, outline_s_m, outlines, *, leading_edge, suction_side, saddles_s_m))]
    fn new(
        stations: PyReadonlyArray2<'_, f64>,
        outline_s_m: Vec<f64>,
        outlines: PyReadonlyArray3<'_, f64>,
        leading_edge: PyReadonlyArray1<'_, f64>,
        suction_side: PyReadonlyArray1<'_, f64>,
        saddles_s_m: Vec<f64>,
    ) -> BorderResult<Self> {
        let table = stations.as_array();
        let column = |k: usize| table.column(k).to_vec();
        arrays::expect_rows("stations columns", table.ncols(), 8)?;
        let design = Design::new(
            Stations {
                s_m: column(0),
                chord_m: column(1),
                twist_rad: column(2),
                prebend_m: column(3),
                axis_fraction: column(4),
                ei_edge_nm2: column(5),
                ei_flap_nm2: column(6),
                gj_nm2: column(7),
            },
            Outlines {
                s_m: outline_s_m,
                points: outlines
                    .as_array()
                    .outer_iter()
                    .map(|outline| outline.outer_iter().map(|p| [p[0], p[1]]).collect())
                    .collect(),
            },
            &arrays::direction("leading_edge", &leading_edge)?.into_inner(),
            &arrays::direction("suction_side", &suction_side)?.into_inner(),
        )?;
        let mesh = Mesh::new(&design, &saddles_s_m);
        let saddles = saddles_s_m.iter().map(|s| mesh.node_at(*s)).collect();
        Ok(Self { mesh, saddles })
    }

    /// Forces at the saddles, newtons along `direction`, that bend the blade by `deflection_m` at `s_m`;
    /// None where no load does.
    fn forces_for<'py>(
        &self,
        py: Python<'py>,
        direction: PyReadonlyArray1<'py, f64>,
        s_m: Vec<f64>,
        deflection_m: Vec<f64>,
    ) -> BorderResult<Option<Bound<'py, PyArray1<f64>>>> {
        let direction: Vector3<f64> = arrays::direction("direction", &direction)?.into_inner();
        let solve = || forces_for(&self.mesh, &self.saddles, &direction, &s_m, &deflection_m);
        let forces = compute(py, None, solve)?;
        Ok(forces.map(|values| values.into_pyarray(py)))
    }
}
