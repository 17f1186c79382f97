"""Errors as people and scripts read them: place, found, expected, one next step."""

from __future__ import annotations

import errno
import json
import sys
import traceback
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import typer

from lidar_deflect.errors import LidarDeflectError

if TYPE_CHECKING:
    from collections.abc import Sequence

BUG, USAGE, INPUT, ENVIRONMENT, INTERRUPTED = 1, 2, 3, 7, 130
SCHEMA = "lidar-deflect.error/1"

# Every error of the command line's own parser descends from this class. It is not imported by
# name because typer moved it from click into a copy of its own.
_USAGE_ERROR: Any = next(
    kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException"
)


@dataclass(frozen=True)
class Failure:
    """One error, ready to be shown."""

    exit_code: int
    code: str
    message: str
    facts: tuple[tuple[str, str], ...] = ()
    hint: str | None = None
    extra: tuple[str, ...] = field(default=())

    def text(self) -> str:
        """Lay out the error for people."""
        lines = [*self.facts] + ([("hint", self.hint)] if self.hint else [])
        width = max([8, *(len(word) for word, _ in lines)]) + 1
        head = f"error[{self.code}]: {self.message}"
        return "\n".join([head, *(f"  {word:<{width}}{line}" for word, line in lines), *self.extra])

    def document(self) -> dict[str, Any]:
        """Lay out the error for scripts."""
        error = {
            "code": self.code,
            "message": self.message,
            "facts": [list(fact) for fact in self.facts],
            "hint": self.hint,
        }
        return {"schema": SCHEMA, "exit_code": self.exit_code, "error": error}


def show(error: BaseException, arguments: Sequence[str]) -> int:
    """Present an error, on stdout too where ``--json`` asks for it, and return its exit code."""
    verbose = bool({"-v", "--verbose"} & set(arguments))
    failure = _failure(error, verbose)
    if "--json" in arguments:
        print(json.dumps(failure.document(), indent=2, ensure_ascii=False))
        sys.stdout.flush()
    elif failure.message:
        print(failure.text(), file=sys.stderr)
    return failure.exit_code


def _failure(error: BaseException, verbose: bool) -> Failure:
    if isinstance(error, KeyboardInterrupt | typer.Abort):
        return Failure(INTERRUPTED, "interrupted", "interrupted; nothing half-written is left")
    if isinstance(error, LidarDeflectError):
        return Failure(error.exit_code, error.code, error.message, error.facts, error.hint)
    if isinstance(error, _USAGE_ERROR):
        return _usage(error)
    if isinstance(error, MemoryError):
        hint = "use fewer threads (-j), or a shorter span (--from, --to)"
        return Failure(ENVIRONMENT, "environment.memory", "not enough memory", hint=hint)
    if isinstance(error, OSError):
        return _system(error)
    return _bug(error, verbose)


def _usage(error: Any) -> Failure:
    context = getattr(error, "ctx", None)
    place = context.command_path if context is not None else "lidar-deflect"
    message = " ".join(str(error.format_message()).split())
    if type(error).__name__ == "NoArgsIsHelpError":  # its message is the help page
        print(error.format_message(), file=sys.stderr)
        return Failure(USAGE, "usage", "")
    return Failure(USAGE, "usage", message, hint=f"{place} --help")


def _system(error: OSError) -> Failure:
    """Tell what the operating system refused."""
    facts = (("path", str(error.filename)),) if error.filename else ()
    reason = error.strerror or str(error)
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        hint = "free some space, or write elsewhere with -o"
        return Failure(ENVIRONMENT, "output.full", f"no room to write: {reason}", facts, hint)
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        hint = "check the permissions of the file and its folder"
        return Failure(ENVIRONMENT, "environment.denied", reason, facts, hint)
    if isinstance(error, FileNotFoundError):
        return Failure(INPUT, "input.not_found", reason, facts)
    return Failure(ENVIRONMENT, "environment.system", reason, facts)


def _bug(error: BaseException, verbose: bool) -> Failure:
    frames = traceback.extract_tb(error.__traceback__)
    place = f"{frames[-1].filename}, line {frames[-1].lineno}" if frames else "unknown"
    text = f"{type(error).__name__}: {error}".splitlines()[0][:300]
    if verbose:
        return Failure(
            BUG,
            "bug",
            text,
            (("place", place),),
            "report it with the lines below, the command and the version",
            tuple("".join(traceback.format_exception(error)).splitlines()),
        )
    hint = "this is a fault of the program: report it with the output of the same command with -v"
    return Failure(BUG, "bug", text, (("place", place),), hint)
