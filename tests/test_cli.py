"""Is the command line quick to answer, quiet on stdout, and clear when something is wrong?"""

import errno
import json
import os
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest

from lidar_deflect import config
from lidar_deflect.cli import failure, options, talk, units
from lidar_deflect.cli.app import COMMANDS, app, run
from lidar_deflect.cli.interrupt import Interrupt
from lidar_deflect.errors import CaptureError, LidarDeflectError, OutputError

HEAVY = {"numpy", "polars", "pydantic", "plotly", "tomlkit", "rich", "lidar_deflect._native"}
EVERY_KEY = Path(__file__).parent / "data" / "config" / "every_key.toml"
# The interface promises 0.3 s; a loaded machine gets some more.
MOST_SECONDS = 1.0


def loaded_by(*arguments: str) -> set[str]:
    """Run one command line in a fresh interpreter; return the modules that it loaded."""
    code = (
        "import sys\n"
        "from lidar_deflect.cli.app import run\n"
        f"assert run({list(arguments)!r}) == 0\n"
        "print('\\n'.join(sys.modules), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stderr.split())


@pytest.mark.parametrize(
    "arguments", [("--help",), ("--version",), *((name, "--help") for name, _ in COMMANDS)]
)
def test_help_and_version_load_nothing_heavy(arguments: tuple[str, ...]) -> None:
    modules = loaded_by(*arguments)
    # typer builds the parser of a single command with pydantic.
    allowed = {"pydantic"} if len(arguments) > 1 else set()
    assert modules.intersection(HEAVY) <= allowed
    assert "click" not in modules


def test_help_comes_at_once() -> None:
    fastest = min(_seconds_of_help() for _ in range(3))
    assert fastest < MOST_SECONDS


def _seconds_of_help() -> float:
    begun = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "lidar_deflect", "--help"], capture_output=True, check=True
    )
    return time.perf_counter() - begun


@pytest.mark.parametrize("name", [name for name, _ in COMMANDS])
def test_every_command_and_option_explains_itself(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert len(text.split("\n\n")[1]) > 10
    for line in text.partition("Options:")[2].splitlines():
        if line.startswith("  -"):
            assert len(line.split("  ")) >= 3 or len(line) > 24, line


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["measur"], "No such command"),
        (["measure", "x.pcap"], "Missing option"),
        (["measure", "x.pcap", "-c", "t.toml", "--threads", "0"], "threads"),
        (["info"], "Missing argument"),
        (["info", "x.pcap", "--sensor", "vlp16"], "expected SOURCE=MODEL"),
        (["schema", "colours"], "colours"),
        (["compare", "results"], "name one reference"),
    ],
)
def test_a_command_line_that_cannot_be_meant_exits_with_2(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error[usage]: ")
    assert words in err
    assert "\n  hint " in err


def test_errors_are_a_document_on_stdout_with_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", "x.pcap", "-c", "no/such.toml", "--json"]) == 4
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert err == ""
    assert document["schema"] == "lidar-deflect.error/1"
    assert document["exit_code"] == 4
    assert document["error"]["code"] == "config.not_found"


def test_an_error_names_facts_and_a_next_step() -> None:
    error = CaptureError(
        "no lidar packets in run7.pcapng",
        code="capture.no_lidar",
        facts=[("read", "12 packets"), ("closest", "192.168.1.201")],
        hint="name the model",
    )
    assert failure._failure(error, False).text() == (
        "error[capture.no_lidar]: no lidar packets in run7.pcapng\n"
        "  read     12 packets\n"
        "  closest  192.168.1.201\n"
        "  hint     name the model"
    )


def _raised(error: BaseException) -> failure.Failure:
    try:
        raise error
    except BaseException as caught:
        return failure._failure(caught, False)


@pytest.mark.parametrize(
    ("error", "code", "exit_code"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "x"), "output.full", 7),
        (OSError(errno.EFBIG, "File too large", "x"), "output.full", 7),
        (PermissionError(errno.EACCES, "Permission denied", "x"), "environment.denied", 7),
        (FileNotFoundError(errno.ENOENT, "No such file", "x"), "input.not_found", 3),
        (MemoryError(), "environment.memory", 7),
        (OutputError("no"), "output", 7),
        (LidarDeflectError("no"), "error", 1),
        (KeyboardInterrupt(), "interrupted", 130),
        (ZeroDivisionError("division by zero"), "bug", 1),
    ],
)
def test_every_kind_of_failure_has_its_exit_code(
    error: BaseException, code: str, exit_code: int
) -> None:
    shown = _raised(error)
    assert (shown.code, shown.exit_code) == (code, exit_code)
    assert "Traceback" not in shown.text()


@pytest.fixture
def broken_command(monkeypatch: pytest.MonkeyPatch) -> str:
    def broken(verbose: options.Verbose = False) -> None:
        """Fail."""
        assert verbose in (True, False)
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(app, "registered_commands", list(app.registered_commands))
    app.command("broken")(broken)
    return "broken"


