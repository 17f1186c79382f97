"""Do bags give the same points as captures of the same packets?"""

import json
import os
import sqlite3
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from bag_files import KINDS, Bags, Entry, octets
from conftest import command_line
from lidar_deflect import bags, capture, decode, tables
from lidar_deflect.errors import CaptureError, CaptureNotFoundError
from packets import START_US, Sent, puck, write_pcap

CAPTURES = Path(__file__).parents[2] / "shared" / "captures"
SCAN = "velodyne_msgs/msg/VelodyneScan"
TOPIC = "/tower/velodyne_packets"
NANOS = 1000


def scans(writer: Bags, sent: list[Sent], topic: str = TOPIC, stamped: bool = True) -> list[Entry]:
    """Messages of a tenth of a second each, recorded half a millisecond after the last packet."""
    entries = []
    for start in range(0, len(sent), 76):
        part = sent[start : start + 76]
        end_ns = part[-1].time_us * NANOS
        packets = [
            writer.message(
                "velodyne_msgs/msg/VelodynePacket",
                stamp=writer.time(one.time_us * NANOS if stamped else 0),
                data=octets(one.payload),
            )
            for one in part
        ]
        header = writer.header(end_ns if stamped else 0)
        message = writer.message(SCAN, header=header, packets=packets)
        entries.append((topic, SCAN, end_ns + 500_000, message))
    return entries


def points(path: Path, out: Path, **known: Any) -> pl.DataFrame:
    decode.decode(capture.open(path, **known), out)
    return tables.read(out)


def assert_same(one: pl.DataFrame, other: pl.DataFrame) -> None:
    assert one.drop("lidar").equals(other.drop("lidar"))


@pytest.mark.parametrize("kind", KINDS)
def test_packets_of_a_bag_give_the_points_of_the_capture(kind: str, tmp_path: Path) -> None:
    writer, sent = Bags(kind), [*puck(0.5)]
    bag = writer.write(tmp_path / "run", scans(writer, sent))
    ours = points(bag, tmp_path / "bag.parquet")
    assert_same(ours, points(write_pcap(tmp_path / "run.pcap", sent), tmp_path / "pcap.parquet"))
    assert set(ours["lidar"]) == {TOPIC}
    stream = capture.open(bag).streams[0]
    assert (stream.model, stream.source, stream.port) == ("vlp16", TOPIC, None)
    assert (stream.packets, stream.lost, stream.clock_kind) == (len(sent), 0, "utc")


@pytest.mark.parametrize("kind", KINDS)
def test_two_topics_are_two_lidars_in_the_order_of_time(kind: str, tmp_path: Path) -> None:
    writer = Bags(kind)
    one, other = [*puck(0.3)], [*puck(0.3, source="192.168.1.202", mode=0x39)]
    entries = scans(writer, one, "/b/packets") + scans(writer, other, "/a/packets")
    bag = writer.write(tmp_path / "run", sorted(entries, key=lambda entry: entry[2]))
    opened = capture.open(bag, sensors={"/a/packets": "puck-lite"})
    assert opened.lidars == ("/a/packets", "/b/packets")
    assert [stream.model for stream in opened.streams] == ["puck-lite", "vlp16"]
    decode.decode(opened, tmp_path / "bag.parquet")
    frame = tables.read(tmp_path / "bag.parquet")
    pcap = write_pcap(tmp_path / "run.pcap", [*one, *other])
    expected = points(pcap, tmp_path / "pcap.parquet")
    by = ["time", "ring", "lidar", "packet", "block"]
    names = {"192.168.1.201:2368": "/b/packets", "192.168.1.202:2368": "/a/packets"}
    renamed = expected.with_columns(pl.col("lidar").replace(names))
    assert frame.sort(by).equals(renamed.sort(by))
    # A message of one lidar comes as a whole; its packets come between those of the other.
    assert frame["lidar"].head(50_000).n_unique() == 2
    health = opened.health()
    assert set(health["lidar"]) == set(opened.lidars)


