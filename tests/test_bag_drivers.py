"""Every driver's message of packets, in every kind of bag, gives the points of the capture."""

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bag_files import KINDS, Bags, Entry, octets
from lidar_deflect import capture
from packets import START_US, Sent, puck, write_pcap
from test_bags import assert_same, points
from test_decode_still import e1, mid360

Make = Callable[[Bags, int, bytes], Any]
"""A message of one packet, by its time in nanoseconds."""


def c16(seconds: float) -> Iterator[Sent]:
    """Leishen C16: two firings of 16 in a block, a turn in a tenth of a second."""
    for number in range(int(seconds / 1.2e-3)):
        start_us = START_US + 1200 * number
        blocks = b"".join(
            b"\xff\xee"
            + struct.pack("<H", (12 * number + block) * 36 % 36_000)
            + struct.pack("<HB", 2_000, 40) * 32
            for block in range(12)
        )
        second, micros = divmod(start_us, 1_000_000)
        day = bytes([24, 6, 10, 6, 13, 20 + second - START_US // 1_000_000])
        tail = day + struct.pack("<I", micros * 1000) + b"\x37\x10"
        yield Sent(start_us + 1300, "192.168.1.200", blocks + tail)


def stamped(name: str, length: int | None = None) -> Make:
    def make(bags: Bags, time_ns: int, payload: bytes) -> Any:
        return bags.message(name, stamp=bags.time(time_ns), data=octets(payload, length))

    return make


def sized(name: str, length: int | None = None) -> Make:
    def make(bags: Bags, time_ns: int, payload: bytes) -> Any:
        data = octets(payload, length)
        return bags.message(name, stamp=bags.time(time_ns), data=data, size=len(payload))

    return make


def scan(name: str, packet: Make) -> Make:
    def make(bags: Bags, time_ns: int, payload: bytes) -> Any:
        packets = [packet(bags, time_ns, payload)]
        return bags.message(name, header=bags.header(time_ns), packets=packets)

    return make


def udp_frame(bags: Bags, time_ns: int, payload: bytes) -> Any:
    packet = bags.message(
        "hesai_ros_driver/msg/UdpPacket", data=octets(payload, 1500), size=len(payload)
    )
    name = "hesai_ros_driver/msg/UdpFrame"
    return bags.message(name, header=bags.header(time_ns), packets=[packet])


def rslidar(name: str) -> Make:
    def make(bags: Bags, time_ns: int, payload: bytes) -> Any:
        header, data = bags.header(time_ns), octets(payload)
        return bags.message(name, header=header, is_difop=0, is_frame_begin=0, data=data)

    return make


def buffer(name: str) -> Make:
    return lambda bags, _, payload: bags.message(name, buf=octets(payload))


NEBULA = "nebula_msgs/msg/NebulaPacket"
DRIVERS: dict[str, tuple[Make, Callable[[float], Iterator[Sent]], str]] = {
    "velodyne_msgs/msg/VelodynePacket": (
        stamped("velodyne_msgs/msg/VelodynePacket"),
        puck,
        "vlp16",
    ),
    f"{NEBULA}s": (scan(f"{NEBULA}s", stamped(NEBULA)), puck, "vlp16"),
    "pandar_msgs/msg/PandarJumboPacket": (
        sized("pandar_msgs/msg/PandarJumboPacket"),
        puck,
        "vlp16",
    ),
    "hesai_ros_driver/msg/UdpFrame": (udp_frame, puck, "vlp16"),
    "rslidar_msg/msg/RslidarPacket": (
        rslidar("rslidar_msg/msg/RslidarPacket"),
        lambda s: e1(s, 0),
        "e1",
    ),
    "ouster_sensor_msgs/msg/PacketMsg": (
        buffer("ouster_sensor_msgs/msg/PacketMsg"),
        mid360,
        "mid360",
    ),
    "lslidar_msgs/msg/LslidarPacket": (stamped("lslidar_msgs/msg/LslidarPacket"), c16, "c16"),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", DRIVERS)
def test_packets_of_a_driver_give_the_points_of_the_capture(
    name: str, kind: str, tmp_path: Path
) -> None:
    make, packets, model = DRIVERS[name]
    writer = Bags(kind)
    # What lies beside data, such as accelerations, is of no message here.
    sent = [one for one in packets(0.3) if len(one.payload) > 60]
    entries: list[Entry] = [
        ("/tower/packets", name, one.time_us * 1000, make(writer, one.time_us * 1000, one.payload))
        for one in sent
    ]
    bag = writer.write(tmp_path / "run", entries)
    ours = points(bag, tmp_path / "bag.parquet")
    assert_same(ours, points(write_pcap(tmp_path / "run.pcap", sent), tmp_path / "pcap.parquet"))
    (stream,) = capture.open(bag).streams
    assert (stream.model, stream.source) == (model, "/tower/packets")
    assert (stream.packets, stream.lost) == (len(sent), 0)
