//! Loops over cells in the adjustment of a watched lidar's pose.

use lidar_deflect_core::watch::adjust;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays;
use crate::error::BorderResult;

/// Adds this file's functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(pose_design, module)?)?;
    module.add_function(wrap_pyfunction!(median_size, module)?)?;
    module.add_function(wrap_pyfunction!(huber_weighted, module)?)
}

/// How a turn about and a shift along the world axes change each height over its uncertainty, (n, 6), of cells
/// at the ends of rays (n, 3) on surfaces with normals (n, 3).
#[pyfunction]
fn pose_design<'py>(
    py: Python<'py>,
    ray_m: PyReadonlyArray2<'py, f64>,
    normal: PyReadonlyArray2<'py, f64>,
    sigma_m: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray2<f64>>> {
    let ray_m = arrays::points("ray_m", &ray_m)?;
    let normal = arrays::points("normal", &normal)?;
    arrays::expect_rows("normal", normal.len(), ray_m.len())?;
    let sigma_m = arrays::column("sigma_m", &sigma_m, ray_m.len())?;
    Ok(arrays::rows(py, adjust::design(ray_m, normal, sigma_m))?)
}

/// Median of the sizes of values, (n,); NaN without any.
#[pyfunction]
fn median_size(values: PyReadonlyArray1<'_, f64>) -> BorderResult<f64> {
    Ok(adjust::median_size(arrays::values("values", &values)?))
}

/// Weights of cells, and rows times these.
type Weighted<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// Weights by Huber of what is left, (n,), over `square`, and the rows of the design times these, (n, 6).
#[pyfunction]
fn huber_weighted<'py>(
    py: Python<'py>,
    design: PyReadonlyArray2<'py, f64>,
    left: PyReadonlyArray1<'py, f64>,
    limit: f64,
    square: f64,
) -> BorderResult<Weighted<'py>> {
    let design = arrays::columns("design", "shape (n, 6) in C order", &design)?;
    let left = arrays::column("left", &left, design.len())?;
    let weight = adjust::huber(left, limit, square);
    let rows = arrays::rows(py, adjust::weighted(design, &weight))?;
    Ok((weight.into_pyarray(py), rows))
}
