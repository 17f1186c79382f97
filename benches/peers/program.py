"""The program itself: how soon it answers, and what memory a large capture takes."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import captures
from rounds import Row, rounds, table

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

SIZES = {False: 2_000_000_000, True: 20_000_000_000}
"""Bytes of the large capture, of which the second is made on demand and removed."""


def run(*arguments: str | Path) -> None:
    """Run a command and forget what it says."""
    command = [sys.executable, "-m", "lidar_deflect", *map(str, arguments)]
    subprocess.run(command, capture_output=True, check=True)


def most_mib(arguments: Sequence[str | Path]) -> float:
    """Largest memory of a command, MiB.

    Linux keeps `ru_maxrss` over the start of a program: one that the suite starts begins with what
    the suite itself had by then. `VmHWM` is of the program alone; elsewhere `ru_maxrss` is told.
    """
    code = (
        "import pathlib, resource, runpy, sys\n"
        "try: runpy.run_module('lidar_deflect', run_name='__main__', alter_sys=True)\n"
        "except SystemExit: pass\n"
        "status = pathlib.Path('/proc/self/status')\n"
        "lines = status.read_text().splitlines() if status.exists() else []\n"
        "own = [line.split()[1] for line in lines if line.startswith('VmHWM')]\n"
        "most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "print(*(own or [most]), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stderr.split()[-1]) / 1024


def measure(repeats: int, *, large: bool) -> list[Row]:
    """Print what was found; return what was asked."""
    timed = rounds({"--help": lambda: run("--help")}, repeats)
    print(table(timed, 1, "answers", "--help"))
    small = captures.yard() / "capture.pcap"
    longer = captures.repeated(small, SIZES[large])
    memory = [(path.stat().st_size, most_mib(["info", path, "--json"])) for path in (small, longer)]
    if large:
        longer.unlink()
    found = ", ".join(f"{mib:.0f} MiB for {size / 1e9:.2f} GB" for size, mib in memory)
    print(found)
    return [
        Row("--help, warm", "under 0.3 s", f"{timed['--help'].median_s:.2f} s"),
        Row("memory of `info` on a large capture", "under 1 GB, flat", found),
    ]
