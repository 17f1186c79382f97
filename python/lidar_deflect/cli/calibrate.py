"""``lidar-deflect calibrate``: the poses of all lidars."""

from pathlib import Path
from typing import Annotated

import typer

from lidar_deflect.cli.measure import QUALITY
from lidar_deflect.cli.options import (
    Beams,
    Captures,
    ConfigFile,
    From,
    Json,
    Lidars,
    Overwrite,
    Quiet,
    Sensors,
    Set,
    Threads,
    To,
    Verbose,
    free,
    span,
)
from lidar_deflect.cli.talk import Talk
from lidar_deflect.cli.units import narrowed, overrides

SCHEMA = "lidar-deflect.calibrate/1"


def calibrate(
    captures: Captures,
    config: ConfigFile,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="TOML", help="Calibration to write.")
    ] = Path("calibration.toml"),
    set_: Set = None,
    sensor: Sensors = None,
    beams: Beams = None,
    lidar: Lidars = None,
    start: From = None,
    stop: To = None,
    overwrite: Overwrite = False,
    threads: Threads = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Find the poses of all lidars.

    From captures of the unloaded blade. Exits with 6 where the verdict on the poses is poor.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    free(out, overwrite)
    changes = overrides(config, set_, sensor, beams)
    from lidar_deflect.pipeline import Test

    test = Test.load(config, changes)
    test = Test(narrowed(test.config, lidar, None), test.path)
    start_s, stop_s = span(start, stop, captures)
    with talk.progress("calibrating") as progress:
        calibration = test.calibrate(
            *captures, start_s=start_s, stop_s=stop_s, progress=progress.stage, threads=threads
        )
    calibration.save(out, overwrite=overwrite)
    document = {"schema": SCHEMA, "out": str(out), "calibration": calibration.to_dict()}
    talk.result(document, calibration.summary())
    talk.note(f"written: {out}")
    return QUALITY if calibration.is_poor else 0