def test_without_stamps_the_times_are_those_of_the_bag(tmp_path: Path) -> None:
    writer, sent = Bags("mcap"), [*puck(0.5)]
    bag = writer.write(tmp_path / "run", scans(writer, sent, stamped=False))
    stream = capture.open(bag).streams[0]
    # All packets of a message come with it: what they waited is no lag of the clock.
    assert abs(stream.clock["offset_s"] - 0.000673) < 1e-5
    assert any("times of the bag" in note for note in stream.notes)


def test_a_folder_a_wrong_suffix_and_a_rotated_bag_are_read(tmp_path: Path) -> None:
    writer, sent = Bags("db3"), [*puck(0.5)]
    bag = writer.write(tmp_path / "whole", scans(writer, sent))
    expected = points(bag, tmp_path / "whole.parquet")
    assert_same(points(tmp_path / "whole", tmp_path / "folder.parquet"), expected)
    odd = tmp_path / "recording.bin"
    odd.write_bytes(bag.read_bytes())
    assert_same(points(odd, tmp_path / "odd.parquet"), expected)
    parts = [scans(writer, sent)[:2], scans(writer, sent)[2:]]
    files = [writer.write(tmp_path / f"part{n}", part) for n, part in enumerate(parts)]
    decode.decode(capture.open(files), tmp_path / "parts.parquet")
    assert_same(tables.read(tmp_path / "parts.parquet"), expected)


