"""Points of a capture as files: parquet, csv, npz, las, laz, ply, pcd, or a shorter capture.

Everything is streamed: memory does not grow with the capture. Files get their name when they are
complete.
"""

import hashlib
import json
import queue
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import _native
from lidar_deflect import capture as captures
from lidar_deflect.capture import RETURN_KINDS, Capture
from lidar_deflect.errors import CaptureError, InvalidValueError
from lidar_deflect.files import keep_interrupts_from_polars, whole_file
from lidar_deflect.lasfiles import LasFile, LazFile
from lidar_deflect.pointfiles import PLAIN, Block, NpzFile, PcdFile, PlyFile, PointFile

if TYPE_CHECKING:
    import polars as pl

__all__ = ["decode"]

Progress = Callable[[int, int], None]

BLOCK_POINTS = 1 << 19
"""Points that are decoded and written at a time."""


def decode(
    capture: Capture,
    out: str | Path,
    *,
    lidars: Sequence[str] | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
    threads: int | None = None,
) -> dict[str, Any]:
    """Write the points of a capture, in the sensor frame and in the order of arrival.

    Parameters
    ----------
    capture
        What `capture.open` returned.
    out
        File to write; its suffix says what: ``.parquet``, ``.csv``, ``.npz``, ``.las``, ``.laz``
        (extra ``points``), ``.ply``, ``.pcd``, or ``.pcap`` for the packets themselves.
    lidars
        Names of the lidars; default all.
    start_s, stop_s
        Packets before and from these times on are left out; seconds since the first accepted
        lidar packet.
    overwrite
        Replace a file of that name.
    progress
        Called with bytes of capture done and in total.
    threads
        Makes no difference: one thread decodes while another writes.

    Returns
    -------
    dict
        ``points`` written, second returns ``merged`` into the first, and ``drops``: a list of
        ``{"reason", "count"}``.

    Raises
    ------
    InvalidValueError
        If the suffix or a lidar is not known.
    CaptureError
        If no point lies in the span (``capture.no_points``).
    OutputError
        If the file exists or cannot be written; nothing is left behind.
    MissingExtraError
        If ``.las`` or ``.laz`` is asked for and the extra ``points`` is not installed.
    """
    del threads
    path = Path(out)
    if path.suffix not in (*FILES, ".pcap"):
        raise InvalidValueError(
            f"suffix: expected one of {', '.join((*FILES, '.pcap'))}, found {path.suffix!r}",
            code="output.suffix",
            hint="the suffix of the file says what is written",
        )
    numbers = capture.numbers(lidars)
    span = {"start_ns": capture.instant_ns(start_s), "stop_ns": capture.instant_ns(stop_s)}
    with whole_file(path, overwrite=overwrite) as temporary:
        if path.suffix == ".pcap":
            counts = _cut(capture, temporary, numbers, span, progress)
        else:
            counts = _points(capture, path.suffix, temporary, numbers, span, progress)
        if not counts["points"]:
            raise _no_points(capture, counts)
    return counts


def _points(
    capture: Capture,
    suffix: str,
    path: Path,
    numbers: list[int],
    span: dict[str, int | None],
    progress: Progress | None,
) -> dict[str, Any]:
    reader = _native.PointIterator(
        capture.native, lidars=numbers, block_points=BLOCK_POINTS, progress=progress, **span
    )
    names = [stream.lidar for stream in capture.streams]
    with FILES[suffix](path, names, RETURN_KINDS) as file:
        for block in reader:
            file.append(block)
    drops = dict(capture.drops)
    for reason, count in reader.drops:
        drops[reason] = drops.get(reason, 0) + count
    return _counts(file.points, reader.merged, drops)


def _cut(
    capture: Capture,
    path: Path,
    numbers: list[int],
    span: dict[str, int | None],
    progress: Progress | None,
) -> dict[str, Any]:
    _native.cut_capture(capture.native, path, lidars=numbers, progress=progress, **span)
    try:
        cut = capture.reopened(path)
        points, merged = (
            sum(getattr(s, name) for s in cut.streams) for name in ("points", "merged")
        )
    except CaptureError:
        return _counts(0, 0, dict(capture.drops))
    return _counts(points, merged, dict(cut.drops))


def _counts(points: int, merged: int, drops: dict[str, int]) -> dict[str, Any]:
    listed = [{"reason": reason, "count": count} for reason, count in sorted(drops.items())]
    return {"points": points, "merged": merged, "drops": listed}


