"""Sensors without a rotor, from packets that are packed here by the makers' documents."""

import json
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from lidar_deflect import capture
from lidar_deflect.cli.app import run
from packets import START_US, Sent, write_pcap

LIVOX = "192.168.1.3"
ROBOSENSE = "192.168.1.200"


def wall(shot: int) -> tuple[int, int, int]:
    """Point of a wall 20 m ahead, millimetres."""
    return 20_000, 50 * (shot % 96) - 2_400, 10 * (shot % 7)


def mid360(seconds: float) -> Iterator[Sent]:
    """Type 1, 96 points 5 us apart; shot 3 of each packet sees nothing."""
    for number in range(int(seconds / 480e-6)):
        start_us = START_US + 480 * number
        points = b"".join(
            struct.pack("<iiiBB", *((0, 0, 0) if shot == 3 else wall(shot)), shot, 0)
            for shot in range(96)
        )
        header = struct.pack(
            "<BHHHHBBB12xI", 0, 36 + len(points), 4750, 96, number % 65_536, 0, 1, 1, 0
        )
        payload = header + struct.pack("<Q", start_us * 1000) + points
        yield Sent(start_us + 600, LIVOX, payload, 56_301, 56_300)
        if number % 10 == 0:
            inertial = struct.pack("<BHHHHBBB12xI", 0, 60, 0, 1, number, 0, 0, 1, 0)
            inertial += struct.pack("<Q6f", start_us * 1000, *(0.0,) * 6)
            yield Sent(start_us + 601, LIVOX, inertial, 56_301, 56_400)


def avia(seconds: float, sync: int) -> Iterator[Sent]:
    """Type 4, 48 shots of two returns; clock by GNSS (3) or by a pulse per second alone (4)."""
    for number in range(int(seconds / 200e-6)):
        start_us = START_US + 200 * number
        points = b"".join(
            struct.pack("<iiiBB", *wall(shot), 50, 0x10)
            + struct.pack("<iiiBB", *(2 * part for part in wall(shot)), 20, 0x20)
            for shot in range(48)
        )
        # START_US is 2024-06-10 06:13:20 UTC.
        of_hour = start_us - START_US + (13 * 60 + 20) * 1_000_000
        stamp = struct.pack("<BBBBI", 24, 6, 10, 6, of_hour)
        if sync == 4:
            stamp = struct.pack("<Q", start_us % 1_000_000 * 1000)
        payload = struct.pack("<BBBBIBB", 5, 1, 1, 0, 0, sync, 4) + stamp + points
        yield Sent(start_us + 300, LIVOX, payload, 56_001, 65_001)


def e1(seconds: float, counts_from: int) -> Iterator[Sent]:
    """96 points in unit vectors, 288 packets a frame."""
    direction = (0.8, 0.36, 0.48)
    vector = [round(part * 32_768) for part in direction]
    for number in range(int(seconds * 2880)):
        start_us = START_US + number * 1_000_000 // 2880
        header = b"\x55\xaa\x5a\xa5" + struct.pack(">HHBB", number % 288 + counts_from, 1, 4, 3)
        header += struct.pack(">HII", 0, *divmod(start_us, 1_000_000)) + bytes(10) + b"\x62\x64"
        blocks = b"".join(
            struct.pack(">HHhhhBB", 3 * block, 1_000 + block, *vector, block, 1)
            for block in range(96)
        )
        tail = struct.pack(">4xHHII", 1200, number % 65_536, 0xE5C, 0)
        yield Sent(start_us + 500, ROBOSENSE, header + blocks + tail, 6699, 6699)


def columns(opened: capture.Capture) -> dict[str, np.ndarray]:
    sweeps = list(opened.sweeps())
    names = ("xyz", "time_ns", "range_m", "ring", "block", "packet", "return_index", "intensity")
    return {name: np.concatenate([getattr(sweep, name) for sweep in sweeps]) for name in names}


