"""``lidar-deflect compare``: a measurement against wires, a prediction, truth or another run."""

from pathlib import Path
from typing import Annotated

import typer

from lidar_deflect.cli.measure import measured_steps
from lidar_deflect.cli.options import Json, Overwrite, Quiet, Verbose, free
from lidar_deflect.cli.talk import Talk

SCHEMA = "lidar-deflect.compare/1"


def compare(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="Folder of `measure`.")],
    other: Annotated[
        Path | None, typer.Argument(metavar="[OTHER]", help="A second run to compare with.")
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option(
            "--reference", "-r", metavar="FILE", help="Wires, a prediction, a truth table, a run."
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option("--kind", help="What the reference is, where its columns do not tell."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="HTML", help="Page of two runs; default: in the first folder."
        ),
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Hold a measurement against a reference, or against another run.

    Prints the paper's table 2 and keeps comparison.parquet in the result folder. Of two runs it
    prints their differences with their intervals, and writes a page of them.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    against = reference or other
    if against is None or (reference and other):
        raise typer.BadParameter("name one reference: --reference FILE, or a second run")
    from lidar_deflect import comparison

    taken = comparison.recognise(against, kind=kind)
    talk.note(f"{against}: taken as {taken.kind} ({taken.why})")
    if taken.kind == "run":
        return _two_runs(results, against, out, overwrite, talk)
    refuse_unloaded(results)
    frame = comparison.compare(results, taken)
    comparison.save(results, frame)
    document = {"schema": SCHEMA, "rows": frame.to_dicts()}
    return talk.result(document, comparison.table2(frame))


def _two_runs(results: Path, other: Path, out: Path | None, overwrite: bool, talk: Talk) -> None:
    from dataclasses import asdict

    from lidar_deflect import comparison
    from lidar_deflect.comparison import runs
    from lidar_deflect.folder import Folder
    from lidar_deflect.report import two_runs

    first, second = Folder(results), Folder(other)
    found = runs.differences(first, second)
    comparison.save(first, comparison.compare(first, other))
    names = two_runs.names_of(first, second)
    page = out or results / f"compare-{second.path.resolve().name}.html"
    if out is not None:
        free(out, overwrite)
    two_runs.write(results, other, page)
    rows = [{**asdict(each), "beyond": each.is_beyond} for each in found]
    document = {"schema": SCHEMA, "rows": rows, "page": str(page)}
    talk.result(document, runs.text(found, names))
    talk.note(f"page: {page}")


def refuse_unloaded(results: Path) -> None:
    """Refuse a run without a loaded hold: of nothing but noise there is no error in percent."""
    from lidar_deflect.errors import MeasurementError
    from lidar_deflect.folder import Folder

    steps = measured_steps(Folder(results).steps)
    if all(step.startswith("0 %") for step in steps):
        raise MeasurementError(
            f"{results} has no loaded hold",
            code="comparison.not_loaded",
            facts=[("steps", ", ".join(steps) or "none")],
            hint="measure a capture in which the blade is held under load",
        )
