"""Is what was read while tripods were watched used, and let go where nobody wants it?"""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from lidar_deflect.measurement.beam import ahead, seen

if TYPE_CHECKING:
    from collections.abc import Callable

EARLY, LATE = (0, 1), (2, 3)


def inputs(known: dict[Any, str] | None) -> Any:
    return SimpleNamespace(
        ahead=None if known is None else lambda: known, listener=lambda _stage: None
    )


def test_spans_that_were_read_ahead_are_not_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seen, "read_now", lambda *_: pytest.fail("read again"))
    found: Any = seen.seen_in(inputs({EARLY: "early", LATE: "late"}), Any, [LATE, EARLY])
    assert found == ["late", "early"]


@pytest.mark.parametrize("known", [None, {}, {EARLY: "early"}])
def test_all_are_read_where_one_is_missing(
    monkeypatch: pytest.MonkeyPatch, known: dict[Any, str] | None
) -> None:
    monkeypatch.setattr(seen, "read_now", lambda *given: list(given[2]))
    found: Any = seen.seen_in(inputs(known), Any, [LATE, EARLY])
    assert found == [LATE, EARLY]


def test_reading_ends_with_what_it_is_done_beside(monkeypatch: pytest.MonkeyPatch) -> None:
    def read_on(_inputs: Any, go_on: Callable[[int, int], None]) -> None:
        while True:
            go_on(0, 1)

    monkeypatch.setattr(ahead, "_read", read_on)
    with pytest.raises(KeyboardInterrupt), ahead.read_beside(inputs(None)):
        raise KeyboardInterrupt


def test_its_failure_is_told_to_who_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise ValueError("no such lidar")

    monkeypatch.setattr(ahead, "_read", fail)
    with ahead.read_beside(inputs(None)) as read:
        pass
    with pytest.raises(ValueError, match="no such lidar"):
        read()
