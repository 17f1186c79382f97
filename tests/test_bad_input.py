"""Is whatever can be wrong told clearly: exit code, place, next step; no traceback, no debris?"""

import contextlib
import os
import random
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from conftest import Finished, command_line
from lidar_deflect.cli.app import run

POSIX = pytest.mark.skipif(os.name == "nt", reason="needs POSIX signals, limits and mounts")
RECORD = 16  # bytes of a pcap record's header
FILE = 24  # bytes of a pcap file's header
SEED = 20240310


def refused(done: Finished, code: int, name: str, *words: str) -> None:
    """Check the form of a failure: exit code, error code, no traceback, nothing on stdout."""
    assert done.code == code, done.err
    assert done.out == ""
    assert done.err.startswith(f"error[{name}"), done.err
    assert "Traceback" not in done.err
    for word in words:
        assert word in done.err


def records(capture: Path, count: int) -> bytes:
    """Return the head of a pcap file with its first `count` records."""
    with capture.open("rb") as file:
        data = file.read(FILE)
        for _ in range(count):
            header = file.read(RECORD)
            data += header + file.read(struct.unpack("<IIII", header)[2])
    return data


def leftovers(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# Captures that are none.


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (b"", "capture.empty"),
        (b"hello\n", "capture.unknown_format"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "capture."),
        (random.Random(SEED).randbytes(5000), "capture."),
        (b"\x1f\x8b" + bytes(50), "capture."),
        (b"\x28\xb5\x2f\xfd" + bytes(50), "capture."),
    ],
    ids=["empty", "text", "picture", "noise", "broken gzip", "broken zstd"],
)
@pytest.mark.parametrize("verb", ["info", "init", "decode"])
def test_what_is_no_capture_exits_with_3(
    content: bytes, name: str, verb: str, tmp_path: Path
) -> None:
    path = tmp_path / "run7.pcap"
    path.write_bytes(content)
    refused(command_line(verb, path, cwd=tmp_path), 3, name, "run7.pcap")
    assert leftovers(tmp_path) == ["run7.pcap"]


def test_a_missing_capture_exits_with_3(tmp_path: Path) -> None:
    refused(command_line("info", tmp_path / "none.pcap"), 3, "capture.not_found", "none.pcap")


def test_a_folder_is_no_capture(tmp_path: Path) -> None:
    refused(command_line("info", tmp_path), 3, "capture.directory")


