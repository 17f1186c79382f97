"""Runs what is missing, several tests at a time, one line of JSON for each.

Each test runs in a process of its own: one that crashes or hangs is a counted failure.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

ROOT = Path(__file__).parents[2]


def done(path: Path) -> dict[str, dict[str, Any]]:
    """Return the records of a file by id; of two, the later one. A cut-off last line is skipped."""
    records = {}
    if path.is_file():
        for line in path.read_text().splitlines():
            try:
                record = json.loads(line)
            except json.JSONDecodeError:
                continue
            records[record["id"]] = record
    return records


def missing(
    ids: Iterable[str], records: dict[str, dict[str, Any]], wanted: Sequence[str]
) -> list[str]:
    """Return the ids without a record of all wanted methods."""
    return [i for i in ids if not set(wanted) <= set(records.get(i, {}).get("asked", []))]


def run(
    ids: Sequence[str],
    command: Callable[[str], list[str]],
    path: Path,
    *,
    asked: Sequence[str],
    jobs: int,
    timeout_s: float,
) -> None:
    """Run `command` for each id and append what it prints."""
    path.parent.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    with ThreadPoolExecutor(jobs) as pool, path.open("a", encoding="utf-8") as out:
        tasks = {pool.submit(_one, command(i), timeout_s): i for i in ids}
        try:
            for count, task in enumerate(as_completed(tasks), 1):
                record = {"id": tasks[task], **task.result(), "asked": list(asked)}
                out.write(json.dumps(record) + "\n")
                out.flush()
                _progress(count, len(ids), time.monotonic() - began)
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            raise
    if sys.stderr.isatty():
        print(file=sys.stderr)


def _one(command: list[str], timeout_s: float) -> dict[str, Any]:
    environment = os.environ | {"RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    environment |= {"OPENBLAS_NUM_THREADS": "1", "POLARS_MAX_THREADS": "1"}
    try:
        ended = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=timeout_s
        )
    except subprocess.TimeoutExpired:
        return {"failed": "timeout", "why": f"more than {timeout_s:g} s"}
    lines = ended.stdout.splitlines()
    if ended.returncode or not lines:
        why = ended.stderr.strip().splitlines()
        return {"failed": f"exit {ended.returncode}", "why": why[-1][:300] if why else ""}
    record: dict[str, Any] = json.loads(lines[-1])
    return record


def _progress(count: int, total: int, seconds: float) -> None:
    left_s = seconds / count * (total - count)
    end = "" if sys.stderr.isatty() else "\n"
    start = "\r" if sys.stderr.isatty() else ""
    print(
        f"{start}{count}/{total} tests, {seconds:.0f} s, {left_s:.0f} s left",
        end=end,
        file=sys.stderr,
        flush=True,
    )
