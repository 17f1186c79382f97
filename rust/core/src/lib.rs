//! The numbers of lidar-deflect: from the bytes of a capture to the shape of a blade.
//!
//! The library opens no file, prints nothing, reads no clock and has never heard of Python.
//! Modules in reading order, foundations first; a module uses what stands above it, never below.

pub mod angle;
pub mod drops;
pub mod error;
pub mod time;

pub mod cloud;
pub mod frame;
mod simd;
pub mod stand;

pub mod capture;
pub mod clock;
pub mod loss;
pub mod packet;
pub mod stream;
pub mod sweep;
pub mod watch;

pub mod fit;
pub mod neighbors;

pub mod cluster;
pub mod register;

pub mod beam;
pub mod blade;
pub mod paper;

pub mod synthetic;
