"""Ctrl-C: remembered until the command has ended, whatever a library makes of it."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

AGAIN_S = 0.01
"""After this the interrupt that Python only printed strikes again, where it is heard."""


class Interrupt:
    """Remembers that Ctrl-C came.

    The exception alone is not enough: it may strike inside a destructor, where Python only prints
    it, or inside of a library that turns every exception into one of its own, or into nothing.
    """

    def __init__(self) -> None:
        self.came = False
        self._before: Any = None

    @contextmanager
    def armed(self) -> Iterator[None]:
        """Take Ctrl-C within, unless it is taken already."""
        taken = self._before is not None
        if not taken:
            self.arm()
        try:
            yield
        finally:
            if not taken:
                self.restore()

    def arm(self) -> None:
        """Take Ctrl-C from here on."""
        self.came = False
        try:
            self._before = signal.signal(signal.SIGINT, self._raise)
        except ValueError:  # not the main thread: whoever runs us there handles signals
            return
        sys.unraisablehook = self._unraisable

    def check(self) -> None:
        """Raise again what was swallowed; long calls come here between their blocks."""
        if self.came:
            raise KeyboardInterrupt

    def disarm(self) -> None:
        """Ignore further interrupts: what is left takes no time."""
        if self._before is not None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    def restore(self) -> None:
        """Give Ctrl-C back to whoever had it."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
            sys.unraisablehook = sys.__unraisablehook__
            self._before = None

    def _raise(self, *_: object) -> None:
        self.came = True
        raise KeyboardInterrupt

    def _unraisable(self, unraisable: Any) -> None:
        if unraisable.exc_type is not None and issubclass(unraisable.exc_type, KeyboardInterrupt):
            threading.Timer(AGAIN_S, self._strike_again).start()
        else:
            sys.__unraisablehook__(unraisable)

    def _strike_again(self) -> None:
        if self._before is not None:
            _thread.interrupt_main()


INTERRUPT = Interrupt()
"""That of this process."""
