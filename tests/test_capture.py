import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lidar_deflect import capture
from lidar_deflect.errors import CaptureError, CaptureNotFoundError, InvalidValueError
from packets import PERIOD_NS, START_US, Sent, puck, write_pcap
from scenes import SCENES


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two lidars, of which one loses packets, and foreign datagrams."""
    first = list(puck(2.0))
    second = [
        one for n, one in enumerate(puck(2.0, source="192.168.1.202")) if n not in (300, 301, 900)
    ]
    foreign = [Sent(START_US + n * 100_000, "192.168.1.202", b"hello") for n in range(20)]
    path = tmp_path_factory.mktemp("two") / "two.pcap"
    return write_pcap(path, [*first, *second, *foreign])


def test_streams_tell_what_the_capture_holds(two: Path) -> None:
    opened = capture.open(two)
    assert "not read yet" in repr(opened)
    assert opened.lidars == ("192.168.1.201:2368", "192.168.1.202:2368")
    first, second = opened.streams
    assert (first.model, first.candidates, first.return_mode) == (
        "vlp16",
        ("puck-lite",),
        "strongest",
    )
    assert (first.lost, first.foreign, first.packets) == (0, 0, 1507)
    assert (second.lost, second.foreign, second.packets) == (3, 20, 1504)
    assert first.points == 1507 * 384
    assert first.rpm == pytest.approx(600, abs=0.2)
    assert first.clock["kind"] == "utc"
    assert opened.first_time_ns == START_US * 1000
    assert opened.drops["foreign"] == 20
    assert "2 lidars, 2.0 s" in repr(opened)
    assert opened._repr_html_().count("<tr>") == 3


def test_info_is_one_document(two: Path) -> None:
    document = json.loads(json.dumps(capture.open(two).info()))
    assert document["schema"].startswith("lidar-deflect.info/")
    keys = {"source", "port", "model", "candidates", "return_mode", "rpm", "packets", "lost"}
    keys |= {"duplicated", "late", "foreign", "first_utc", "last_utc", "clock", "beams", "notes"}
    assert all(keys <= stream.keys() for stream in document["streams"])
    assert document["streams"][0]["first_utc"] == "2024-06-10T06:13:20.000000000Z"
    assert {"reason": "foreign", "count": 20} in document["drops"]
    assert document["captures"][0]["records"] == 1507 + 1504 + 20


def test_quick_info_reads_head_and_tail(tmp_path: Path) -> None:
    path = write_pcap(tmp_path / "long.pcap", puck(20.0))
    document = capture.open(path).info(quick=True)
    whole = capture.open(path)
    stream = document["streams"][0]
    assert document["quick"]
    assert 1500 < stream["packets"] < 1520
    assert stream["model"] == "vlp16"
    assert stream["last_utc"] == document["last_utc"] == whole.info()["last_utc"]
    assert document["first_utc"] == whole.info()["first_utc"]
    short = write_pcap(tmp_path / "short.pcap", puck(0.3))
    assert capture.open(short).info(quick=True)["last_utc"] is None
    assert not whole.info(quick=True)["quick"]  # it was read already


def test_sweeps_are_turns_with_columns_of_one_length(two: Path) -> None:
    opened = capture.open(two)
    sweeps = list(opened.sweeps("192.168.1.202", cut_azimuth_deg=90.0))
    assert [sweep.index for sweep in sweeps] == list(range(len(sweeps)))
    assert sum(sweep.packets for sweep in sweeps) == 1504
    assert sum(sweep.lost for sweep in sweeps) == 3
    whole = sweeps[5]
    assert whole.lidar == "192.168.1.202:2368"
    assert whole.xyz.shape == (len(whole), 3)
    assert whole.xyz.dtype == np.float32
    for name in ("time_ns", "ring", "range_m", "azimuth_deg", "intensity", "return_index"):
        assert getattr(whole, name).shape == (len(whole),)
    for name in ("return_kind", "packet", "block"):
        assert getattr(whole, name).shape == (len(whole),)
    after_cut = (whole.azimuth_deg - 90.0) % 360.0
    assert after_cut[0] < 0.1
    assert after_cut[-1] > 359.9
    np.testing.assert_allclose(whole.range_m, 10.0, atol=1e-6)
    # Positions are what range, azimuth and ring say (x forward, y left, azimuth clockwise).
    azimuth = np.radians(whole.azimuth_deg.astype(float))
    elevation = np.radians(2.0 * whole.ring - 15.0)
    level = 10.0 * np.cos(elevation)
    np.testing.assert_allclose(whole.xyz[:, 0], level * np.cos(azimuth), atol=2e-5)
    np.testing.assert_allclose(whole.xyz[:, 1], -level * np.sin(azimuth), atol=2e-5)
    height = 10.0 * np.sin(elevation) - 0.04191 * np.tan(elevation)
    np.testing.assert_allclose(whole.xyz[:, 2], height, atol=2e-6)
    lossy = next(sweep for sweep in sweeps if sweep.lost == 2)
    assert lossy.coverage == pytest.approx(1 - 2 * 4.7776 / 360, abs=1e-3)
    assert "2 lost" in repr(lossy)


def test_times_choose_packets_and_all_lidars_come_merged(two: Path) -> None:
    opened = capture.open(two)
    part = list(opened.sweeps(start_s=0.5, stop_s=1.0))
    assert {sweep.lidar for sweep in part} == set(opened.lidars)
    times = np.concatenate([sweep.time_ns for sweep in part]) - opened.first_time_ns
    assert 0.5e9 <= times.min() <= 0.5e9 + PERIOD_NS
    assert 1.0e9 <= times.max() + PERIOD_NS <= 1.0e9 + 2 * PERIOD_NS
    with pytest.raises(InvalidValueError, match="expected one of"):
        opened.sweeps("192.168.1.203")
    with pytest.raises(InvalidValueError, match="expected seconds"):
        opened.sweeps(start_s=math.nan)


def test_one_turn_in_so_many_has_all_of_its_points(two: Path) -> None:
    opened = capture.open(two)
    cut_deg = 123.4  # within a packet: some belong to a wanted turn and to one that is not
    every = {"192.168.1.202:2368": 3}
    some = list(opened.sweeps(cut_azimuth_deg=cut_deg, every=every))
    chosen = [
        sweep
        for sweep in opened.sweeps(cut_azimuth_deg=cut_deg)
        if sweep.index % every.get(sweep.lidar, 1) == 0
    ]
    assert len(some) == len(chosen) > 20
    columns = ("xyz", "time_ns", "ring", "range_m", "azimuth_deg", "intensity", "packet", "block")
    facts = ("lidar", "index", "start_ns", "end_ns", "coverage", "packets", "lost")
    for one, other in zip(some, chosen, strict=True):
        assert [getattr(one, name) for name in facts] == [getattr(other, name) for name in facts]
        for name in columns:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    with pytest.raises(InvalidValueError, match="every: expected at least 1"):
        opened.sweeps(every=0)


def test_health_counts_by_second_and_lidar(two: Path) -> None:
    health = capture.open(two).health()
    assert set(health["lidar"]) == {"192.168.1.201:2368", "192.168.1.202:2368"}
    second = health["lidar"] == "192.168.1.202:2368"
    np.testing.assert_array_equal(health["lost"][second], [2, 1])
    np.testing.assert_array_equal(health["foreign"][second], [10, 10])
    assert health["time_ns"][second][1] - health["time_ns"][second][0] == 10**9
    np.testing.assert_allclose(health["rpm"], 600, atol=0.5)
    np.testing.assert_allclose(health["clock_offset_s"], 173e-6, atol=2e-6)
    assert health["coverage"][second][0] == pytest.approx(752 / 754, abs=1e-3)


def test_a_configuration_gives_names_and_models(tmp_path: Path) -> None:
    sent = [*puck(0.3), *puck(0.3, source="192.168.1.202", product=0)]
    path = write_pcap(tmp_path / "a.pcap", sent)
    lidars = (
        SimpleNamespace(id="tip", source="192.168.1.202", model="vlp16"),
        SimpleNamespace(id="root", source="192.168.1.201:2368", model="auto"),
        SimpleNamespace(id="spare", source="192.168.1.203", model="auto"),
    )
    opened = capture.open(path, config=SimpleNamespace(lidars=lidars))
    assert opened.lidars == ("tip", "root")
    assert opened.missing == ("spare",)
    assert {sweep.lidar for sweep in opened.sweeps("tip")} == {"tip"}
    assert set(opened.health()["lidar"]) == {"tip", "root"}


def test_no_lidar_names_the_closest_stream(tmp_path: Path) -> None:
    path = write_pcap(tmp_path / "blank.pcap", puck(0.5, product=0, mode=0))
    with pytest.raises(CaptureError) as caught:
        capture.open(path).info()
    error = caught.value
    assert error.code == "capture.no_lidar"
    assert error.facts[0] == ("read", "376 packets in 1 UDP streams")
    closest = dict(error.facts)["closest"]
    assert closest.startswith("192.168.1.201 -> port 2368, 1206 bytes, 754/s: the bytes fit")
    assert "HDL-32E, the packet period of 1327 us does not" in closest
    assert error.hint == "name the model: --sensor 192.168.1.201=vlp16"
    named = capture.open(path, sensors={"192.168.1.201": "vlp16"})
    assert named.streams[0].packets == 376
    empty = write_pcap(tmp_path / "empty.pcap", [])
    with pytest.raises(CaptureError, match="no lidar"):
        capture.open(empty).info()


def test_two_lidars_with_one_address_are_named(tmp_path: Path) -> None:
    other = list(puck(1.0, start_us=START_US + 400, clock_us=7_000_000))
    path = write_pcap(tmp_path / "same.pcap", [*puck(1.0), *other])
    opened = capture.open(path)
    assert any("two sensors send from 192.168.1.201" in note for note in opened.streams[0].notes)
    with pytest.raises(CaptureError, match=r"two sensors send from 192\.168\.1\.201") as caught:
        opened.sweeps()
    assert caught.value.code == "capture.same_address"


def test_source_ports_tell_them_apart_where_they_differ(tmp_path: Path) -> None:
    other = puck(1.0, start_us=START_US + 400, clock_us=7_000_000, source_port=40_000)
    path = write_pcap(tmp_path / "ports.pcap", [*puck(1.0), *other])
    opened = capture.open(path)
    assert opened.lidars == ("192.168.1.201:2368@2368", "192.168.1.201:2368@40000")
    assert [stream.lost for stream in opened.streams] == [0, 0]


def test_what_cannot_be_opened_says_so(tmp_path: Path) -> None:
    with pytest.raises(CaptureNotFoundError):
        capture.open(tmp_path / "none.pcap")
    with pytest.raises(InvalidValueError, match="vlp61"):
        capture.open(write_pcap(tmp_path / "a.pcap", puck(0.1)), sensors={"10.0.0.1": "vlp61"})
    with pytest.raises(InvalidValueError, match="source"):
        capture.open(tmp_path / "a.pcap", sensors={"tower": "vlp16"}).info()


def test_progress_ends_with_all_bytes(two: Path) -> None:
    seen: list[tuple[int, int]] = []
    opened = capture.open(two)
    opened.scan(progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (two.stat().st_size, two.stat().st_size)
    for _ in opened.sweeps(progress=lambda done, total: seen.append((done, total))):
        pass
    assert seen[-1][0] == two.stat().st_size


def test_who_goes_on_after_an_error_in_progress_misses_no_sweep(two: Path) -> None:
    calls = 0

    def refuse_often(*_bytes: int) -> None:
        nonlocal calls
        calls += 1
        if calls % 2:
            raise RuntimeError("no")

    opened = capture.open(two)
    expected = [(sweep.lidar, sweep.index, len(sweep)) for sweep in opened.sweeps()]
    sweeps, found = opened.sweeps(progress=refuse_often), []
    while len(found) < len(expected):
        with contextlib.suppress(RuntimeError):
            found += [(sweep.lidar, sweep.index, len(sweep)) for sweep in (next(sweeps),)]
    assert found == expected
    assert calls > 4
    assert next(sweeps, None) is None


def test_an_error_in_progress_stops_the_scan(two: Path) -> None:
    def refuse(done: int, total: int) -> None:
        raise RuntimeError(f"{done} of {total}")

    with pytest.raises(RuntimeError, match=" of "):
        capture.open(two).scan(progress=refuse)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent as POSIX has them")
def test_ctrl_c_is_felt_within_a_block(tmp_path: Path) -> None:
    path = write_pcap(tmp_path / "long.pcap", puck(30.0))
    again = [str(path)]
    script = (
        "import signal, sys; from lidar_deflect import capture\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "print('ready', flush=True)\n"
        "while True:\n"
        "    capture.open(sys.argv[1:]).scan()\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script, *again], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(0.3)
    start = time.monotonic()
    os.kill(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert b"KeyboardInterrupt" in errors
    assert time.monotonic() - start < 2.0  # 0.1 s of a block, and the end of the interpreter


def test_other_threads_run_while_a_capture_is_read(two: Path) -> None:
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0)

    thread = threading.Thread(target=tick)
    thread.start()
    for _ in range(5):
        capture.open(two).scan()
    done.set()
    thread.join()
    assert ticks > 0


@pytest.mark.parametrize("scene", ["edge", "flap"])
def test_lost_packets_of_the_scenes_equal_the_truth(scene: str) -> None:
    folder = SCENES / scene
    if not folder.is_dir():
        pytest.skip("the scenes are not beside the project")
    truth = json.loads((folder / "truth_lidars.json").read_text())
    streams = capture.open(folder / "capture.pcap.gz").streams
    found = {stream.source: (stream.lost, stream.lost + stream.packets) for stream in streams}
    assert found == {
        lidar["source"]: (lidar["packets_lost"], lidar["packets_sent"]) for lidar in truth
    }


def test_the_page_of_sensors_lists_every_model() -> None:
    page = (Path(__file__).parents[1] / "docs" / "sensors.md").read_text()
    listed = {line.split("`")[1] for line in page.splitlines() if line.startswith("| `")}
    assert listed == {model for model, _ in capture.sensor_models()}
