"""Bags written by the library of their makers, from packets that are written as captures too."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KINDS = ("bag", "db3", "mcap")

HEADER = "std_msgs/Header header\n"
STAMPED = "builtin_interfaces/Time stamp\n"
TEXTS = {
    "velodyne_msgs/msg/VelodynePacket": STAMPED + "uint8[1206] data\n",
    "velodyne_msgs/msg/VelodyneScan": HEADER + "velodyne_msgs/VelodynePacket[] packets\n",
    "pandar_msgs/msg/PandarPacket": STAMPED + "uint8[1500] data\nuint32 size\n",
    "pandar_msgs/msg/PandarScan": HEADER + "pandar_msgs/PandarPacket[] packets\n",
    "pandar_msgs/msg/PandarJumboPacket": STAMPED + "uint8[] data\nuint32 size\n",
    "hesai_ros_driver/msg/UdpPacket": "uint8[1500] data\nuint32 size\n",
    "hesai_ros_driver/msg/UdpFrame": HEADER + "hesai_ros_driver/UdpPacket[] packets\n",
    "nebula_msgs/msg/NebulaPacket": STAMPED + "uint8[] data\n",
    "nebula_msgs/msg/NebulaPackets": HEADER + "nebula_msgs/NebulaPacket[] packets\n",
    "lslidar_msgs/msg/LslidarPacket": STAMPED + "uint8[1212] data\n",
    "ouster_ros/msg/PacketMsg": "uint8[] buf\n",
    "ouster_sensor_msgs/msg/PacketMsg": "uint8[] buf\n",
    "rslidar_msg/msg/RslidarPacket": HEADER
    + "uint8 is_difop\nuint8 is_frame_begin\nuint8[] data\n",
    "rslidar_msgs/msg/rslidarPacket": STAMPED + "uint8[1248] data\n",
    "rslidar_msgs/msg/rslidarScan": HEADER + "rslidar_msgs/rslidarPacket[] packets\n",
    "livox_ros_driver2/msg/CustomPoint": "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\n"
    "uint8 reflectivity\nuint8 tag\nuint8 line\n",
    "livox_ros_driver2/msg/CustomMsg": HEADER + "uint64 timebase\nuint32 point_num\n"
    "uint8 lidar_id\nuint8[3] rsvd\nlivox_ros_driver2/CustomPoint[] points\n",
}

Entry = tuple[str, str, int, Any]
"""Topic, type, time of the bag in nanoseconds, and what makes the message of a store's types."""


class Bags:
    """Writes messages as one kind of bag."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        stores = {"bag": Stores.ROS1_NOETIC, "db3": Stores.ROS2_HUMBLE, "mcap": Stores.ROS2_JAZZY}
        self.store = get_typestore(stores[kind])
        types: dict[str, Any] = {}
        for name, text in TEXTS.items():
            types |= get_types_from_msg(text, name)
        self.store.register(types)
        self.types = self.store.types

    def time(self, time_ns: int) -> Any:
        seconds, nanos = divmod(time_ns, 1_000_000_000)
        return self.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanos)

    def header(self, time_ns: int, frame: str = "lidar") -> Any:
        count = {"seq": 0} if self.kind == "bag" else {}
        return self.types["std_msgs/msg/Header"](**count, stamp=self.time(time_ns), frame_id=frame)

    def message(self, kind: str, **fields: Any) -> Any:
        return self.types[kind](**fields)

    def write(self, path: Path, entries: Iterable[Entry]) -> Path:
        """Write a bag; gives its storage file."""
        if self.kind == "bag":
            return self._ros1(path, entries)
        plugins = {"db3": rosbag2.StoragePlugin.SQLITE3, "mcap": rosbag2.StoragePlugin.MCAP}
        with rosbag2.Writer(path, version=9, storage_plugin=plugins[self.kind]) as writer:
            topics: dict[str, Any] = {}
            for topic, kind, time_ns, message in entries:
                if topic not in topics:
                    topics[topic] = writer.add_connection(topic, kind, typestore=self.store)
                writer.write(topics[topic], time_ns, self.store.serialize_cdr(message, kind))
        return next(path.glob(f"*.{self.kind}"))

    def _ros1(self, path: Path, entries: Iterable[Entry]) -> Path:
        file = path.with_suffix(".bag")
        writer = rosbag1.Writer(file)
        writer.set_compression(rosbag1.Writer.CompressionFormat.LZ4)
        with writer:
            topics: dict[str, Any] = {}
            for topic, kind, time_ns, message in entries:
                if topic not in topics:
                    topics[topic] = writer.add_connection(topic, kind, typestore=self.store)
                raw = self.store.serialize_ros1(message, kind)
                writer.write(topics[topic], time_ns, raw)
        return file


def octets(payload: bytes, length: int | None = None) -> np.ndarray:
    """Bytes as a message holds them, padded to a fixed length."""
    return np.frombuffer(payload.ljust(length or 0, b"\0"), np.uint8)
