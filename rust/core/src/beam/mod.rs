//! The beam method: a blade that bends as blades bend, fitted to rays and edges of all lidars.
//!
//! [`design`] and [`mesh`] hold the drawing, [`equilibrium`], [`tangent`] and [`family`] say which states it can
//! have, [`axis`] keeps its length, [`sight`] and [`silhouette`] meet it with rays and scan planes, [`adjust`] puts
//! everything into one adjustment, [`common`] says what neighbouring data share, [`track`] follows the blade between
//! holds, [`clocks`] compares the lidars' clocks while it moves, and [`carry`] tells how well each instant is
//! known. Source: docs/method.md.

pub mod adjust;
pub mod axis;
mod bill;
mod blank;
pub mod budget;
pub mod carry;
pub mod clocks;
pub mod common;
mod descend;
pub mod design;
pub mod echoes;
pub mod equilibrium;
pub mod factor;
pub mod family;
mod few;
pub mod gather;
mod keep;
pub mod layout;
pub mod mesh;
pub mod near;
pub mod normal;
pub mod outline;
pub mod pairs;
pub mod panel;
pub mod posed;
mod prior;
pub mod rig;
pub mod rows;
#[cfg(test)]
mod sample;
pub mod sections;
pub mod seek;
pub mod shape;
pub mod sight;
pub mod silhouette;
mod smooth;
pub mod solution;
pub mod start;
pub mod step;
pub mod sums;
mod table;
pub mod tangent;
pub mod track;
mod triangle;
pub mod weights;
