"""The command line: one file per command; heavy imports live inside the commands."""

import os
import sys

from lidar_deflect.cli.interrupt import INTERRUPT

INTERRUPTED = 130


def main() -> None:
    """Run the command line and leave with its exit code; Ctrl-C counts from the first moment."""
    INTERRUPT.arm()
    try:
        from lidar_deflect.cli.app import run

        INTERRUPT.check()
        code = run(sys.argv[1:])
    except KeyboardInterrupt:  # while the command line itself was still being loaded
        sys.stderr.write("error[interrupted]: interrupted; nothing half-written is left\n")
        code = INTERRUPTED
    INTERRUPT.disarm()
    if code == INTERRUPTED:
        # Threads of libraries may still be at work, and would abort on an interpreter that ends.
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
