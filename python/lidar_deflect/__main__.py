"""``python -m lidar_deflect`` is ``lidar-deflect``."""

from lidar_deflect.cli import main

main()
