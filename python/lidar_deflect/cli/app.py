"""The verbs of ``lidar-deflect``, and the way from an exception to an exit code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from lidar_deflect.cli import (
    calibrate,
    check,
    compare,
    decode,
    demo,
    info,
    init,
    measure,
    poses,
    report,
    schema,
    simulate,
)
from lidar_deflect.cli.failure import show
from lidar_deflect.cli.interrupt import INTERRUPT

if TYPE_CHECKING:
    from collections.abc import Sequence

PROGRAM = "lidar-deflect"
# In the order in which somebody meets them.
COMMANDS = (
    ("demo", demo.demo),
    ("info", info.info),
    ("init", init.init),
    ("check", check.check),
    ("decode", decode.decode),
    ("calibrate", calibrate.calibrate),
    ("poses", poses.poses),
    ("measure", measure.measure),
    ("compare", compare.compare),
    ("report", report.report),
    ("simulate", simulate.simulate),
    ("schema", schema.schema),
)

app = typer.Typer(
    name=PROGRAM,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _name, _function in COMMANDS:
    app.command(_name)(_function)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(PROGRAM, version(PROGRAM))
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Large 3D deflections of wind turbine blades, from the raw packets of several lidars.

    Start with `demo`, which needs no data. With captures: info, init, check, measure, report.
    """


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code; nothing but its result is on stdout."""
    with INTERRUPT.armed():
        return _run(arguments)


def _run(arguments: Sequence[str]) -> int:
    try:
        code = app(list(arguments), prog_name=PROGRAM, standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        INTERRUPT.disarm()
        return show(KeyboardInterrupt() if INTERRUPT.came else error, arguments)
    except SystemExit as left:
        code = left.code
    INTERRUPT.disarm()
    if INTERRUPT.came and code:
        return show(KeyboardInterrupt(), arguments)
    return int(code or 0)
