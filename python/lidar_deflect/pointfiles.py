"""Files of points that grow block by block: npz, ply and pcd.

A block is a dictionary of columns as the compiled core gives it: ``time_ns``, ``xyz`` of shape
(n, 3), and the others of length n, with ``lidar`` and ``return_kind`` as numbers of names.
"""

import shutil
import tempfile
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any, ClassVar, Self

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

Block = Mapping[str, NDArray[Any]]

PLAIN = ("sweep", "packet", "block", "ring", "azimuth_deg", "range_m")
TAIL = ("intensity", "return_index")

PIECE_BYTES = 1 << 18
"""A column is packed in pieces of so many bytes; whole values of every type."""


def frame_ids(block: Block) -> NDArray[np.float64]:
    """Frame counts of the sensors; NaN where there are none, which no integer could say."""
    return np.where(block["has_frame_id"], block["frame_id"].astype(np.float64), np.nan)


class PointFile(ABC):
    """A file of points that is being written.

    Parameters
    ----------
    path
        File to write.
    lidars, kinds
        Names that the numbers in ``lidar`` and ``return_kind`` stand for.
    """

    def __init__(self, path: Path, lidars: Sequence[str], kinds: Sequence[str]) -> None:
        self.path = path
        self.lidars = tuple(lidars)
        self.kinds = tuple(kinds)
        self.points = 0

    @abstractmethod
    def append(self, block: Block) -> None:
        """Add the points of a block."""

    @abstractmethod
    def close(self) -> None:
        """Complete the file."""

    @abstractmethod
    def discard(self) -> None:
        """Let go of what is open; the file is not wanted."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.discard()


class NpzFile(PointFile):
    """One array per column; columns grow in files of their own and are packed in the end.

    Names are put for their numbers when they are packed: as text they are the widest columns.
    """

    def __init__(self, path: Path, lidars: Sequence[str], kinds: Sequence[str]) -> None:
        super().__init__(path, lidars, kinds)
        self._folder = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
        self._columns: dict[str, tuple[IO[bytes], np.dtype[Any]]] = {}

    def append(self, block: Block) -> None:
        """Add the points of a block."""
        x, y, z = block["xyz"].T
        columns = {
            "time": block["time_ns"].astype("datetime64[ns]"),
            "lidar": block["lidar"],
            **{name: block[name] for name in PLAIN},
            "frame_id": frame_ids(block),
            "x_m": x,
            "y_m": y,
            "z_m": z,
            **{name: block[name] for name in TAIL},
            "return_kind": block["return_kind"],
        }
        for name, values in columns.items():
            self._stream(name, values.dtype).write(np.ascontiguousarray(values).tobytes())
        self.points += len(x)

    def _stream(self, name: str, dtype: np.dtype[Any]) -> IO[bytes]:
        if name not in self._columns:
            self._columns[name] = ((self._folder / name).open("wb"), dtype)
        return self._columns[name][0]

    def close(self) -> None:
        """Pack the columns."""
        try:
            with zipfile.ZipFile(self.path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as pack:
                for name, (stream, dtype) in self._columns.items():
                    stream.close()
                    self._pack(pack, name, dtype)
        finally:
            self.discard()

    def _pack(self, pack: zipfile.ZipFile, name: str, dtype: np.dtype[Any]) -> None:
        names = {"lidar": self.lidars, "return_kind": self.kinds}.get(name)
        texts = None if names is None else np.array(names)
        shown = dtype if texts is None else texts.dtype
        header = {"descr": npy.dtype_to_descr(shown), "fortran_order": False}
        member = pack.open(f"{name}.npy", "w", force_zip64=True)
        with member, (self._folder / name).open("rb") as values:
            npy.write_array_header_2_0(member, header | {"shape": (self.points,)})
            while piece := values.read(PIECE_BYTES):
                numbers = np.frombuffer(piece, dtype)
                member.write(piece if texts is None else texts[numbers].tobytes())
        (self._folder / name).unlink()

    def discard(self) -> None:
        """Remove the files of the columns."""
        for stream, _ in self._columns.values():
            stream.close()
        shutil.rmtree(self._folder, ignore_errors=True)


class _Records(PointFile):
    """A text header of fixed length with the number of points, then packed records."""

    time_type = "<i8"

    def __init__(self, path: Path, lidars: Sequence[str], kinds: Sequence[str]) -> None:
        super().__init__(path, lidars, kinds)
        self.fields = np.dtype(
            [
                *((axis, "<f4") for axis in "xyz"),
                ("time", self.time_type),
                ("lidar", "<u2"),
                ("sweep", "<u4"),
                ("packet", "<u4"),
                ("block", "<u2"),
                ("frame_id", "<f8"),
                ("ring", "<u2"),
                ("azimuth_deg", "<f4"),
                ("range_m", "<f4"),
                *((f"{axis}_m", "<f4") for axis in "xyz"),
                ("intensity", "<u2"),
                ("return_index", "u1"),
                ("return_kind", "u1"),
            ]
        )
        self._room = len(self.header(10**18, ""))
        self._stream = path.open("wb")
        self._stream.write(self._padded())

    @abstractmethod
    def header(self, points: int, padding: str) -> bytes:
        """Text of the header; `padding` goes into a comment."""

    @abstractmethod
    def time(self, time_ns: NDArray[np.int64]) -> NDArray[Any]:
        """Instants in the way of the format."""

    def _padded(self) -> bytes:
        return self.header(self.points, " " * (self._room - len(self.header(self.points, ""))))

    def legend(self) -> list[str]:
        """Lines that tell what the numbers stand for."""
        lidars = (f"lidar {number} = {name}" for number, name in enumerate(self.lidars))
        kinds = (f"return_kind {number} = {name}" for number, name in enumerate(self.kinds))
        return [*lidars, *kinds]

    def append(self, block: Block) -> None:
        """Add the points of a block."""
        records = np.empty(len(block["xyz"]), self.fields)
        for place, axis in enumerate("xyz"):
            records[axis] = records[f"{axis}_m"] = block["xyz"][:, place]
        records["time"] = self.time(block["time_ns"])
        for name in ("lidar", *PLAIN, *TAIL, "return_kind"):
            records[name] = block[name]
        records["frame_id"] = frame_ids(block)
        self._stream.write(records.tobytes())
        self.points += len(records)

    def close(self) -> None:
        """Write the number of points into the header."""
        with self._stream:
            self._stream.seek(0)
            self._stream.write(self._padded())

    def discard(self) -> None:
        """Let go of the file."""
        self._stream.close()


class PlyFile(_Records):
    """Binary PLY; it has no integers of 64 bits, so ``time`` is seconds since 1970 UTC (240 ns)."""

    time_type = "<f8"
    names: ClassVar = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "u4": "uint"}

    def header(self, points: int, padding: str) -> bytes:
        """Text of the header."""
        properties = (
            f"property {self.names[dtype.str[1:]]} {name}"
            for name, (dtype, *_) in (self.fields.fields or {}).items()
        )
        lines = [
            "ply",
            "format binary_little_endian 1.0",
            "comment sensor frame, metres; time in seconds since 1970-01-01 UTC",
            *(f"comment {line}" for line in self.legend()),
            f"comment{padding}",
            f"element vertex {points}",
            *properties,
            "end_header",
        ]
        return ("\n".join(lines) + "\n").encode()

    def time(self, time_ns: NDArray[np.int64]) -> NDArray[Any]:
        """Seconds since 1970 UTC."""
        return time_ns / 1e9


class PcdFile(_Records):
    """Binary PCD 0.7; ``time`` is nanoseconds since 1970 UTC."""

    def header(self, points: int, padding: str) -> bytes:
        """Text of the header."""
        types = [dtype for dtype, *_ in (self.fields.fields or {}).values()]
        lines = [
            "# .PCD v0.7 - sensor frame, metres; time in nanoseconds since 1970-01-01 UTC",
            *(f"# {line}" for line in self.legend()),
            f"#{padding}",
            "VERSION 0.7",
            f"FIELDS {' '.join(self.fields.names or ())}",
            f"SIZE {' '.join(str(dtype.itemsize) for dtype in types)}",
            f"TYPE {' '.join(dtype.kind.upper() for dtype in types)}",
            f"COUNT {' '.join('1' for _ in types)}",
            f"WIDTH {points}",
            "HEIGHT 1",
            "VIEWPOINT 0 0 0 1 0 0 0",
            f"POINTS {points}",
            "DATA binary",
        ]
        return ("\n".join(lines) + "\n").encode()

    def time(self, time_ns: NDArray[np.int64]) -> NDArray[Any]:
        """Nanoseconds since 1970 UTC."""
        return time_ns
