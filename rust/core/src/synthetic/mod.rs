//! A bending blade of known shape before simulated lidars: truth for tests, benches and `simulate`.
//!
//! It shares no shape code with any estimator: the blade is bent by its own solver from stiffness
//! and loads, and its surface differs from the drawing.

pub mod blade;
pub mod body;
pub mod contour;
pub mod echo;
pub mod family;
pub mod interpolate;
pub mod lidar;
pub mod motion;
pub mod network;
mod packets;
pub mod plan;
pub mod random;
pub mod reference;
pub mod rod;
pub mod sensor;
pub mod shape;
mod sight;
pub mod simulation;
pub mod solver;
pub mod target;
pub mod terrain;
pub mod truth;

pub use plan::ScenePlan;
pub use simulation::Simulation;
