"""How much of the decompressor's own throughput is left while packets are read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import captures
from rounds import Own, Row, ratio, rounds, table

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

PACKED = {"gzip": captures.gzipped, "zstd": captures.zstandard}


def _job(job: str, path: Path) -> Callable[[], Own]:
    def run() -> Own:
        seconds, count, points = captures.in_rust(job, path)
        return Own(seconds, (count, points))

    return run


def measure(repeats: int, *, large: bool) -> list[Row]:  # noqa: ARG001
    """Print one table per format; return what was asked."""
    plain = captures.repeated(captures.yard() / "capture.pcap", 500_000_000)
    rows = []
    for name, pack in PACKED.items():
        path = pack(plain)
        alone = "decompressor alone"
        jobs: dict[str, Callable[[], Any]] = {
            alone: _job("bytes", path),
            "datagrams": _job("datagrams", path),
            "scan": _job("scan", path),
        }
        timed = rounds(jobs, repeats)
        print(f"\n{name}\n{table(timed, plain.stat().st_size / 1e6, 'MB', 'scan')}")
        share = f"{ratio(timed, alone, 'scan'):.0%}"
        rows.append(Row(f"{name} capture, scanned", "90 % of the decompressor alone", share))
    return rows
