//! Opens captures for `lidar-deflect-core`: paths, compression, rotated and parallel files.

mod ahead;
mod container;
mod error;
mod gzip;
mod source;

mod member;
mod set;
mod tail;

pub use error::{FileError, Foreign};
pub use member::FileFacts;
pub use set::CaptureSet;
pub use tail::tail;
