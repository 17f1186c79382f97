"""What holds and stretches show, read on a thread of its own while something else is done."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Event
from typing import TYPE_CHECKING

from lidar_deflect.measurement import paper
from lidar_deflect.measurement.beam import moments
from lidar_deflect.measurement.beam.expected import given
from lidar_deflect.measurement.beam.following import few
from lidar_deflect.measurement.beam.seen import read_now, spans_of
from lidar_deflect.measurement.beam.stretches import stretches_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from lidar_deflect._native import BeamSeen
    from lidar_deflect.measurement.beam.seen import Span
    from lidar_deflect.measurement.inputs import Inputs

    Seen = Callable[[], Mapping[Span, BeamSeen]]


class _UnwantedError(Exception):
    """Nobody waits for what is read."""


@contextmanager
def read_beside(inputs: Inputs) -> Iterator[Seen]:
    """Read what the beam method will ask for, with every tripod where it stood at first.

    Yields
    ------
    Callable
        Waits for what was seen, by span: of no use where a tripod moved.
    """
    is_over = Event()

    def go_on(_done: int, _total: int) -> None:
        if is_over.is_set():
            raise _UnwantedError

    with ThreadPoolExecutor(1) as beside:
        reading = beside.submit(_read, inputs, go_on)
        try:
            yield reading.result
        except BaseException:
            is_over.set()
            raise


def _read(inputs: Inputs, listener: Callable[[int, int], None]) -> Mapping[Span, BeamSeen]:
    expected = given(inputs)
    if expected is None:
        return {}
    holds_ns = [span_ns for _, span_ns in spans_of(inputs, expected.holds)]
    between = stretches_of(expected, holds_ns, moments(inputs))
    spans_ns = [*holds_ns, *few(between)]
    seen = read_now(inputs, paper.plan_of(inputs), spans_ns, listener)
    return dict(zip(spans_ns, seen, strict=True))
