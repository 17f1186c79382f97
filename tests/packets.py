"""Small captures of a VLP-16, written byte by byte."""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

START_US = 1_718_000_000_000_000
PERIOD_NS = 1_327_104


@dataclass(frozen=True)
class Sent:
    """One UDP datagram."""

    time_us: int
    source: str
    payload: bytes
    port: int = 2368
    source_port: int = 2368


def puck(
    seconds: float = 0.5,
    *,
    source: str = "192.168.1.201",
    product: int = 0x22,
    mode: int = 0x37,
    start_us: int = START_US,
    clock_us: int = 0,
    source_port: int = 2368,
) -> Iterator[Sent]:
    """Packets of a sensor at 600 rpm that sees a wall 10 m around it.

    `clock_us` sets its clock off; in dual return (`mode` 0x39) both returns are the same.
    """
    repeat = 2 if mode == 0x39 else 1
    rows, period_ns = 12 // repeat, PERIOD_NS // repeat
    for number in range(int(seconds * 1e9 / period_ns)):
        sent_us = start_us + number * period_ns // 1000
        blocks = (_block(number * rows + place) * repeat for place in range(rows))
        past_hour_us = (sent_us + clock_us) % 3_600_000_000
        payload = b"".join(blocks) + struct.pack("<IBB", past_hour_us, mode, product)
        arrival_us = sent_us + period_ns // 1000 + 173
        yield Sent(arrival_us, source, payload, source_port=source_port)


def _block(row: int) -> bytes:
    azimuth = round(row * 110_592 * 3.6e-4) % 36_000
    return b"\xff\xee" + struct.pack("<H", azimuth) + struct.pack("<HB", 5_000, 40) * 32


def write_pcap(path: Path, sent: Iterable[Sent]) -> Path:
    """Write a capture with Ethernet, IPv4 and UDP headers, in the order of time."""
    with path.open("wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1))
        for one in sorted(sent, key=lambda one: one.time_us):
            file.write(_record(one))
    return path


def _record(one: Sent) -> bytes:
    udp = struct.pack(">HHHH", one.source_port, one.port, 8 + len(one.payload), 0) + one.payload
    addresses = bytes(map(int, one.source.split("."))) + bytes((192, 168, 1, 100))
    ip = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0) + addresses
    frame = bytes(12) + b"\x08\x00" + ip + udp
    seconds, micros = divmod(one.time_us, 1_000_000)
    return struct.pack("<IIII", seconds, micros, len(frame), len(frame)) + frame
