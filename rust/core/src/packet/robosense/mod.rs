//! RoboSense: blocks of channels behind a header, big endian; the angles of the unit come in packets of
//! their own (DIFOP), about one a second.
//!
//! Source: the maker's product manuals and driver.

pub mod airy;
pub mod bpearl;
pub mod difop;
pub mod helios;
pub mod layout;
pub mod rotating;
pub mod rs;
pub mod ruby;
pub mod solid;
pub mod table;
pub mod writer;