def test_a_mid360_is_found_decoded_and_its_losses_counted(tmp_path: Path) -> None:
    lost = set(range(300, 305)) | {417}
    sent = list(mid360(0.5))
    data = [one for one in sent if len(one.payload) > 60]
    kept = [one for one in sent if one not in [data[number] for number in lost]]
    opened = capture.open(write_pcap(tmp_path / "a.pcap", kept))
    (stream,) = opened.streams
    assert (stream.model, stream.candidates, stream.rpm) == ("mid360", (), None)
    assert (stream.packets, stream.lost) == (len(data) - 6, 6)
    assert (stream.foreign, stream.clock_kind) == (0, "utc")
    found = columns(opened)
    assert len(found["ring"]) == 95 * (len(data) - 6)
    shots = found["block"].astype(int)
    assert 3 not in shots
    expected = np.array([wall(shot) for shot in shots]) / 1000
    np.testing.assert_allclose(found["xyz"], expected, atol=2e-6)
    np.testing.assert_array_equal(found["ring"], shots % 4)
    numbers = np.array([number for number in range(len(data)) if number not in lost])
    start_ns = START_US * 1000 + 480_000 * numbers[found["packet"]]
    np.testing.assert_array_equal(found["time_ns"], start_ns + 5_000 * shots)
    # Frames are tenths of seconds: 208 or 209 packets begin in each.
    sweeps = list(opened.sweeps())
    assert [sweep.packets + sweep.lost for sweep in sweeps[:4]] == [209, 208, 208, 209]


@pytest.mark.parametrize("sync", [3, 4])
def test_both_returns_of_an_avia_and_its_clocks(tmp_path: Path, sync: int) -> None:
    opened = capture.open(write_pcap(tmp_path / "a.pcap", avia(2.5, sync)))
    (stream,) = opened.streams
    assert (stream.model, set(stream.candidates)) == ("avia", {"horizon", "tele15"})
    assert stream.return_mode == "dual (first, second)"
    assert (stream.lost, stream.clock["jumps"], stream.clock_kind) == (0, 0, "utc")
    found = columns(opened)
    second, shots = found["return_index"] == 1, found["block"].astype(int)
    expected = np.array([wall(shot) for shot in shots]) / 1000 * (1 + second)[:, None]
    np.testing.assert_allclose(found["xyz"], expected, atol=4e-6)
    start_ns = START_US * 1000 + 200_000 * found["packet"].astype(int)
    np.testing.assert_array_equal(found["time_ns"], start_ns + shots * 12_500 // 3)


@pytest.mark.parametrize("counts_from", [0, 1])
def test_an_e1_whatever_its_frames_count_from(tmp_path: Path, counts_from: int) -> None:
    sent = list(e1(0.5, counts_from))
    lost = {*range(280, 300), 700}
    kept = [one for number, one in enumerate(sent) if number not in lost]
    opened = capture.open(write_pcap(tmp_path / "a.pcap", kept))
    (stream,) = opened.streams
    assert (stream.model, stream.packets, stream.lost) == ("e1", len(kept), len(lost))
    found = columns(opened)
    range_m = (1_000 + found["intensity"]) * 0.005
    np.testing.assert_allclose(found["range_m"], range_m, rtol=1e-6)
    expected = range_m[:, None] * np.array([0.8, 0.36, 0.48])
    np.testing.assert_allclose(found["xyz"], expected, atol=5e-4)


def test_info_shows_no_turns_of_a_sensor_without_a_rotor(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_pcap(tmp_path / "a.pcap", [*mid360(0.2), *e1(0.2, 0)])
    assert run(["info", str(path), "--json"]) == 0
    streams = json.loads(capsys.readouterr().out)["streams"]
    assert [(one["model"], one["rpm"]) for one in streams] == [("mid360", None), ("e1", None)]
    assert run(["info", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    (row,) = [line.split() for line in lines if line.split()[2:3] == ["mid360"]]
    assert row[2:5] == ["mid360", "single", "-"]
