"""The compiled core; private. Its public face are the modules of this package."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CaptureScan",
    "PointIterator",
    "Sweep",
    "SweepIterator",
    "__version__",
    "check_captures",
    "cut_capture",
    "scan_capture",
    "sensor_models",
]

__version__: str

def check_captures(paths: Sequence[Path]) -> None: ...
def cut_capture(
    scan: CaptureScan,
    out: Path,
    *,
    lidars: Sequence[int],
    start_ns: int | None = None,
    stop_ns: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> int: ...
def scan_capture(
    paths: Sequence[Path],
    *,
    sensors: Sequence[tuple[str, str]],
    progress: Callable[[int, int], None] | None = None,
) -> CaptureScan: ...
def sensor_models() -> list[tuple[str, str]]: ...

@final
class CaptureScan:
    @property
    def lidars(self) -> list[str]: ...
    @property
    def first_time_ns(self) -> int | None: ...
    @property
    def last_time_ns(self) -> int | None: ...
    def describe(self) -> dict[str, Any]: ...
    def health(self) -> dict[str, Any]: ...

@final
class PointIterator(Iterator[dict[str, NDArray[Any]]]):
    def __new__(
        cls,
        scan: CaptureScan,
        *,
        lidars: Sequence[int],
        block_points: int,
        start_ns: int | None = None,
        stop_ns: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> PointIterator: ...
    def __iter__(self) -> PointIterator: ...
    def __next__(self) -> dict[str, NDArray[Any]]: ...
    @property
    def merged(self) -> int: ...
    @property
    def drops(self) -> list[tuple[str, int]]: ...

@final
class Sweep:
    @property
    def lidar(self) -> str: ...
    @property
    def index(self) -> int: ...
    @property
    def start_ns(self) -> int: ...
    @property
    def end_ns(self) -> int: ...
    @property
    def coverage(self) -> float: ...
    @property
    def packets(self) -> int: ...
    @property
    def lost(self) -> int: ...
    @property
    def xyz(self) -> NDArray[np.float32]: ...
    @property
    def time_ns(self) -> NDArray[np.int64]: ...
    @property
    def ring(self) -> NDArray[np.uint16]: ...
    @property
    def range_m(self) -> NDArray[np.float32]: ...
    @property
    def azimuth_deg(self) -> NDArray[np.float32]: ...
    @property
    def intensity(self) -> NDArray[np.uint16]: ...
    @property
    def return_index(self) -> NDArray[np.uint8]: ...
    @property
    def return_kind(self) -> NDArray[np.uint8]: ...
    @property
    def packet(self) -> NDArray[np.uint32]: ...
    @property
    def block(self) -> NDArray[np.uint16]: ...
    def __len__(self) -> int: ...

@final
class SweepIterator(Iterator[Sweep]):
    def __new__(
        cls,
        scan: CaptureScan,
        *,
        lidars: Sequence[int],
        names: Sequence[str],
        cut_rad: Sequence[float],
        start_ns: int | None = None,
        stop_ns: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> SweepIterator: ...
    def __iter__(self) -> SweepIterator: ...
    def __next__(self) -> Sweep: ...
    @property
    def merged(self) -> int: ...
