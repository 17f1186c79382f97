"""The command line: one file per command; heavy imports live inside the commands."""

import sys


def main() -> None:
    """Run the command line and leave with its exit code; Ctrl-C counts from the first moment."""
    try:
        from lidar_deflect.cli.app import run

        code = run(sys.argv[1:])
    except KeyboardInterrupt:
        code = 130
    sys.exit(code)
