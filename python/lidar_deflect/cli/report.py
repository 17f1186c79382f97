"""``lidar-deflect report``: one HTML file that works offline; a PDF, a workbook, CSV files."""

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
    pdf: Annotated[
        bool, typer.Option("--pdf", help="A PDF/A beside it; needs the extra `pdf`.")
    ] = False,
    xlsx: Annotated[
        bool, typer.Option("--xlsx", help="A workbook beside it; needs the extra `xlsx`.")
    ] = False,
    csv: Annotated[
        bool, typer.Option("--csv", help="A folder of CSV files beside it, one per table.")
    ] = False,
    overwrite: Overwrite = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write one HTML file with figures and tables.

    Made from the result folder alone; works offline. The other formats take its name with a
    suffix of their own.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    page = out if out is not None else results / FILE
    wanted = {"pdf": pdf, "xlsx": xlsx, "csv": csv}
    paths = {kind: page.with_suffix(f".{kind}") for kind, asked in wanted.items() if asked}
    if out is not None:
        for path in (page, *paths.values()):
            free(path, overwrite)
    from lidar_deflect import report as reports

    document = {"schema": SCHEMA, "report": str(reports.write(results, page))}
    for kind, path in paths.items():
        document[kind] = str(_write(kind, results, path, talk))
    talk.result(document, "\n".join(text for key, text in document.items() if key != "schema"))


def _write(kind: str, results: Path, path: Path, talk: Talk) -> Path:
    if kind == "xlsx":
        from lidar_deflect.report import spreadsheet

        return spreadsheet.write(results, path)
    if kind == "csv":
        from lidar_deflect.report import csvs

        return csvs.write(results, path)
    from lidar_deflect.report import pdf

    return pdf.write(results, path, warn=talk.warn)
