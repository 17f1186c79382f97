"""``lidar-deflect report``: one HTML file that works offline."""

from pathlib import Path
from typing import Annotated

import typer

from lidar_deflect.cli.options import Json, Overwrite, Quiet, Verbose, free
from lidar_deflect.cli.talk import Talk

SCHEMA = "lidar-deflect.report/1"
FILE = "report.html"


def report(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="Folder of `measure`.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="HTML", help="Default: report.html in the folder."),
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write one HTML file with figures and tables.

    Made from the result folder alone; works offline.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    if out is not None:
        free(out, overwrite)
    from lidar_deflect import report as reports

    path = reports.write(results, out)
    talk.result({"schema": SCHEMA, "report": str(path)}, str(path))