def _no_points(capture: Capture, counts: dict[str, Any]) -> CaptureError:
    seconds = (capture.last_time_ns - capture.first_time_ns) / captures.NANOS_PER_SECOND
    drops = [(drop["reason"], str(drop["count"])) for drop in counts["drops"]]
    return CaptureError(
        "no point lies in the span that was asked for",
        code="capture.no_points",
        facts=[("capture", f"0 s to {seconds:.3f} s"), *drops],
        hint="choose other times, or leave them out",
    )


class _TableFile(PointFile):
    """What csv and parquet share: blocks as frames of the declared table."""

    def frame(self, block: Block) -> "pl.DataFrame":
        """Make the table ``decoded`` of one block."""
        import polars as pl

        from lidar_deflect import tables

        x, y, z = np.ascontiguousarray(block["xyz"].T)
        frames = pl.Series(block["frame_id"]).set(pl.Series(~block["has_frame_id"]), None)
        kinds = pl.Series(self.kinds, dtype=pl.Enum(tables.RETURN_KINDS))
        self.points += len(x)
        return tables.build(
            "decoded",
            {
                "time": block["time_ns"],
                "lidar": pl.Series(self.lidars, dtype=pl.String).gather(block["lidar"]),
                **{name: block[name] for name in PLAIN},
                "frame_id": frames,
                "x_m": x,
                "y_m": y,
                "z_m": z,
                "intensity": block["intensity"],
                "return_index": block["return_index"],
                "return_kind": kinds.gather(block["return_kind"]),
            },
        )


class CsvFile(_TableFile):
    """Text with a header; instants in ISO 8601 to the nanosecond, UTC."""

    _stream: IO[bytes] | None = None

    def append(self, block: Block) -> None:
        """Add the points of a block."""
        is_first = self._stream is None
        stream = self._stream = self._stream or self.path.open("wb")
        form = "%Y-%m-%dT%H:%M:%S%.9fZ"
        self.frame(block).write_csv(stream, include_header=is_first, datetime_format=form)

    def close(self) -> None:
        """Complete the file."""
        if self._stream is not None:
            self._stream.close()

    discard = close


class ParquetFile(_TableFile):
    """Parquet, written by a thread of its own while the next block is decoded."""

    def __init__(self, path: Path, lidars: Sequence[str], kinds: Sequence[str]) -> None:
        super().__init__(path, lidars, kinds)
        self._blocks: queue.Queue[pl.DataFrame | None] = queue.Queue(maxsize=2)
        self._is_discarded = False
        self._failure: BaseException | None = None
        keep_interrupts_from_polars()
        self._thread = threading.Thread(target=self._run, name="parquet", daemon=True)
        self._thread.start()

    def append(self, block: Block) -> None:
        """Hand the points of a block to the writer."""
        self._put(self.frame(block))

    def close(self) -> None:
        """Wait for the writer."""
        self._put(None)
        while self._thread.is_alive():
            self._thread.join(0.1)  # so that Ctrl-C comes through
        self._raise()

    def discard(self) -> None:
        """Stop the writer."""
        self._is_discarded = True
        self._thread.join()

    def _put(self, frame: "pl.DataFrame | None") -> None:
        while True:
            self._raise()
            try:
                return self._blocks.put(frame, timeout=0.1)
            except queue.Full:
                continue

    def _raise(self) -> None:
        if self._failure is not None:
            raise self._failure

    def _next(self) -> "pl.DataFrame | None":
        while not self._is_discarded:
            try:
                return self._blocks.get(timeout=0.1)
            except queue.Empty:
                continue
        raise _Discarded

    def _run(self) -> None:
        try:
            self._write()
        except _Discarded:
            pass
        except BaseException as error:
            self._failure = OSError(str(error)) if not self._is_discarded else None

    def _write(self) -> None:
        from polars.io.plugins import register_io_source

        from lidar_deflect import tables

        def frames(*_: Any) -> Iterator["pl.DataFrame"]:
            while (frame := self._next()) is not None:
                yield frame

        settings = json.dumps({"lidars": self.lidars}).encode()
        digest = f"sha256:{hashlib.sha256(settings).hexdigest()}"
        metadata = tables.own_metadata("decoded") | {tables.HASH_KEY: digest}
        schema = tables.SCHEMAS["decoded"].schema
        source = register_io_source(frames, schema=schema, is_pure=True)
        # An open file, not its name: after an interrupt polars would create it anew.
        with self.path.open("wb") as file:
            source.sink_parquet(file, metadata=metadata)


class _Discarded(Exception):  # noqa: N818 - a signal, not an error
    """The file is not wanted any more."""


FILES: dict[str, type[PointFile]] = {
    ".parquet": ParquetFile,
    ".csv": CsvFile,
    ".npz": NpzFile,
    ".las": LasFile,
    ".laz": LazFile,
    ".ply": PlyFile,
    ".pcd": PcdFile,
}
"""Kinds of files of points by their suffix."""
