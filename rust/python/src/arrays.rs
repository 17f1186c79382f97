//! Checks on arrays that come in; each message names the argument, what it is and what was expected.

use nalgebra::{Unit, Vector3};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};

use crate::error::BorderResult;
use lidar_deflect_core::error::InvalidValue;

/// Borrows an (n, 3) array in C order as points, without a copy.
pub fn points<'a, T: numpy::Element>(
    name: &'static str,
    array: &'a PyReadonlyArray2<'_, T>,
) -> BorderResult<&'a [[T; 3]]> {
    let refuse = |found: String| InvalidValue {
        name,
        expected: "shape (n, 3) in C order".into(),
        found,
    };
    if array.shape()[1] != 3 {
        return Err(refuse(format!("shape {:?}", array.shape())).into());
    }
    let flat = array
        .as_slice()
        .map_err(|_| refuse("a strided view".into()))?;
    Ok(flat.as_chunks().0)
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
