//! Opens captures for `lidar-deflect-core`.
