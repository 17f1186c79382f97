"""Memory of large arrays: handed back to the system as soon as they are gone."""

from __future__ import annotations

import ctypes
import sys
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_MMAP_THRESHOLD = -3  # M_MMAP_THRESHOLD of malloc.h
_LARGE, _MOST = 1 << 18, 1 << 25
"""Arrays from this size on have pages of their own, at times; otherwise from the size to which
glibc comes by itself."""


@contextmanager
def own_pages() -> Iterator[None]:
    """Give large arrays that are made meanwhile pages of their own, which go back with them.

    The allocator of Linux would keep their memory and fill it with other things, so that the next
    ones find no room. It costs time where arrays come and go, hence not always.
    """
    option = _option()
    if option is not None:
        option(_MMAP_THRESHOLD, _LARGE)
    try:
        yield
    finally:
        if option is not None:
            option(_MMAP_THRESHOLD, _MOST)


@cache
def _option() -> Callable[[int, int], int] | None:
    if sys.platform != "linux":
        return None
    return getattr(ctypes.CDLL(None), "mallopt", None)  # of glibc
