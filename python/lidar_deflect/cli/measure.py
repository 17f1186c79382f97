"""``lidar-deflect measure``: the deflection tables."""

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from lidar_deflect.cli.options import (
    Beams,
    Captures,
    ConfigFile,
    From,
    Json,
    Lidars,
    Overwrite,
    Quiet,
    Sections,
    Sensors,
    Set,
    Threads,
    Timings,
    To,
    Verbose,
    free,
    span,
)
from lidar_deflect.cli.talk import Talk
from lidar_deflect.cli.units import narrowed, overrides

if TYPE_CHECKING:
    import polars as pl

    from lidar_deflect.result import Result

SCHEMA = "lidar-deflect.measure/1"
QUALITY = 6


def measure(
    captures: Captures,
    config: ConfigFile,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="DIR", help="Folder of results.")
    ] = Path("results"),
    calibration: Annotated[
        Path | None,
        typer.Option("--calibration", metavar="TOML", help="Poses; default: from these captures."),
    ] = None,
    method: Annotated[
        str | None, typer.Option("--method", metavar="beam|paper", help="Instead of the file's.")
    ] = None,
    set_: Set = None,
    sensor: Sensors = None,
    beams: Beams = None,
    lidar: Lidars = None,
    section: Sections = None,
    start: From = None,
    stop: To = None,
    overwrite: Overwrite = False,
    threads: Threads = None,
    timings: Timings = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Measure the deflection of all sections over a test."""
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    free(out, overwrite)
    changes = overrides(config, set_, sensor, beams)
    changes += [f"measure.method={method}"] if method else []
    from lidar_deflect import comparison, cycles, explanation
    from lidar_deflect.calibration import Calibration
    from lidar_deflect.pipeline import Test

    begun = perf_counter()
    test = Test.load(config, changes)
    test = Test(narrowed(test.config, lidar, section), test.path)
    poses = Calibration.load(calibration) if calibration else None
    start_s, stop_s = span(start, stop, captures)
    with talk.progress("measuring") as progress:
        result = test.measure(
            *captures,
            calibration=poses,
            start_s=start_s,
            stop_s=stop_s,
            progress=progress.stage,
            threads=threads,
        )
    result.save(out, overwrite=overwrite)
    code = verdict(result, talk)
    document = {
        "schema": SCHEMA,
        "out": str(out),
        "exit_code": code,
        "steps": result.steps.to_dicts(),
        "run": result.run,
    }
    swung = cycles.text(result.run["cycles"]) if "cycles" in result.run else None
    talk.result(document, swung or comparison.table1(result.steps))
    for told in explanation.largest(result) if verbose else ():
        talk.detail(told.text())
    talk.note(f"written: {out}")
    seconds = {**result.run["timings_s"], "total": perf_counter() - begun}
    talk.timings(timings, seconds, result.run)
    return code


def verdict(result: "Result", talk: Talk) -> int:
    """Pass on what a reader of the result should know; return the exit code of a finished run."""
    for warning in result.run["warnings"]:
        talk.warn(warning)
    swings = result.config.test.kind == "fatigue"
    if not swings and all(step.startswith("0 %") for step in measured_steps(result.steps)):
        talk.warn("no loaded hold was found: there is no deflection but noise")
    for gate in result.failed_gates:
        talk.warn(f"quality gate: {gate}")
    return QUALITY if result.failed_gates else 0


def measured_steps(steps: "pl.DataFrame") -> list[str]:
    """Return the load steps in which at least one section was measured."""
    return sorted({row["step"] for row in steps.to_dicts() if row["d_m"] is not None})
