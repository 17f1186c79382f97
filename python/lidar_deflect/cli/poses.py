"""``lidar-deflect poses``: poses to and from the files of other tools."""

from pathlib import Path
from typing import Annotated

import typer

from lidar_deflect.cli.options import Json, Overwrite, Quiet, Verbose, free, pairs
from lidar_deflect.cli.talk import Talk, table

SCHEMA = "lidar-deflect.poses/1"


def poses(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="POSES",
            help="calibration.toml, or .json .yaml .kitti .tum .txt of other tools.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="Format by suffix: .toml calibration, .json Ouster, .yaml ROS static transforms, "
            ".kitti, .tum, .txt 4 x 4; without it they are only shown.",
        ),
    ] = None,
    format_: Annotated[
        str | None,
        typer.Option(
            "--format", metavar="NAME", help="calibration, ouster, ros, kitti, tum or matrix."
        ),
    ] = None,
    from_format: Annotated[
        str | None, typer.Option("--from-format", metavar="NAME", help="The same for POSES.")
    ] = None,
    name: Annotated[
        list[str] | None,
        typer.Option("--name", metavar="FRAME=NAME", help="Rename a frame; repeatable."),
    ] = None,
    frame: Annotated[
        str, typer.Option("--frame", metavar="NAME", help="Name of the world frame.")
    ] = "world",
    config: Annotated[
        Path | None,
        typer.Option(
            "--config",
            "-c",
            metavar="TOML",
            help="Write this configuration to FILE, with the poses as start of its lidars.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Bring poses into the files of other tools, and back.

    Every pose takes points of the sensor's frame to the world: that of the vendor's driver.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    names = pairs(name, "--name", "FRAME=NAME")
    if config is not None and out is None:
        raise typer.BadParameter("--config needs --out: where to write the configuration")
    if out is not None:
        free(out, overwrite)
    from lidar_deflect import interchange
    from lidar_deflect.files import write_text

    read = interchange.read(
        source, format_name=from_format, world=frame if frame != "world" else None
    )
    placed = interchange.renamed(read, names)
    if out is not None and config is not None:
        write_text(out, interchange.started(config, placed), overwrite=overwrite)
    elif out is not None:
        interchange.write(out, placed, format_name=format_, world=frame, overwrite=overwrite)
    document = {
        "schema": SCHEMA,
        "out": None if out is None else str(out),
        "world": frame,
        "poses": [
            {"name": p.name, "world_from_sensor": p.world_from_sensor.tolist()} for p in placed
        ],
    }
    rows = [[p.name, *(f"{value:.4f}" for value in p.world_from_sensor[:3, 3])] for p in placed]
    talk.result(document, table(["sensor", "x m", "y m", "z m"], rows))
    if out is not None:
        talk.note(f"written: {out}")
