//! The few points of a hold that are worth a closer look.

use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::paper::near;
use lidar_deflect_core::paper::passthrough::PassThrough;
use nalgebra::Matrix4;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays;
use crate::error::BorderResult;

/// Adds this file's functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(points_near_box, module)?)?;
    module.add_function(wrap_pyfunction!(points_nearest_to, module)?)
}

/// The points (n, 3) of a sensor at `pose`, (4, 4), that may lie in a box (2, 3) of the world, and few others.
#[pyfunction]
fn points_near_box<'py>(
    py: Python<'py>,
    xyz: PyReadonlyArray2<'py, f32>,
    pose: PyReadonlyArray2<'py, f64>,
    box_m: PyReadonlyArray2<'py, f64>,
) -> BorderResult<Bound<'py, PyArray2<f32>>> {
    let points = arrays::points("xyz", &xyz)?;
    let rows: &[[f64; 4]] = arrays::columns("pose", "shape (4, 4) in C order", &pose)?;
    arrays::expect_rows("pose", rows.len(), 4)?;
    let pose = Matrix4::from_fn(|row, column| rows[row][column]);
    let pose = WorldFromSensor::from_matrix(&pose)?;
    let corners = arrays::points("box_m", &box_m)?;
    arrays::expect_rows("box_m", corners.len(), 2)?;
    let near = PassThrough::new(corners[0], corners[1])?.near(&pose);
    let kept = py.detach(|| {
        let mut kept = Vec::new();
        near.places(points, |place| kept.push(points[place]));
        kept
    });
    Ok(arrays::rows(py, kept)?)
}

/// Places of the points (n, 3) whose direction may be the nearest to a unit vector, (3,).
#[pyfunction]
fn points_nearest_to<'py>(
    py: Python<'py>,
    xyz: PyReadonlyArray2<'py, f32>,
    direction: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<i64>>> {
    let points = arrays::points("xyz", &xyz)?;
    let direction = arrays::column("direction", &direction, 3)?;
    let direction = [direction[0], direction[1], direction[2]];
    let places = py.detach(|| near::nearest_to(direction, points));
    let places: Vec<i64> = places.into_iter().map(|place| place as i64).collect();
    Ok(places.into_pyarray(py))
}