def test_a_capture_cut_at_any_byte_is_read_or_refused(
    short_test: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one process, as every byte of it in a process of its own would take half an hour."""
    whole = records(short_test / "capture.pcap", 3)
    path = tmp_path / "cut.pcap"
    codes = []
    for length in range(len(whole) + 1):
        path.write_bytes(whole[:length])
        codes.append(run(["info", str(path)]))
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        assert codes[-1] in (0, 3), (length, err)
        assert bool(out) == (codes[-1] == 0)
        assert err.startswith("error[capture") or codes[-1] == 0
    assert codes[:FILE] == [3] * FILE


def test_a_cut_capture_is_read_as_far_as_it_goes_and_says_so(
    short_test: Path, tmp_path: Path
) -> None:
    whole = records(short_test / "capture.pcap", 400)
    (tmp_path / "cut.pcap").write_bytes(whole[:-100])
    done = command_line("info", tmp_path / "cut.pcap")
    assert done.code == 0, done.err
    assert "warning: " in done.out


def dns_capture(path: Path) -> Path:
    """Write a pcap with twenty datagrams that no lidar sends."""
    payload = b"\x12\x34\x01\x00" + bytes(40)
    udp = struct.pack(">HHHH", 40000, 53, 8 + len(payload), 0) + payload
    address = bytes([192, 168, 1, 10]) + bytes([192, 168, 1, 1])
    ip = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(udp), 1, 0, 64, 17, 0) + address
    frame = bytes(12) + b"\x08\x00" + ip + udp
    data = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1)
    for second in range(20):
        data += struct.pack("<IIII", 1718000000 + second, 0, len(frame), len(frame)) + frame
    path.write_bytes(data)
    return path


def test_a_capture_without_a_lidar_says_what_it_holds(tmp_path: Path) -> None:
    path = dns_capture(tmp_path / "dns.pcap")
    done = command_line("info", path)
    refused(done, 3, "capture.no_lidar", "20 packets", "192.168.1.10", "\n  hint ")


def test_an_unknown_model_is_refused(short_test: Path) -> None:
    done = command_line("info", short_test / "capture.pcap", "--sensor", "192.168.1.201=vlp17")
    refused(done, 2, "sensor.unknown", "vlp16")


# Configurations that cannot be meant.


def changed(short_test: Path, *changes: str, verb: str = "check") -> Finished:
    sets = [text for change in changes for text in ("--set", change)]
    return command_line(verb, short_test / "capture.pcap", "-c", short_test / "test.toml", *sets)


def test_two_lidars_with_one_address_exit_with_4(short_test: Path) -> None:
    done = changed(short_test, "lidars.1.source=192.168.1.201")
    refused(done, 4, "config.value", "same source 192.168.1.201", "test.toml")


def test_a_misspelt_key_exits_with_4_and_names_the_nearest(short_test: Path) -> None:
    done = changed(short_test, "paper.min_point=3")
    refused(
        done, 4, "config.unknown_key", "unknown key paper.min_point", "did you mean min_points?"
    )


def test_a_section_beyond_the_blade_exits_with_4(short_test: Path) -> None:
    done = changed(short_test, "sections.0.s_m=140")
    refused(done, 4, "config.value", "140 m lies beyond the blade")


def test_a_missing_configuration_exits_with_4(short_test: Path, tmp_path: Path) -> None:
    done = command_line("check", short_test / "capture.pcap", "-c", tmp_path / "none.toml")
    refused(done, 4, "config.not_found", "none.toml")


def test_a_broken_drawing_exits_with_4_and_names_the_line(short_test: Path, tmp_path: Path) -> None:
    lines = (short_test / "blade.csv").read_text(encoding="utf-8").splitlines()
    lines[5] = lines[5].replace(lines[5].split(",")[1], "wide", 1)
    (tmp_path / "blade.csv").write_text("\n".join(lines), encoding="utf-8")
    done = changed(short_test, f"blade.geometry='{tmp_path / 'blade.csv'}'")
    refused(done, 4, "config.geometry", "line 6, column chord_m")


# Captures and configurations that do not fit each other.


def with_a_silent_lidar(short_test: Path, folder: Path) -> Path:
    text = (short_test / "test.toml").read_text(encoding="utf-8")
    silent = '\n[[lidars]]\nid = "L9"\nsource = "192.168.1.209"\nposition_m = [3, -7, 90]\n'
    silent += 'axes = { x = "-x", y = "-y", z = "+z" }\n'
    for name in ("blade.csv", "contours.csv", "load.csv", "wire.csv", "theory.csv"):
        (folder / name).write_bytes((short_test / name).read_bytes())
    path = folder / "test.toml"
    path.write_text(text + silent, encoding="utf-8")
    return path


def test_a_lidar_that_never_sends_fails_the_check_with_3(short_test: Path, tmp_path: Path) -> None:
    config = with_a_silent_lidar(short_test, tmp_path)
    done = command_line("check", short_test / "capture.pcap", "-c", config)
    assert done.code == 3, done.err
    assert "lidar L9 (192.168.1.209) never sends" in done.out


def test_a_lidar_that_never_sends_leaves_a_measurement_with_6(
    short_test: Path, tmp_path: Path
) -> None:
    config = with_a_silent_lidar(short_test, tmp_path)
    done = command_line(
        "measure", short_test / "capture.pcap", "-c", config, "-o", tmp_path / "results"
    )
    assert done.code == 6, done.err
    assert "L9 never sent" in done.err
    assert (tmp_path / "results" / "deflection.parquet").is_file()


def test_a_capture_without_loaded_frames_has_no_deflection_to_compare(
    short_test: Path, tmp_path: Path
) -> None:
    results = tmp_path / "results"
    capture, config = short_test / "capture.pcap", short_test / "test.toml"
    reference = ("--set", "reference.to_s=1.0")
    done = command_line("measure", capture, "-c", config, "--to", "1.2", "-o", results, *reference)
    assert done.code == 0, done.err
    assert "100 %" not in done.out
    assert "no loaded hold" in done.err
    done = command_line("compare", results, "--reference", short_test / "theory.csv")
    assert done.code == 5, done.err
    assert "error[comparison.not_loaded]" in done.err


def test_a_span_that_holds_no_frame_is_refused(short_test: Path, tmp_path: Path) -> None:
    capture, config = short_test / "capture.pcap", short_test / "test.toml"
    done = command_line(
        "measure", capture, "-c", config, "--from", "900", "-o", tmp_path / "results"
    )
    refused(done, 2, "value.invalid", "900")
    assert leftovers(tmp_path) == []


# Places that cannot be written.


@contextlib.contextmanager
def mounted(folder: Path, options: str) -> Iterator[Path]:
    """Mount a small file system in memory, or skip."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip("there is no mount program here")
    if done.returncode:
        pytest.skip(f"a file system cannot be mounted here: {done.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@POSIX
@pytest.mark.parametrize("verb", ["simulate", "decode"])
def test_a_full_disk_exits_with_7_and_leaves_nothing(
    verb: str, short_test: Path, tmp_path: Path
) -> None:
    with mounted(tmp_path / "disk", "size=1m") as disk:
        inputs = [short_test / "capture.pcap"] if verb == "decode" else []
        out = disk / ("points.parquet" if verb == "decode" else "simulated")
        done = command_line(verb, *inputs, "-o", out)
        refused(done, 7, "output.", str(out), "No space left")
        assert leftovers(disk) == []


@POSIX
def test_a_limit_on_the_size_of_files_is_told_like_a_full_disk(tmp_path: Path) -> None:
    code = (
        "import resource, sys\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))\n"
        "from lidar_deflect.cli.app import run\n"
        "sys.exit(run(['simulate', '-o', 'simulated']))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    refused(Finished(done.returncode, done.stdout, done.stderr), 7, "output.", "too large")
    assert leftovers(tmp_path) == []


@POSIX
@pytest.mark.parametrize("verb", ["simulate", "init"])
def test_a_read_only_folder_exits_with_7(verb: str, short_test: Path, tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "ro") as disk:
        inputs = [short_test / "capture.pcap"] if verb == "init" else []
        done = command_line(verb, *inputs, "-o", disk / "out")
        refused(done, 7, "output.", "Read-only")


@pytest.mark.parametrize("verb", ["simulate", "demo", "init", "decode", "calibrate", "measure"])
def test_what_exists_is_not_overwritten_unasked(
    verb: str, short_test: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine").touch()
    inputs = [] if verb in ("simulate", "demo") else [short_test / "capture.pcap"]
    config = ["-c", short_test / "test.toml"] if verb in ("calibrate", "measure") else []
    refused(command_line(verb, *inputs, *config, "-o", out), 7, "output.exists", "--overwrite")
    assert leftovers(out) == ["mine"]


# Ctrl-C.

SOON_S = 5.0
# A shell starts its background jobs, and so perhaps these tests, with Ctrl-C ignored.
STARTED = """\
import signal
import sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from lidar_deflect.cli import main
print("started", flush=True)
main()
"""


def interrupted(arguments: list[str], cwd: Path, delay_s: float) -> Finished:
    """Run a command and press Ctrl-C after a while."""
    with subprocess.Popen(
        [sys.executable, "-c", STARTED, *arguments],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "started\n"
        time.sleep(delay_s)
        process.send_signal(signal.SIGINT)
        begun = time.perf_counter()
        out, err = process.communicate(timeout=60)
        assert time.perf_counter() - begun < SOON_S, (process.returncode, err)
        return Finished(process.returncode, out, err)


def whole_s(arguments: list[str], folder: Path) -> float:
    """Run a command to its end: how long does it take on this machine?"""
    folder.mkdir()
    begun = time.perf_counter()
    subprocess.run(
        [sys.executable, "-c", STARTED, *arguments], cwd=folder, capture_output=True, check=False
    )
    return time.perf_counter() - begun


def moments(longest_s: float, count: int, seed: int) -> list[float]:
    """Return reproducible random moments, more of them early, where imports are under way."""
    source = random.Random(seed)
    return [longest_s * source.random() ** 2 for _ in range(count)]


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize("verb", ["simulate", "demo", "decode", "calibrate", "measure"])
def test_ctrl_c_at_any_time_exits_with_130_and_leaves_nothing(
    verb: str, short_test: Path, tmp_path: Path
) -> None:
    capture, config = str(short_test / "capture.pcap"), str(short_test / "test.toml")
    inputs = [] if verb in ("simulate", "demo") else [capture]
    inputs += ["-c", config] if verb in ("calibrate", "measure") else []
    out = {"decode": "points.parquet", "calibrate": "poses.toml"}.get(verb, "out")
    folder = tmp_path.with_name(f"{tmp_path.name}-whole")
    longest_s = 4.0 if verb in ("simulate", "demo") else whole_s([verb, *inputs, "-o", out], folder)
    codes = []
    for delay_s in moments(longest_s, 8, SEED):
        done = interrupted([verb, *inputs, "-o", out], tmp_path, delay_s)
        codes.append(done.code)
        assert "Traceback" not in done.err, done.err
        if done.code == 130:
            assert done.out == ""
            assert done.err.startswith("error[interrupted]"), done.err
            assert leftovers(tmp_path) == []
        else:  # it was quicker than the interrupt
            assert done.code in (0, 6), done.err
            for path in tmp_path.iterdir():
                path.rename(tmp_path.with_name(f"{tmp_path.name}-{len(codes)}-{path.name}"))
    assert codes.count(130) >= 4
