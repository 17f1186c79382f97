//! The method of Hu, Zhu, Zhou and Liu (Optics 2024, 5, 151-164), step by step.
//!
//! | step | here |
//! |---|---|
//! | 2-4 ground, rotation, yaw | [`crate::register`] |
//! | 5 pass-through | [`passthrough`], side by side [`inside`], told quickly by [`near`] |
//! | frames on the common clock | [`frames`], out of datagrams [`reader`] |
//! | 6 dynamic-radius DBSCAN (9), (10) | [`crate::cluster`] |
//! | 7 extremes of the scan lines | [`crate::blade::contour`] |
//! | 8 spatial line clustering (11)-(13) | [`crate::cluster::line`] |
//! | 9 contour curves (14) | [`curves`] |
//! | 10 tip | [`tip`] |
//! | 11 sections by arc length (15) | [`sections`] |
//! | 6-10 of one frame, put together | [`frame`] |
//! | all frames of a test | [`series`], kept between the passes [`kept`] |

pub mod curves;
pub mod frame;
pub mod frames;
pub mod inside;
pub mod kept;
pub mod near;
pub mod passthrough;
pub mod reader;
pub mod sections;
pub mod series;
pub mod tip;
