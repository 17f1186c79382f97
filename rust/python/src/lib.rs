//! The border: arrays in, one call into the core, arrays out.
//!
//! A binding function borrows, computes without the interpreter lock, and hands over; it holds no
//! loop over points and no formula.

// Python hands over values, not borrows.
#![allow(clippy::needless_pass_by_value)]

mod arrays;
mod beam;
mod capture;
mod cluster;
mod compute;
mod error;
mod fit;
mod paper;
mod register;
mod synthetic;
mod watch;

use pyo3::prelude::*;

/// The compiled part of `lidar_deflect`; private, its public face is the Python package.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    beam::register(module)?;
    capture::register(module)?;
    cluster::register(module)?;
    fit::register(module)?;
    paper::register(module)?;
    register::register(module)?;
    synthetic::register(module)?;
    watch::register(module)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
