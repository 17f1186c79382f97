"""All jobs beside their peers in one run, and the table of what was asked.

PYTHONPATH=python target/peers/bin/python benches/peers/suite.py
    [--only decode ...] [--repeats 5] [--large]
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
from datetime import date
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rounds import Row

JOBS = ("decode", "rotating", "cluster", "ground", "compressed", "yard", "program")


def main() -> None:
    """Run what is asked for, print the table last."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=JOBS, default=JOBS)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument(
        "--large",
        action="store_true",
        help="ten million points (23 GB of memory), 20 GB of capture",
    )
    options = parser.parse_args()
    # Last, for the metadata of the package as it is built there: results say by which version.
    sys.path.extend(map(str, Path(__file__).parents[2].glob(".venv/lib*/**/site-packages")))
    load = os.getloadavg()[0]
    machine = platform.processor() or platform.machine()
    print(f"{date.today()}, {machine}, {os.cpu_count()} cores, load {load:.1f}")
    rows: list[Row] = []
    for name in options.only:
        print(f"\n== {name}")
        try:
            rows += import_module(name).measure(options.repeats, large=options.large)
        except ImportError as missing:
            print(f"left out: {missing}")
    print("\n" + summary(rows))


def summary(rows: Sequence[Row]) -> str:
    """Table for README.md."""
    lines = ["| job | asked | measured |", "| --- | --- | --- |"]
    return "\n".join(lines + [f"| {row.job} | {row.asked} | {row.measured} |" for row in rows])


if __name__ == "__main__":
    main()
