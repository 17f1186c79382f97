//! Registration: rotations and the yaw of a wall in closed form; the network in a file of its own.

mod network;

use lidar_deflect_core::register::closed_form;
use lidar_deflect_core::register::wall::{self, ExpectedWall};
use nalgebra::{Rotation3, Vector3};
use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays;
use crate::compute::compute;
use crate::error::BorderResult;

/// Adds this file's functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    network::register(module)?;
    module.add_function(wrap_pyfunction!(rotation_onto, module)?)?;
    module.add_function(wrap_pyfunction!(rotation_about_up, module)?)?;
    module.add_function(wrap_pyfunction!(yaw_from_wall, module)?)
}

/// Smallest rotation (3, 3) that carries one direction onto another, equations (7), (8) corrected.
#[pyfunction]
fn rotation_onto<'py>(
    py: Python<'py>,
    from_direction: PyReadonlyArray1<'py, f64>,
    to_direction: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray2<f64>>> {
    let from = arrays::direction("from_direction", &from_direction)?;
    let to = arrays::direction("to_direction", &to_direction)?;
    Ok(matrix(py, &closed_form::rotation_onto(&from, &to))?)
}

/// Rotation (3, 3) about world up.
#[pyfunction]
fn rotation_about_up(py: Python<'_>, yaw_rad: f64) -> PyResult<Bound<'_, PyArray2<f64>>> {
    matrix(py, &Rotation3::from_axis_angle(&Vector3::y_axis(), yaw_rad))
}

/// Yaw of a levelled cloud from a wall at a known distance: yaw, rms and count of its points.
#[pyfunction]
#[pyo3(signature = (levelled, *, normal, distance_m, yaw_range_rad, min_height_m))]
fn yaw_from_wall<'py>(
    py: Python<'py>,
    levelled: PyReadonlyArray2<'py, f32>,
    normal: PyReadonlyArray1<'py, f64>,
    distance_m: f64,
    yaw_range_rad: f64,
    min_height_m: f64,
) -> BorderResult<(f64, f64, usize)> {
    let points = arrays::points("levelled", &levelled)?;
    let normal = arrays::direction("normal", &normal)?;
    let expected = ExpectedWall {
        normal,
        distance_m,
        yaw_range_rad,
        min_height_m,
    };
    let found = compute(py, Some(1), || wall::yaw_from_wall(points, &expected))??;
    Ok((found.yaw_rad, found.plane.rms, found.plane.count))
}

fn matrix<'py>(py: Python<'py>, rotation: &Rotation3<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows: [[f64; 3]; 3] = rotation.matrix().transpose().into(); // nalgebra stores columns
    arrays::rows(py, rows.to_vec())
}