def test_info_tells_of_the_bag_and_its_topics(tmp_path: Path) -> None:
    writer, sent = Bags("db3"), [*puck(3.0)]
    bag = writer.write(tmp_path / "run", scans(writer, sent))
    whole, quick = (capture.open(bag).info(quick=quick) for quick in (False, True))
    entry = whole["captures"][0]
    assert entry["path"] == str(bag)
    assert (entry["format"], entry["records"]) == ("ROS 2 bag (SQLite)", len(sent) // 76 + 1)
    assert entry["first_host_utc"].startswith("2024-06-10T06:13:20.1")
    assert whole["streams"][0]["source"] == TOPIC
    assert quick["streams"][0]["packets"] < whole["streams"][0]["packets"]
    assert quick["streams"][0]["last_utc"] is None
    done = command_line("info", bag)
    assert done.code == 0
    assert TOPIC in done.out
    assert "198.18" not in done.out + json.dumps([whole, quick])


def test_nothing_temporary_stays(tmp_path: Path) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    writer = Bags("mcap")
    bag = writer.write(tmp_path / "run", scans(writer, [*puck(0.3)]))
    done = command_line("decode", bag, "-o", tmp_path / "points.csv", TMPDIR=str(scratch))
    assert done.code == 0, done.err
    assert list(scratch.iterdir()) == []


# --- other drivers' messages, from real packets ------------------------------------------------


def datagrams(path: Path, folder: Path, **known: Any) -> Iterator[tuple[int, str, bytes]]:
    """Time, source and payload of all datagrams; the cut writes their fragments in order."""
    whole = folder / "whole.pcap"
    decode.decode(capture.open(path, **known), whole)
    content = whole.read_bytes()
    scale = {0xA1B2C3D4: 1000, 0xA1B23C4D: 1}[struct.unpack_from("<I", content)[0]]
    place, parts = 24, b""
    while place < len(content):
        seconds, fraction, length, _ = struct.unpack_from("<IIII", content, place)
        frame = content[place + 16 : place + 16 + length]
        source = ".".join(map(str, frame[26:30]))
        parts += frame[34:]
        has_more = frame[20] & 0x20
        if not has_more:
            yield seconds * 1_000_000_000 + fraction * scale, source, parts[8:]
            parts = b""
        place += 16 + length


def real(name: str) -> Path:
    path = CAPTURES / name
    if not path.is_file():
        pytest.skip("the captures are not beside the project")
    return path


def compare(bag: Path, path: Path, folder: Path, **known: Any) -> pl.DataFrame:
    ours = points(bag, folder / "bag.parquet")
    assert_same(ours, points(path, folder / "pcap.parquet", **known))
    return ours


@pytest.mark.parametrize("kind", KINDS)
def test_hesai_scans_with_padded_packets(kind: str, tmp_path: Path) -> None:
    path = real("hesai_xt32_dual.pcap")
    writer = Bags(kind)
    entries: list[Entry] = []
    name = "pandar_msgs/msg/PandarPacket"
    for time_ns, _, payload in datagrams(path, tmp_path):
        packet = writer.message(
            name, stamp=writer.time(time_ns), data=octets(payload, 1500), size=len(payload)
        )
        scan = "pandar_msgs/msg/PandarScan"
        message = writer.message(scan, header=writer.header(time_ns), packets=[packet])
        entries.append(("/hesai/pandar_packets", scan, time_ns, message))
    bag = writer.write(tmp_path / "hesai_xt32_dual", entries)
    stem = bag.name.rsplit(".", 1)[0]
    for beam in CAPTURES.glob("hesai_xt32_dual.*.csv"):
        target = bag.parent / beam.name.replace("hesai_xt32_dual", stem)
        target.write_bytes(beam.read_bytes())
    compare(bag, path, tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_ouster_packets_one_byte_too_long_with_recorded_metadata(kind: str, tmp_path: Path) -> None:
    path = real("ouster_os1_32_legacy.pcap")
    writer = Bags(kind)
    described = path.with_suffix(".json").read_text(encoding="utf-8")
    text = writer.message("std_msgs/msg/String", data=described)
    entries: list[Entry] = []
    name = "ouster_ros/msg/PacketMsg"
    for time_ns, _, payload in datagrams(path, tmp_path):
        topic = "imu_packets" if len(payload) == 48 else "lidar_packets"
        message = writer.message(name, buf=octets(payload + b"\0"))
        entries.append((f"/os_node/{topic}", name, time_ns, message))
    entries.insert(1, ("/os_node/metadata", "std_msgs/msg/String", entries[0][2], text))
    bag = writer.write(tmp_path / "run", entries)
    ours = compare(bag, path, tmp_path)
    assert set(ours["lidar"]) == {"/os_node/lidar_packets"}
    assert ours["frame_id"].null_count() == 0
    # One turn after another: the sensor's count goes on by one, as sweeps do.
    turns = ours.group_by("frame_id").agg(pl.col("time").min()).sort("time")["frame_id"]
    assert (np.diff(turns.to_numpy().astype(int)) == 1).all()
    assert "/os_node/metadata" in capture.open(bag).streams[0].beams


@pytest.mark.parametrize("kind", KINDS)
def test_robosense_packets_that_describe_the_unit_come_along(kind: str, tmp_path: Path) -> None:
    path = real("robosense_helios16p_a.pcap")
    writer = Bags(kind)
    name = "rslidar_msg/msg/RslidarPacket"
    entries: list[Entry] = []
    for time_ns, _, payload in datagrams(path, tmp_path):
        is_difop = payload.startswith(b"\xa5\xff\x00\x5a")
        message = writer.message(
            name,
            header=writer.header(time_ns),
            is_difop=int(is_difop),
            is_frame_begin=0,
            data=octets(payload),
        )
        entries.append(("/rslidar_packets", name, time_ns, message))
    compare(writer.write(tmp_path / "run", entries), path, tmp_path)


def test_robosense_packets_of_ros_1_with_a_topic_for_what_describes_the_unit(
    tmp_path: Path,
) -> None:
    path = real("robosense_helios16p_a.pcap")
    writer = Bags("bag")
    name, scan = "rslidar_msgs/msg/rslidarPacket", "rslidar_msgs/msg/rslidarScan"
    entries: list[Entry] = []
    for time_ns, _, payload in datagrams(path, tmp_path):
        stamp, data = writer.time(time_ns), octets(payload)
        packet = writer.message(name, stamp=stamp, data=data)
        if payload.startswith(b"\xa5\xff\x00\x5a"):
            entries.append(("/rslidar_packets_difop", name, time_ns, packet))
        else:
            message = writer.message(scan, header=writer.header(time_ns), packets=[packet])
            entries.append(("/rslidar_packets", scan, time_ns, message))
    ours = compare(writer.write(tmp_path / "run", entries), path, tmp_path)
    assert set(ours["lidar"]) == {"/rslidar_packets"}


def test_a_bag_is_cut_to_a_capture_by_topic_and_time(tmp_path: Path) -> None:
    writer = Bags("db3")
    entries = scans(writer, [*puck(0.5)], "/a/packets") + scans(writer, [*puck(0.5)], "/b/packets")
    bag = writer.write(tmp_path / "run", sorted(entries, key=lambda entry: entry[2]))
    span = {"lidars": ["/b/packets"], "start_s": 0.1, "stop_s": 0.3}
    decode.decode(capture.open(bag), tmp_path / "cut.pcap", **span)
    decode.decode(capture.open(bag), tmp_path / "whole.parquet", **span)
    cut = points(tmp_path / "cut.pcap", tmp_path / "cut.parquet")
    whole = tables.read(tmp_path / "whole.parquet")
    # Packets and turns are counted anew.
    assert len(cut) == len(whole) > 50_000
    assert cut.drop("lidar", "packet", "sweep").equals(whole.drop("lidar", "packet", "sweep"))


# --- what cannot be read -------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_without_lidars_names_its_topics(kind: str, tmp_path: Path) -> None:
    writer = Bags(kind)
    text = writer.message("std_msgs/msg/String", data="hello")
    entry = ("/chatter", "std_msgs/msg/String", 1_718_000_000_000_000_000, text)
    bag = writer.write(tmp_path / "talk", [entry])
    with pytest.raises(CaptureError) as caught:
        capture.open(bag)
    assert caught.value.code == "capture.no_lidar"
    assert ("topics", "/chatter") in caught.value.facts


@pytest.mark.parametrize("kind", KINDS)
def test_a_cut_bag_says_so_or_gives_what_stands_before(kind: str, tmp_path: Path) -> None:
    writer, sent = Bags(kind), [*puck(1.0)]
    bag = writer.write(tmp_path / "run", scans(writer, sent))
    content = bag.read_bytes()
    seen = set()
    for share in (0.001, 0.3, 0.7, 0.97):
        cut = tmp_path / f"cut{share}"
        cut.write_bytes(content[: max(20, int(share * len(content)))])
        try:
            document = capture.open(cut).info()
        except CaptureError as error:
            seen.add(error.code)
        else:
            seen.add("read")
            stream = document["streams"][0]
            is_told = document["captures"][0]["warnings"] or document["drops"]
            assert stream["packets"] == len(sent) or is_told
    assert seen <= {"capture.bag_broken", "capture.no_lidar", "read"}
    assert "capture.bag_broken" in seen


def test_noise_behind_the_magic_is_an_error_of_the_input(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    for magic, _ in bags.kinds.MAGICS:
        for size in (0, 8, 100, 5000):
            path = tmp_path / "noise"
            path.write_bytes(magic + random.bytes(size))
            with pytest.raises(CaptureError):
                capture.open(path).info()
    with pytest.raises(CaptureNotFoundError):
        capture.open(tmp_path / "absent.bag")


@pytest.mark.parametrize(("suffix", "tool"), [("gz", "gzip"), ("zstd", "zstd")])
def test_a_bag_compressed_as_a_whole_is_told(suffix: str, tool: str, tmp_path: Path) -> None:
    path = tmp_path / f"run_0.db3.{suffix}"
    path.write_bytes(b"\x1f\x8b")
    with pytest.raises(CaptureError) as caught:
        capture.open(path)
    assert caught.value.code == "capture.compression"
    assert caught.value.hint == f"decompress it first: {tool} -dk run_0.db3.{suffix}"


def test_without_the_extra_the_command_that_installs_it_is_named(tmp_path: Path) -> None:
    writer = Bags("mcap")
    bag = writer.write(tmp_path / "run", scans(writer, [*puck(0.1)]))
    code = (
        "import sys; sys.modules['rosbags'] = None; from lidar_deflect.cli import main; "
        f"sys.argv = ['lidar-deflect', 'info', {str(bag)!r}]; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ},
    )
    assert done.returncode == 7
    assert "pip install 'lidar-deflect[ros]'" in done.stderr


# --- whole measurements ----------------------------------------------------------------------


def test_a_test_is_calibrated_and_measured_from_a_bag(short_test: Path, tmp_path: Path) -> None:
    topics = {f"192.168.1.{200 + n}": f"/lidar_{n}/velodyne_packets" for n in range(1, 5)}
    writer, parts = Bags("mcap"), dict[str, list[Sent]]()
    for time_ns, source, payload in datagrams(short_test / "capture.pcap", tmp_path):
        if len(payload) == 1206:  # drivers record no position packets among the others
            parts.setdefault(source, []).append(Sent(time_ns // NANOS, source, payload))
    entries = [
        entry for source, sent in parts.items() for entry in scans(writer, sent, topics[source])
    ]
    pcap = write_pcap(tmp_path / "same.pcap", [one for sent in parts.values() for one in sent])
    bag = writer.write(tmp_path / "run", sorted(entries, key=lambda entry: entry[2]))
    text = (short_test / "test.toml").read_text(encoding="utf-8")
    for source, topic in topics.items():
        text = text.replace(f'source = "{source}"', f'source = "{topic}"')
    for name in ("blade.csv", "contours.csv", "load.csv", "wire.csv", "theory.csv"):
        (tmp_path / name).write_bytes((short_test / name).read_bytes())
    (tmp_path / "test.toml").write_text(text, encoding="utf-8")
    tables_of = []
    for folder, captured in ((short_test, pcap), (tmp_path, bag)):
        out = tmp_path / f"results-{captured.suffix[1:]}"
        done = command_line(
            "measure", "--method", "paper", "-c", folder / "test.toml", captured, "-o", out
        )
        assert done.code in (0, 6), done.err
        tables_of.append(tables.read(out / "deflection.parquet"))
    assert len(tables_of[0]) > 30
    assert tables_of[0]["d_m"].null_count() < len(tables_of[0]) / 2
    assert tables_of[0].equals(tables_of[1])


@pytest.mark.slow
def test_a_longer_bag_takes_no_more_memory(tmp_path: Path) -> None:
    if not Path("/proc/self/status").is_file():
        pytest.skip("the system does not tell the peak of memory in /proc")
    from test_exports import peak_kb

    writer, peaks = Bags("db3"), []
    for seconds in (10, 40):
        sent = [
            one
            for number in range(seconds // 10)
            for one in puck(10.0, start_us=START_US + number * 10**7)
        ]
        bag = writer.write(tmp_path / f"{seconds}", scans(writer, sent))
        peaks.append(peak_kb(bag, tmp_path / f"{seconds}.ply"))
    # 30 s more are 28 MB of packets and 370 MB of points; a tenth of these may be on their way.
    assert peaks[1] < peaks[0] + 37_000


def test_layouts_of_bags_that_bring_none_are_known(tmp_path: Path) -> None:
    writer, sent = Bags("db3"), [*puck(0.2)]
    bag = writer.write(tmp_path / "run", scans(writer, sent))
    with sqlite3.connect(bag) as database:
        database.execute("DELETE FROM message_definitions")
    assert capture.open(bag).streams[0].packets == len(sent)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a signal")
def test_ctrl_c_leaves_neither_points_nor_unpacked_captures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from test_bad_input import interrupted, moments

    scratch, folder = tmp_path / "scratch", tmp_path / "out"
    scratch.mkdir()
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    writer = Bags("mcap")
    bag = writer.write(tmp_path / "run", scans(writer, [*puck(8.0)]))
    codes = []
    for delay_s in moments(2.0, 8, seed=8):
        done = interrupted(["decode", str(bag), "-o", "points.laz"], folder, delay_s)
        codes.append(done.code)
        assert list(scratch.iterdir()) == []
        assert "Traceback" not in done.err, done.err
        if done.code == 130:
            assert list(folder.iterdir()) == []
        (folder / "points.laz").unlink(missing_ok=True)
    assert codes.count(130) >= 4
