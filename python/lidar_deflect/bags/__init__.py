"""ROS bags as captures: ROS 1, ROS 2 in SQLite, MCAP.

What a bag holds of lidars is written once into temporary captures, one per topic, which the
compiled core then reads as any other: memory stays bounded however large the bag, and every later
pass costs what it costs for a capture. Needs the extra ``ros``.
"""

from lidar_deflect.bags.kinds import kind_of, located, require
from lidar_deflect.bags.topics import Topics
from lidar_deflect.bags.unpack import Unpacked, looks, unpack

__all__ = ["Topics", "Unpacked", "kind_of", "located", "looks", "require", "unpack"]
