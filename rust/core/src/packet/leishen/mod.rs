//! Leishen: the C series, whose blocks are those of a Velodyne, and the CH series of mirror sensors.
//!
//! Packets of the C series look like a Velodyne's; length and product byte tell them apart.
//!
//! Source: the maker's driver and the manual of the CH128X1; one real packet of a C16.

pub mod ch;
pub mod cx;
pub mod difop;
pub mod mirror;
pub mod pace;
mod paced;
pub mod products;
