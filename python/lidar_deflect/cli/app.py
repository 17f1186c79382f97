"""The verbs of ``lidar-deflect``, and the way from an exception to an exit code."""

from __future__ import annotations

import signal
import sys
from typing import TYPE_CHECKING, Annotated, Any

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
    report,
    schema,
    simulate,
)
from lidar_deflect.cli.failure import show

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
    interrupt = _Interrupt()
    try:
        code = app(list(arguments), prog_name=PROGRAM, standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        interrupt.disarm()
        return show(KeyboardInterrupt() if interrupt.came else error, arguments)
    except SystemExit as left:
        code = left.code
    interrupt.disarm()
    if interrupt.came and code:
        return show(KeyboardInterrupt(), arguments)
    return int(code or 0)


class _Interrupt:
    """Remembers that Ctrl-C came, should a library turn the interrupt into another error."""

    def __init__(self) -> None:
        self.came = False
        try:
            signal.signal(signal.SIGINT, self._raise)
        except ValueError:  # not the main thread: whoever runs us there handles signals
            return
        sys.unraisablehook = self._unraisable

    def _raise(self, *_: object) -> None:
        self.came = True
        raise KeyboardInterrupt

    def _unraisable(self, unraisable: Any) -> None:
        """Let an interrupt that came inside a destructor through, instead of printing it."""
        if unraisable.exc_type is not None and issubclass(unraisable.exc_type, KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        else:
            sys.__unraisablehook__(unraisable)

    def disarm(self) -> None:
        """Ignore further interrupts: what is left takes no time."""
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        except ValueError:
            return
