//! Registration: from what several lidars see of the yard to their poses in the world.
//!
//! Two ways: the paper's closed form, lidar by lidar, and one adjustment of everything that is known.

pub mod closed_form;
pub mod field;
pub mod hold;
pub mod judged;
pub mod network;
pub mod normal;
pub mod rows;
pub mod search;
pub mod select;
pub mod sheet;
pub mod sight;
pub mod skyline;
pub mod start;
pub mod state;
pub mod surface;
pub mod survey;
pub mod target;
pub mod variogram;
pub mod wall;
