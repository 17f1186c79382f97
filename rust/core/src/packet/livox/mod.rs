//! Livox: shots of prisms that scan on and on without frames, little endian; all calibration is done in
//! the sensor.
//!
//! Two protocols: that of the first development kit (Mid-40, Mid-70, Tele-15, Horizon, Avia) and that of
//! the second (Mid-360, HAP). Points come in the sensor frame: x forward, y left, z up.
//!
//! Sources: the maker's communication protocols and drivers.

pub mod account;
mod decoder;
mod lanes;
pub mod points;
pub mod sdk1;
pub mod sdk2;
pub mod sensor;
pub mod shots;
