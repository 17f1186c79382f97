//! Checks on arrays that come in; each message names the argument, what it is and what was expected.

use nalgebra::{Matrix4, Unit, Vector3};
use numpy::ndarray::Dimension;
use numpy::{
    IntoPyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray, PyReadonlyArray1,
    PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::error::BorderResult;
use lidar_deflect_core::error::InvalidValue;
use lidar_deflect_core::frame::WorldFromSensor;
use lidar_deflect_core::stand::Move;

/// A cloud as it comes: positions as stored or as computed.
#[derive(pyo3::FromPyObject)]
pub enum Cloud<'py> {
    Narrow(PyReadonlyArray2<'py, f32>),
    Wide(PyReadonlyArray2<'py, f64>),
}

/// Runs `$work` on the points of a [`Cloud`], whichever their type.
macro_rules! with_points {
    ($cloud:expr, |$points:ident| $work:expr) => {
        match $cloud {
            $crate::arrays::Cloud::Narrow(array) => {
                let $points = $crate::arrays::points("xyz", array)?;
                $work
            }
            $crate::arrays::Cloud::Wide(array) => {
                let $points = $crate::arrays::points("xyz", array)?;
                $work
            }
        }
    };
}
pub(crate) use with_points;

/// Borrows an (n, 3) array in C order as points, without a copy.
pub fn points<'a, T: numpy::Element>(
    name: &'static str,
    array: &'a PyReadonlyArray2<'_, T>,
) -> BorderResult<&'a [[T; 3]]> {
    columns(name, "shape (n, 3) in C order", array)
}

/// The rows of a table of so many columns; `expected` says that in words.
pub fn columns<'a, T: numpy::Element, const N: usize>(
    name: &'static str,
    expected: &'static str,
    array: &'a PyReadonlyArray2<'_, T>,
) -> BorderResult<&'a [[T; N]]> {
    let is_wide = array.shape()[1] == N;
    Ok(flat(name, expected, is_wide, array)?.as_chunks().0)
}

/// Borrows a contiguous array of `len` values, without a copy.
pub fn column<'a, T: numpy::Element>(
    name: &'static str,
    array: &'a PyReadonlyArray1<'_, T>,
    len: usize,
) -> BorderResult<&'a [T]> {
    let refuse = |found: String| InvalidValue {
        name,
        expected: format!("{len} contiguous values"),
        found,
    };
    let values = array
        .as_slice()
        .map_err(|_| refuse("a strided view".into()))?;
    if values.len() != len {
        return Err(refuse(format!("{} values", values.len())).into());
    }
    Ok(values)
}

/// Reads a direction of three numbers and makes it a unit vector.
pub fn direction(
    name: &'static str,
    array: &PyReadonlyArray1<'_, f64>,
) -> BorderResult<Unit<Vector3<f64>>> {
    let values = column(name, array, 3)?;
    let vector = Vector3::new(values[0], values[1], values[2]);
    Unit::try_new(vector, 1e-9)
        .filter(|unit| unit.iter().all(|v| v.is_finite()))
        .ok_or_else(|| {
            let found = format!("{values:?}");
            InvalidValue {
                name,
                expected: "a direction of finite length".into(),
                found,
            }
            .into()
        })
}

/// Borrows a contiguous array of any length, without a copy.
pub fn values<'a, T: numpy::Element>(
    name: &'static str,
    array: &'a PyReadonlyArray1<'_, T>,
) -> BorderResult<&'a [T]> {
    column(name, array, array.len())
}

/// Borrows an (n, 2) array in C order, without a copy.
pub fn pairs<'a>(
    name: &'static str,
    array: &'a PyReadonlyArray2<'_, f64>,
) -> BorderResult<&'a [[f64; 2]]> {
    Ok(flat(
        name,
        "shape (n, 2) in C order",
        array.shape()[1] == 2,
        array,
    )?
    .as_chunks()
    .0)
}

/// Reads an array of `count` homogeneous matrices.
pub fn matrices(
    name: &'static str,
    array: &PyReadonlyArray3<'_, f64>,
    count: usize,
) -> BorderResult<Vec<Matrix4<f64>>> {
    let fits = array.shape() == [count, 4, 4];
    let flat = flat(name, "one 4 x 4 matrix per lidar in C order", fits, array)?;
    Ok(flat.chunks_exact(16).map(Matrix4::from_row_slice).collect())
}

/// A tripod that was moved: its lidar, when it left, since when it stands again, the pose there.
pub type MoveRow = (usize, i64, i64, [[f64; 4]; 4]);

/// Reads moves; their poses are checked.
pub fn moves(rows: &[MoveRow]) -> BorderResult<Vec<Move>> {
    let read = |(lidar, left_ns, from_ns, pose): &MoveRow| {
        let matrix = Matrix4::from_fn(|row, column| pose[row][column]);
        Ok(Move {
            lidar: *lidar,
            left_ns: *left_ns,
            from_ns: *from_ns,
            pose: WorldFromSensor::from_matrix(&matrix)?,
        })
    };
    rows.iter().map(read).collect()
}

/// Refuses another number of rows than expected.
pub fn expect_rows(name: &'static str, found: usize, expected: usize) -> BorderResult<()> {
    if found == expected {
        return Ok(());
    }
    let (expected, found) = (format!("{expected} rows"), format!("{found} rows"));
    Err(InvalidValue {
        name,
        expected,
        found,
    }
    .into())
}

fn flat<'a, T: numpy::Element, D: Dimension>(
    name: &'static str,
    expected: &str,
    fits: bool,
    array: &'a PyReadonlyArray<'_, T, D>,
) -> BorderResult<&'a [T]> {
    let refuse = |found: String| InvalidValue {
        name,
        expected: expected.into(),
        found,
    };
    if !fits {
        return Err(refuse(format!("shape {:?}", array.shape())).into());
    }
    Ok(array
        .as_slice()
        .map_err(|_| refuse("a strided view".into()))?)
}

/// Hands over rows of a fixed number of columns, (n, N), without a copy.
pub fn rows<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    table(py, rows.into_flattened(), N)
}

/// Hands over values as (n, columns), without a copy.
pub fn table<T: numpy::Element>(
    py: Python<'_>,
    values: Vec<T>,
    columns: usize,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let rows = values.len() / columns.max(1);
    values.into_pyarray(py).reshape([rows, columns])
}

/// Hands over points as (n, columns, 3), without a copy.
pub fn tables<'py>(
    py: Python<'py>,
    points: Vec<[f64; 3]>,
    columns: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let rows = points.len() / columns.max(1);
    points
        .into_flattened()
        .into_pyarray(py)
        .reshape([rows, columns, 3])
}
