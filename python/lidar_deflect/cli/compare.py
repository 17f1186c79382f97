"""``lidar-deflect compare``: a measurement against wires, a prediction, truth or another run."""

from pathlib import Path
from typing import Annotated

import typer

from lidar_deflect.cli.measure import measured_steps
from lidar_deflect.cli.options import Json, Quiet, Verbose
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
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Hold a measurement against a reference.

    Prints the paper's table 2 and keeps comparison.parquet in the result folder.
    """
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    against = reference or other
    if against is None or (reference and other):
        raise typer.BadParameter("name one reference: --reference FILE, or a second run")
    from lidar_deflect import comparison

    taken = comparison.recognise(against, kind=kind)
    talk.note(f"{against}: taken as {taken.kind} ({taken.why})")
    if taken.kind != "run":
        refuse_unloaded(results)
    frame = comparison.compare(results, taken)
    comparison.save(results, frame)
    document = {"schema": SCHEMA, "rows": frame.to_dicts()}
    talk.result(document, comparison.table2(frame))


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
