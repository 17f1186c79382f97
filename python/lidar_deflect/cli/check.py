"""``lidar-deflect check``: whether a configuration fits its captures."""

from typing import TYPE_CHECKING, Any

from lidar_deflect.cli.options import Captures, ConfigFile, Json, Quiet, Set, Verbose
from lidar_deflect.cli.talk import Talk
from lidar_deflect.cli.units import overrides

if TYPE_CHECKING:
    from lidar_deflect.checks import Finding

SCHEMA = "lidar-deflect.check/1"


def check(
    captures: Captures,
    config: ConfigFile,
    set_: Set = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Validate a configuration against captures; run nothing."""
    talk = Talk(as_json=json, quiet=quiet, verbose=verbose)
    changes = overrides(config, set_)
    from lidar_deflect.pipeline import Test

    findings = Test.load(config, changes).check(captures)
    code = max((finding.exit_code for finding in findings), default=0)
    document = {
        "schema": SCHEMA,
        "exit_code": code,
        "findings": [_document(finding) for finding in findings],
    }
    talk.result(document, "\n".join(_line(finding) for finding in findings) or "all is well")
    return code


def _document(finding: "Finding") -> dict[str, Any]:
    return {
        "code": finding.code,
        "message": finding.message,
        "hint": finding.hint,
        "exit_code": finding.exit_code,
    }


def _line(finding: "Finding") -> str:
    kind = "error" if finding.exit_code else "note"
    hint = f"\n  hint     {finding.hint}" if finding.hint else ""
    return f"{kind}[{finding.code}]: {finding.message}{hint}"
