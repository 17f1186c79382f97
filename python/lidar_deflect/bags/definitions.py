"""Messages that carry lidar data: which they are, and how they are laid out.

ROS 1 bags, MCAP files and newer SQLite bags bring the layout of their messages along. Older SQLite
bags do not: for those the layouts that the drivers publish stand here.
"""

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosbags.interfaces import Connection
    from rosbags.typesys.store import Typestore

__all__ = ["CLOUD", "CUSTOM", "METADATA", "PACKETS", "role", "store"]

PACKETS = "packets"
CLOUD = "cloud"
CUSTOM = "custom"
METADATA = "metadata"

PACKET_TYPES = re.compile(
    r"(velodyne_msgs/msg/Velodyne(Scan|Packet)"
    r"|(pandar|hesai)_msgs/msg/Pandar(Scan|Packet|JumboPacket)"
    r"|hesai_ros_driver/msg/Udp(Frame|Packet)"
    r"|nebula_msgs/msg/NebulaPackets?"
    r"|robosense_msgs/msg/Robosense(Scan|Packet|InfoPacket)"
    r"|rslidar_msgs?/msg/[rR]slidar(Scan|Packet)"
    r"|(ouster_ros|ouster_sensor_msgs|ouster_msgs)/msg/PacketMsg"
    r"|lslidar(_c16|_c32|_ch)?_msgs/msg/Lslidar(\w*)Packet"
    r"|livox_msgs/msg/Lidar(Scan|Packet))"
)
CLOUD_TYPE = "sensor_msgs/msg/PointCloud2"
CUSTOM_TYPES = re.compile(r"livox_(ros_driver2?|interfaces)/msg/CustomMsg")
STRING_TYPE = "std_msgs/msg/String"

HEADER = "std_msgs/Header header\n"
STAMP = "builtin_interfaces/Time stamp\n"
LAYOUTS = {
    "velodyne_msgs/msg/VelodynePacket": STAMP + "uint8[1206] data\n",
    "velodyne_msgs/msg/VelodyneScan": HEADER + "velodyne_msgs/VelodynePacket[] packets\n",
    "pandar_msgs/msg/PandarPacket": STAMP + "uint8[1500] data\nuint32 size\n",
    "pandar_msgs/msg/PandarJumboPacket": STAMP + "uint8[] data\nuint32 size\n",
    "pandar_msgs/msg/PandarScan": HEADER + "pandar_msgs/PandarPacket[] packets\n",
    "nebula_msgs/msg/NebulaPacket": STAMP + "uint8[] data\n",
    "nebula_msgs/msg/NebulaPackets": HEADER + "nebula_msgs/NebulaPacket[] packets\n",
    "robosense_msgs/msg/RobosensePacket": STAMP + "uint8[1248] data\n",
    "robosense_msgs/msg/RobosenseScan": HEADER + "robosense_msgs/RobosensePacket[] packets\n",
    "robosense_msgs/msg/RobosenseInfoPacket": "string lidar_model\n"
    "robosense_msgs/RobosensePacket packet\n",
    **{
        f"{package}/msg/RslidarPacket": HEADER
        + "uint8 is_difop\nuint8 is_frame_begin\nuint8[] data\n"
        for package in ("rslidar_msg", "rslidar_msgs")
    },
    **{
        f"{package}/msg/PacketMsg": "uint8[] buf\n"
        for package in ("ouster_ros", "ouster_sensor_msgs", "ouster_msgs")
    },
    "lslidar_msgs/msg/LslidarPacket": STAMP + "uint8[1212] data\n",
}


def role(topic: str, kind: str) -> str | None:
    """Tell what a topic carries: `PACKETS`, `CLOUD`, `CUSTOM`, `METADATA`, or None."""
    if PACKET_TYPES.fullmatch(kind):
        return PACKETS
    if CUSTOM_TYPES.fullmatch(kind):
        return CUSTOM
    if kind == CLOUD_TYPE:
        return CLOUD
    is_metadata = kind == STRING_TYPE and topic.rsplit("/", 1)[-1] == "metadata"
    return METADATA if is_metadata else None


def store(connections: "Iterable[Connection]", *, is_ros1: bool) -> "Typestore":
    """Make what deserialises the messages of some connections, by their own layouts first."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    known = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
    given: dict[str, object] = {}
    for name, text in LAYOUTS.items():
        given |= get_types_from_msg(text, name)
    for connection in connections:
        definition = connection.msgdef
        if definition.format == MessageDefinitionFormat.MSG:
            given |= get_types_from_msg(definition.data, connection.msgtype)
        elif definition.format == MessageDefinitionFormat.IDL:
            given |= _from_idl(definition.data)
    # Headers and times are the store's own: their layout never changed.
    added = {name: fields for name, fields in given.items() if name not in known.fielddefs}
    known.register(added)  # type: ignore[arg-type]
    return known


def _from_idl(text: str) -> dict[str, object]:
    from rosbags.typesys import get_types_from_idl

    found: dict[str, object] = {}
    for part in text.split("=" * 80 + "\n"):
        body = part.split("\n", 1)[1] if part.startswith("IDL: ") else part
        if body.strip():
            found |= get_types_from_idl(body)
    return found
