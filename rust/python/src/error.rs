//! Errors of the core become the exceptions of `lidar_deflect.errors`.

use lidar_deflect_core::error::{
    BeamError, CaptureError, ClusterError, Coded, FitError, InvalidValue, ReadError, UnitError,
};
use lidar_deflect_core::paper::tip::NoTip;
use lidar_deflect_core::register::network::NetworkError;
use lidar_deflect_core::register::wall::WallError;
use lidar_deflect_files::FileError;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Result of every binding function: `?` works on errors of the core and of Python alike.
pub type BorderResult<T> = Result<T, BorderError>;

/// Anything that may go wrong on the way to Python.
pub struct BorderError(PyErr);

impl From<PyErr> for BorderError {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

/// Becomes an `OSError` with its number, which the caller in Python turns into what it meant to do.
impl From<std::io::Error> for BorderError {
    fn from(error: std::io::Error) -> Self {
        Self(error.into())
    }
}

impl From<BorderError> for PyErr {
    fn from(error: BorderError) -> Self {
        error.0
    }
}

/// Which exception class stands for which family of the core.
macro_rules! translate {
    ($($family:ty => $class:literal),* $(,)?) => {$(
        impl From<$family> for BorderError {
            fn from(error: $family) -> Self {
                Self(raise($class, &error))
            }
        }
    )*};
}

translate! {
    BeamError => "MeasurementError",
    CaptureError => "CaptureError",
    ClusterError => "InvalidValueError",
    FitError => "MeasurementError",
    InvalidValue => "InvalidValueError",
    ReadError => "InvalidValueError",
    UnitError => "InvalidValueError",
    NetworkError => "CalibrationError",
    NoTip => "MeasurementError",
    WallError => "CalibrationError",
}

/// A missing file is also Python's own `FileNotFoundError`.
impl From<FileError> for BorderError {
    fn from(error: FileError) -> Self {
        let class = match error.is_not_found() {
            true => "CaptureNotFoundError",
            false => "CaptureError",
        };
        Self(raise(class, &error))
    }
}

/// An instance of `lidar_deflect.errors.<class>` with message, code and hint.
fn raise(class: &str, error: &dyn Coded) -> PyErr {
    let build = |py: Python<'_>| -> PyResult<PyErr> {
        let options = PyDict::new(py);
        options.set_item("code", error.code())?;
        options.set_item("hint", error.hint())?;
        let errors = py.import("lidar_deflect.errors")?;
        let value = errors
            .getattr(class)?
            .call((error.to_string(),), Some(&options))?;
        Ok(PyErr::from_value(value))
    };
    Python::attach(build).unwrap_or_else(|_| PyRuntimeError::new_err(error.to_string()))
}
