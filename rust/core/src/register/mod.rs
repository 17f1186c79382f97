//! Registration: from what several lidars see of the yard to their poses in the world.

pub mod closed_form;
pub mod wall;
