//! The beam method: the blade of a drawing, what the lidars saw of it, and the adjustment of both.

mod adjustment;
mod blade;
mod seen;

use pyo3::prelude::*;

/// Adds this file's classes to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<blade::BeamBlade>()?;
    module.add_class::<seen::BeamSeen>()?;
    module.add_class::<seen::BeamFeed>()?;
    module.add_class::<adjustment::BeamAdjustment>()?;
    Ok(())
}