def test_a_bug_is_told_in_short_and_with_v_in_full(
    broken_command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([broken_command]) == 1
    short = capsys.readouterr().err
    assert short.startswith("error[bug]: ZeroDivisionError: division by zero\n")
    assert "Traceback" not in short
    assert "-v" in short
    assert run([broken_command, "-v"]) == 1
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="a closed pipe looks different on Windows")
def test_a_closed_pipe_is_no_error() -> None:
    command = f"{sys.executable} -m lidar_deflect schema config | head -1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["{", "0"]
    assert done.stderr == ""


def test_a_time_is_seconds_or_utc() -> None:
    assert options.moment("2.5", "--from") == options.Moment(2.5, None)
    expected = options.Moment(None, 1_718_000_000_255_000_000)
    for text in ("2024-06-10T06:13:20.255Z", "2024-06-10T08:13:20.255+02:00"):
        assert options.moment(text, "--from") == expected
    assert options.moment("2024-06-10T06:13:20.255", "--from") == expected
    assert expected.since(1_718_000_000_000_000_000) == pytest.approx(0.255, abs=1e-9)


def test_units_become_changes_of_the_configuration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "test.toml"
    path.write_text(EVERY_KEY.read_text(encoding="utf-8"), encoding="utf-8")
    for name in ("blade", "contours", "angle", "wire", "root", "load", "theory", "a"):
        (tmp_path / f"{name}.csv").touch()
    (tmp_path / "strain.tdms").touch()
    changes = units.overrides(path, None, ["192.168.1.201=vlp16", "L2=vlp16-hires"], ["L2=a.csv"])
    lidars = config.load(path, changes).lidars
    assert [lidar.model for lidar in lidars] == ["vlp16", "vlp16-hires"]
    assert lidars[1].beams == (tmp_path.resolve() / "a.csv",)


def test_tables_align_numbers_to_the_right() -> None:
    text = talk.table(["name", "count"], [["a", "1 200"], ["long", "7"]])
    assert text == "name  count\na     1 200\nlong      7"


def test_json_knows_no_infinity_and_no_numpy() -> None:
    import numpy as np

    document = {"a": float("nan"), "b": np.arange(2), "c": np.float64(0.5), "d": Path("x")}
    assert json.loads(talk.to_json(document)) == {"a": None, "b": [0, 1], "c": 0.5, "d": "x"}


def test_an_output_that_exists_is_refused_before_work_begins(tmp_path: Path) -> None:
    assert options.free(tmp_path, overwrite=False) == tmp_path  # an empty folder is free
    (tmp_path / "x").touch()
    with pytest.raises(OutputError):
        options.free(tmp_path, overwrite=False)
    assert options.free(tmp_path, overwrite=True) == tmp_path


def test_only_named_lidars_and_sections_stay_with_what_belongs_to_them() -> None:
    whole = config.load(EVERY_KEY, check_files=False)
    one = units.narrowed(whole, ["192.168.1.202"], None)
    assert [lidar.id for lidar in one.lidars] == ["L2"]
    assert one.distance == ()
    assert one.wires == whole.wires
    assert units.narrowed(whole, None, ["S84"]).sections == whole.sections
    with pytest.raises(Exception, match="expected one of S84"):
        units.narrowed(whole, None, ["S85"])


@pytest.fixture
def heard() -> Iterator[None]:
    """Hear Ctrl-C, which a shell's background jobs are started without."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(os.name == "nt", reason="signals differ on Windows")
@pytest.mark.usefixtures("heard")
def test_an_interrupt_that_python_only_printed_strikes_again(
    capsys: pytest.CaptureFixture[str],
) -> None:
    class Referent:
        pass

    def swallowed(_: object) -> None:
        signal.raise_signal(signal.SIGINT)

    interrupt, referent = Interrupt(), Referent()
    with interrupt.armed():
        alive = weakref.ref(referent, swallowed)
        del referent
        with pytest.raises(KeyboardInterrupt):
            time.sleep(5.0)
    assert alive() is None
    assert interrupt.came
    assert capsys.readouterr() == ("", "")


# In an interpreter of its own: pytest and the fixtures above set handlers after polars did.
WRITTEN_BESIDE = """
import signal, sys, threading, time
signal.signal(signal.SIGINT, signal.default_int_handler)
import polars as pl
from polars.io.plugins import register_io_source
from lidar_deflect.files import keep_interrupts_from_polars

def frames(*_):
    for _ in range(50):
        time.sleep(0.01)
        yield pl.DataFrame({"x_m": [1.0] * 1000})

def write():
    register_io_source(frames, schema={"x_m": pl.Float64}, is_pure=True).sink_parquet(sys.argv[1])

keep_interrupts_from_polars()
writer = threading.Thread(target=write)
writer.start()
time.sleep(0.1)
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    print("heard")
writer.join()
"""


@pytest.mark.skipif(os.name == "nt", reason="signals differ on Windows")
def test_a_file_being_written_by_a_thread_outlives_an_interrupt(tmp_path: Path) -> None:
    path = tmp_path / "points.parquet"
    command = [sys.executable, "-c", WRITTEN_BESIDE, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("heard\n", "")
    assert pl.read_parquet(path).height == 50 * 1000
