"""The `lidar-deflect` command."""
