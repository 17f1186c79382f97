"""``lidar-deflect decode``: the points of a capture as a table or point cloud."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from lidar_deflect.cli.options import (
    Beams,
    Captures,
    From,
    Json,
    Lidars,
    Overwrite,
    Quiet,
    Sensors,
    Threads,
    To,
    Verbose,
    beam_files,
    free,
    sensor_models,
    span,
)
from lidar_deflect.cli.talk import Talk, grouped

SCHEMA = "lidar-deflect.decode/1"


def decode(
    captures: Captures,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="Kind by suffix: .parquet .csv .npz .las .laz .ply .pcd .pcap",
        ),
    ] = Path("points.parquet"),
    lidar: Lidars = None,
    sensor: Sensors = None,
    beams: Beams = None,
    start: From = None,
    stop: To = None,
    overwrite: Overwrite = False,
    threads: Threads = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write the points of a capture.

    In the sensor frame and in the order of arrival.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    models, files = sensor_models(sensor), beam_files(beams)
    free(out, overwrite)
    from lidar_deflect import capture
    from lidar_deflect import decode as decoding

    opened = capture.open(captures, sensors=models, beams=files)
    start_s, stop_s = span(start, stop, captures)
    with talk.progress("decoding") as progress:
        counts = decoding.decode(
            opened,
            out,
            lidars=lidar,
            start_s=start_s,
            stop_s=stop_s,
            overwrite=overwrite,
            progress=progress.amount,
            threads=threads,
        )
    document = {"schema": SCHEMA, "out": str(out), **counts}
    talk.result(document, f"{out}: {_counted(counts)}")


def _counted(counts: Mapping[str, Any]) -> str:
    merged = f", {grouped(counts['merged'])} merged" if counts["merged"] else ""
    return f"{grouped(counts['points'])} points{merged}"
