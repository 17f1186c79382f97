"""Packets that cannot be decoded: told by name, with what to do."""

import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from lidar_deflect import capture
from lidar_deflect.errors import CaptureError
from packets import START_US, Sent, write_pcap


def stream(payload: bytes, port: int = 6699, count: int = 40) -> Iterator[Sent]:
    for number in range(count):
        yield Sent(START_US + 1000 * number, "192.168.1.201", payload, port)


def refusal(tmp_path: Path, payload: bytes) -> CaptureError:
    path = write_pcap(tmp_path / "tower.pcap", stream(payload))
    with pytest.raises(CaptureError) as caught:
        capture.open(path).scan()
    assert caught.value.code == "capture.no_lidar"
    return caught.value


def closest(error: CaptureError) -> str:
    return dict(error.facts)["closest"]


def solid(kind: int, length: int) -> bytes:
    """A packet of a solid RoboSense with the type byte at 30."""
    head = bytearray(b"\x55\xaa\x5a\xa5".ljust(32, b"\0"))
    head[30] = kind
    return bytes(head).ljust(length, b"\1")


@pytest.mark.parametrize(
    ("payload", "told"),
    [
        (solid(0x70, 700), "RoboSense EM4 that compresses its packets"),
        (b"\x55\xaa\x5a\x02".ljust(400, b"\0"), "packets of fixed length (1084 bytes)"),
        (solid(0x99, 700), "solid RoboSense sensor of type 0x99"),
        (b"\xee\xff\x02\x05\0\0\x28\x04".ljust(900, b"\0"), "Hesai protocol 2.5"),
        (b"\xee\xff\x14\x14".ljust(1270, b"\0"), "Hesai Pandar20A or Pandar20B"),
    ],
)
def test_formats_that_are_not_decoded_are_told_by_name(
    tmp_path: Path, payload: bytes, told: str
) -> None:
    error = refusal(tmp_path, payload)
    assert told in closest(error)
    assert "export points" in closest(error)
    assert "--sensor" not in str(error.hint)


def ouster_motion() -> bytes:
    stamps = struct.pack("<3Q", 5_000_000_000, 5_000_100_000, 5_000_200_000)
    return stamps + struct.pack("<6f", 0.01, -0.02, 1.0, 0.3, -0.1, 4.0)


def test_packets_of_motion_alone_are_told_for_what_they_are(tmp_path: Path) -> None:
    error = refusal(tmp_path, ouster_motion())
    assert "packets of accelerations and turn rates of Ouster" in closest(error)
    assert error.hint == "record the sensor's data packets as well: they go to another port"


def test_position_packets_alone_are_told_for_what_they_are(tmp_path: Path) -> None:
    sentence = b"$GPRMC,081802.00,A,3649.7478,N,00224.4542,W,0.0,212.5,210116,0.0,E,A*2E"
    payload = bytes(206) + sentence + bytes(512 - 206 - len(sentence))
    error = refusal(tmp_path, payload)
    assert "position packets of Velodyne, which carry no points" in closest(error)
