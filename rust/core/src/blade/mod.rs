//! The blade: what its scan lines show of it.

pub mod contour;
