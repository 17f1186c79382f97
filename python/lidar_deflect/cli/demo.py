"""``lidar-deflect demo``: the whole road on simulated data, held against the truth."""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lidar_deflect.cli.measure import verdict
from lidar_deflect.cli.options import Json, Overwrite, Quiet, Threads, Timings, Verbose, free
from lidar_deflect.cli.talk import Talk, table

if TYPE_CHECKING:
    import polars as pl

SCHEMA = "lidar-deflect.demo/1"


def demo(
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Folder to write.")
    ] = Path("lidar-deflect-demo"),
    overwrite: Overwrite = False,
    threads: Threads = None,
    timings: Timings = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Simulate a test, measure it, compare with its truth.

    A four-lidar edgewise test; needs no data. Leaves the simulated capture, the result tables
    and a report in the folder.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    free(out, overwrite)
    with _removed_on_failure(out):
        document, text, seconds, code = _run(out, talk, threads)
    talk.result(document, text)
    talk.note(f"\nreport: {document['report']}")
    talk.timings(timings, seconds)
    return code


@contextmanager
def _removed_on_failure(folder: Path) -> Iterator[None]:
    """Remove what a failed or interrupted run made; what was there before stays."""
    ours = not folder.exists()
    try:
        yield
    except BaseException:
        if ours:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def _run(
    out: Path, talk: Talk, threads: int | None
) -> tuple[dict[str, Any], str, dict[str, float], int]:
    from lidar_deflect import comparison, scene, simulation
    from lidar_deflect import report as reports
    from lidar_deflect.pipeline import Test

    watch = _Watch()
    with talk.progress("simulating") as progress:
        simulated = simulation.simulate(
            scene.demo(),
            out / "simulated",
            overwrite=True,
            progress=progress.amount,
            threads=threads,
        )
    watch.lap("simulate")
    capture = simulated / "capture.pcap"
    test = Test.load(simulated / "test.toml")
    with talk.progress("calibrating") as progress:
        calibration = test.calibrate(capture, progress=progress.stage, threads=threads)
    watch.lap("calibrate")
    with talk.progress("measuring") as progress:
        result = test.measure(
            capture, calibration=calibration, progress=progress.stage, threads=threads
        )
    results = result.save(out / "results", overwrite=True)
    watch.lap("measure")
    compared = comparison.compare(results, simulated / "truth.parquet")
    watch.lap("compare")
    report = reports.write(results)
    watch.lap("report")
    code = verdict(result, talk)
    rows = against_truth(compared, result.steps)
    document = {
        "schema": SCHEMA,
        "folder": str(out),
        "report": str(report),
        "method": test.config.measure.method,
        "rows": rows,
        "largest_error": largest_error(rows),
        "largest_error_across": largest_error(rows, ACROSS),
        "seconds": watch.seconds,
    }
    return document, _text(rows, str(test.config.measure.method)), watch.seconds, code


class _Watch:
    """Seconds per stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = perf_counter()

    def lap(self, stage: str) -> None:
        now = perf_counter()
        self.seconds[stage] = now - self._last
        self._last = now


def against_truth(compared: "pl.DataFrame", steps: "pl.DataFrame") -> list[dict[str, Any]]:
    """Set measured and true change of every section side by side, at the largest load step."""
    from lidar_deflect import comparison

    step = comparison.largest_step(compared)
    status = {row["section"]: row["status"] for row in steps.to_dicts() if row["step"] == step}
    rows: dict[str, dict[str, Any]] = {}
    for row in compared.to_dicts():
        if row["step"] == step and row["source"] == "truth":
            entry = rows.setdefault(
                row["section"],
                {
                    "section": row["section"],
                    "s_m": row["s_m"],
                    "step": step,
                    "status": status[row["section"]],
                },
            )
            entry[f"{row['quantity']}_m"] = row["measured_m"]
            entry[f"{row['quantity']}_true_m"] = row["reference_m"]
    return sorted(rows.values(), key=lambda entry: float(entry["s_m"]))


ACROSS = ("dx", "dy")
COMPONENTS = (*ACROSS, "dz")


def largest_error(
    rows: list[dict[str, Any]], components: Sequence[str] = COMPONENTS
) -> dict[str, Any] | None:
    """Return the component that is farthest from the truth: section, quantity, error in metres."""
    errors = [
        {
            "section": row["section"],
            "quantity": quantity,
            "error_m": row[f"{quantity}_m"] - row[f"{quantity}_true_m"],
        }
        for row in rows
        for quantity in components
        if row.get(f"{quantity}_m") is not None
    ]
    return max(errors, key=lambda error: abs(error["error_m"]), default=None)


QUANTITIES = (("dx", "x"), ("dy", "y"), ("dz", "z"), ("total", "total"))


def _text(rows: list[dict[str, Any]], method: str) -> str:
    if not rows:
        return "no section was measured at the largest load step"
    header = ["section", "", *(f"{word} (m)" for _, word in QUANTITIES), "status"]
    lines = [line for row in rows for line in _lines(row)]
    head = f"change of coordinates at {rows[0]['step']}, method {method}, simulated data\n"
    worst, across = largest_error(rows), largest_error(rows, ACROSS)
    tail = f"\n\nlargest error: {_error(worst)}; across the blade: {_error(across)}"
    return head + table(header, lines) + tail


def _error(error: dict[str, Any] | None) -> str:
    if error is None:
        return "-"
    return f"{abs(error['error_m']):.3f} m, in {error['quantity'][1:]} of {error['section']}"


def _lines(row: dict[str, Any]) -> Iterator[list[str]]:
    measured = [row.get(f"{key}_m") for key, _ in QUANTITIES]
    true = [row.get(f"{key}_true_m") for key, _ in QUANTITIES]
    errors = [
        None if own is None or other is None else own - other
        for own, other in zip(measured, true, strict=True)
    ]
    name = str(row["section"])
    for word, values in (("measured", measured), ("true", true), ("error", errors)):
        first = word == "measured"
        ends = (name, str(row["status"])) if first else ("", "")
        yield [ends[0], word, *map(_metres, values), ends[1]]


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
