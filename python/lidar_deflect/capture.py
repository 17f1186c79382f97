"""Captures: open them, tell what they hold, iterate over the sweeps of their lidars."""

import math
import shutil
import tempfile
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lidar_deflect import _native, bags, units
from lidar_deflect._native import Sweep, SweepIterator
from lidar_deflect.errors import CaptureError, InvalidValueError
from lidar_deflect.notebook import card
from lidar_deflect.streams import StreamInfo, no_lidar, same_address, stream, utc

__all__ = ["RETURN_KINDS", "Capture", "StreamInfo", "Sweep", "Sweeps", "open", "sensor_models"]

Progress = Callable[[int, int], None]
"""Called with bytes of capture done and in total."""

INFO_SCHEMA = "lidar-deflect.info/1"

QUICK_HEAD_S = 2.0
"""What of the start of a capture `Capture.info` reads when it is told to be quick."""

RETURN_KINDS = ("strongest", "last", "first", "second", "merged")
"""Names of the numbers in `Sweep.return_kind`."""

NANOS_PER_SECOND = 1_000_000_000


@dataclass(frozen=True, slots=True)
class _Found:
    """What a scan found."""

    scan: _native.CaptureScan
    streams: tuple[StreamInfo, ...]
    described: Mapping[str, Any]


class Sweeps(Iterator[Sweep]):
    """Sweeps as they complete; what `Capture.sweeps` returns."""

    def __init__(self, native: SweepIterator, capture: "Capture") -> None:
        self._native = native
        self._capture = capture  # its temporary files stay as long as they are read

    def __next__(self) -> Sweep:
        return next(self._native)

    @property
    def merged(self) -> int:
        """Second returns so far that repeat the first and were merged into it."""
        return self._native.merged


class Capture:
    """The captures of one recording, read when something is asked for.

    Made by `open`. The files are scanned once, on the first question, and the findings kept.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        sensors: Mapping[str, str],
        ids: Mapping[str, str | None],
        files: Sequence[units.UnitFile] = (),
    ) -> None:
        self.paths = tuple(paths)
        self._units = tuple(files)
        self._sensors = dict(sensors)
        self._ids = dict(ids)
        self._found: _Found | None = None
        self._bags = tuple(path for path in self.paths if bags.kind_of(path))
        self._unpacked: bags.Unpacked | None = None

    def scan(self, progress: Progress | None = None) -> None:
        """Read the files once, if that was not done yet; everything else does so by itself.

        Raises
        ------
        CaptureError
            If there is no lidar in them (``capture.no_lidar``), or a file is no capture.
        """
        if self._found is None:
            self._unpack(progress)
            scan = _native.scan_capture(self._files(), **self._known(), progress=progress)
            self._found = self._judge(scan)

    def _unpack(self, progress: Progress | None, head_s: float | None = None) -> None:
        """Write what bags hold as captures, which go with this object."""
        if not self._bags:
            return
        folder = Path(tempfile.mkdtemp(prefix="lidar-deflect-", dir=units.scratch()))
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self._unpacked = bags.unpack(self._bags, folder, head_s=head_s, progress=progress)

    def _files(self) -> list[Path]:
        """Files that the compiled core reads."""
        plain = [path for path in self.paths if path not in self._bags]
        return plain + list(self._unpacked.paths if self._unpacked else ())

    def _known(self) -> dict[str, Any]:
        """Models and files of units, with topics as the addresses that stand for them."""
        topics = self._unpacked.topics if self._unpacked else bags.Topics()
        sensors = [(topics.source(source), model) for source, model in self._sensors.items()]
        files = [
            (source and topics.source(source), *rest)
            for source, *rest in self._units
            if not source or topics.source(source)
        ]
        recorded = self._unpacked.units if self._unpacked else ()
        return {
            "sensors": [(source, model) for source, model in sensors if source],
            "units": [*files, *recorded],
        }

    def reopened(self, path: Path) -> "Capture":
        """Open a piece of this capture with what is known of its units."""
        known = self._known()
        return Capture([path], dict(known["sensors"]), {}, known["units"])

    def _judge(self, scan: _native.CaptureScan) -> "_Found":
        described = scan.describe()
        keys = [entry["lidar"] for entry in described["streams"]]
        if self._unpacked is not None:
            described = self._in_topics(described)
        if not described["streams"]:
            raise no_lidar(self.paths, described, sensor_models())
        pairs = zip(keys, described["streams"], strict=True)
        found = tuple(stream(entry | {"key": key}) for key, entry in pairs)
        return _Found(scan, _named(found, self._ids), described)

    def _in_topics(self, described: dict[str, Any]) -> dict[str, Any]:
        """Tell of bags and topics instead of the captures that were made of them."""
        assert self._unpacked is not None
        told: dict[str, Any] = self._unpacked.topics.told(described)
        for entry in told["streams"]:
            if entry["source"].startswith("/"):
                notes = self._unpacked.notes.get(entry["source"], ())
                entry |= {"port": None, "notes": [*entry["notes"], *notes]}
        plain = [entry for entry in told["captures"] if Path(entry["path"]) in self.paths]
        drops = {pair["reason"]: pair["count"] for pair in told["drops"]}
        for reason, count in self._unpacked.drops.items():
            drops[reason] = drops.get(reason, 0) + count
        listed = [{"reason": reason, "count": count} for reason, count in sorted(drops.items())]
        return told | {"captures": [*plain, *self._unpacked.captures], "drops": listed}

    @property
    def _findings(self) -> "_Found":
        self.scan()
        assert self._found is not None
        return self._found

    @property
    def sensors(self) -> Mapping[str, str]:
        """Models that were named, by source."""
        return MappingProxyType(self._sensors)

    @property
    def native(self) -> _native.CaptureScan:
        """The scan of the compiled core, for functions that read the capture there."""
        return self._findings.scan

    @property
    def streams(self) -> tuple[StreamInfo, ...]:
        """All lidars that were found, ordered by address and port."""
        return self._findings.streams

    @property
    def lidars(self) -> tuple[str, ...]:
        """Names of the lidars: ids of the configuration in its order, else ``address:port``."""
        names = [stream.lidar for stream in self.streams]
        return tuple(name for name in self._ids if name in names) if self._ids else tuple(names)

    @property
    def missing(self) -> tuple[str, ...]:
        """Ids of the configuration that never send in this capture."""
        return tuple(name for name in self._ids if name not in self.lidars)

    @property
    def first_time_ns(self) -> int:
        """UTC of the first accepted lidar packet, nanoseconds: ``t_s`` 0."""
        return int(self.native.first_time_ns or 0)

    @property
    def last_time_ns(self) -> int:
        """UTC of the end of the last lidar packet, nanoseconds."""
        return int(self.native.last_time_ns or 0)

    @property
    def drops(self) -> Mapping[str, int]:
        """Records, datagrams and packets that gave no points, by reason."""
        pairs = self._findings.described["drops"]
        return MappingProxyType({pair["reason"]: pair["count"] for pair in pairs})

    def info(self, quick: bool = False, *, progress: Progress | None = None) -> dict[str, Any]:
        """Tell what the capture holds, as the document of ``info --json``.

        Parameters
        ----------
        quick
            Read only the first two seconds and, where the files are not compressed, their ends;
            unless the capture was read already. Counts are then those of the two seconds, and
            ``last_utc`` is None where the end could not be told.
        progress
            Called with bytes done and in total.
        """
        if quick and self._found is None:
            return self._quick_info()
        self.scan(progress)
        return _document(self._findings, {s.key: s.last_ns for s in self.streams}, quick=False)

    def _quick_info(self) -> dict[str, Any]:
        self._unpack(None, QUICK_HEAD_S)
        scan, ends = _native.scan_quickly(self._files(), **self._known(), head_s=QUICK_HEAD_S)
        last_ns: dict[str, int] = {}
        for key, end_ns in ends if not self._bags else ():  # of bags only the head was unpacked
            last_ns[key] = max(end_ns, last_ns.get(key, end_ns))
        document = _document(self._judge(scan), last_ns, quick=True)
        self._unpacked = None
        return document

    def health(self) -> dict[str, NDArray[Any]]:
        """Count what arrived per second and lidar.

        Returns
        -------
        dict
            Columns of equal length, ordered by second, then lidar: ``time_ns`` (start of the
            second), ``lidar``, ``packets``, ``lost``, ``duplicated``, ``late``, ``foreign``,
            ``points``, ``rpm`` and ``clock_offset_s`` (NaN where nothing arrived), ``coverage``.
        """
        columns = self.native.health()
        names = {stream.key: stream.lidar for stream in self.streams}
        columns["lidar"] = np.array([names[key] for key in columns["lidar"]], dtype=str)
        kept = np.isin(columns["lidar"], self.lidars)
        return {name: np.asarray(column)[kept] for name, column in columns.items()}

    def sweeps(
        self,
        lidar: str | Sequence[str] | None = None,
        *,
        start_s: float | None = None,
        stop_s: float | None = None,
        cut_azimuth_deg: float = 0.0,
        every: int | Mapping[str, int] = 1,
        progress: Progress | None = None,
    ) -> Sweeps:
        """Iterate over the turns of one lidar or several, in the order in which they complete.

        Parameters
        ----------
        lidar
            Name of a lidar, several names, or None for all.
        start_s, stop_s
            Packets before and from these times on are left out; seconds since the first accepted
            lidar packet.
        cut_azimuth_deg
            Where one sweep ends and the next begins, in the sensor's own sense of rotation.
        every
            One turn in so many, those whose `index` is a multiple of it, for all lidars or by name:
            the others are followed and not decoded.
        progress
            Called with bytes done and in total.

        Returns
        -------
        Sweeps
            Iterator over `Sweep`: ``xyz`` of shape (n, 3), metres in the sensor frame, and the
            columns ``time_ns ring range_m azimuth_deg intensity return_index return_kind packet
            block`` of length n, with ``lidar index start_ns end_ns coverage packets lost``.

        Raises
        ------
        InvalidValueError
            If there is no such lidar.
        CaptureError
            If two sensors send under the lidar's name (``capture.same_address``).
        """
        numbers = self.numbers(lidar)
        turns = [every if isinstance(every, int) else 1] * len(self.streams)
        if not isinstance(every, int):
            for name, one_in in every.items():
                turns[self._number(name)] = one_in
        if min(turns, default=1) < 1:
            raise InvalidValueError(
                f"every: expected at least 1, found {min(turns)}",
                code="capture.every",
                hint="1 gives every turn",
            )
        native = SweepIterator(
            self.native,
            lidars=numbers,
            names=[stream.lidar for stream in self.streams],
            cut_rad=[math.radians(cut_azimuth_deg)] * len(self.streams),
            every=turns,
            start_ns=self.instant_ns(start_s),
            stop_ns=self.instant_ns(stop_s),
            progress=progress,
        )
        return Sweeps(native, self)

    def numbers(self, lidar: str | Sequence[str] | None = None) -> list[int]:
        """Numbers in `streams` of lidars by name; all those of `lidars` for None.

        Raises
        ------
        InvalidValueError
            If there is no such lidar.
        CaptureError
            If two sensors send under a lidar's name.
        """
        names = self.lidars if lidar is None else [lidar] if isinstance(lidar, str) else lidar
        numbers = [self._number(name) for name in names]
        for number in numbers:
            conflict = self.streams[number].conflict
            if conflict is not None:
                raise same_address(conflict)
        return numbers

    def _number(self, name: str) -> int:
        places = [place for place, stream in enumerate(self.streams) if stream.matches(name)]
        if len(places) != 1:
            raise InvalidValueError(
                f"lidar: expected one of {', '.join(self.lidars)}, found {name!r}",
                code="capture.unknown_lidar",
                hint="name a lidar as `info` lists it",
            )
        return places[0]

    def instant_ns(self, time_s: float | None) -> int | None:
        """UTC nanoseconds of a time in seconds since the first accepted lidar packet."""
        if time_s is None:
            return None
        if not math.isfinite(time_s):
            raise InvalidValueError(f"time: expected seconds, found {time_s}")
        return self.first_time_ns + round(time_s * NANOS_PER_SECOND)

    def __repr__(self) -> str:
        names = ", ".join(path.name for path in self.paths)
        if self._found is None:
            return f"<Capture {names}: not read yet>"
        seconds = (self.last_time_ns - self.first_time_ns) / NANOS_PER_SECOND
        return f"<Capture {names}: {len(self.streams)} lidars, {seconds:.1f} s>"

    def _repr_html_(self) -> str:
        header = ("lidar", "model", "return", "rpm", "packets", "lost", "late", "clock")
        rows = [
            (
                s.lidar,
                s.title,
                s.return_mode,
                "-" if s.rpm is None else f"{s.rpm:.0f}",
                s.packets,
                s.lost,
                s.late,
                s.clock_kind,
            )
            for s in self.streams
        ]
        return card(repr(self), header, rows)


def open(  # noqa: A001 - `lidar_deflect.open` is the name that users know
    path: str | Path | Sequence[str | Path],
    *,
    config: Any = None,
    sensors: Mapping[str, str] | None = None,
    beams: Mapping[str, Any] | None = None,
) -> Capture:
    """Open the captures of one recording; they are read when something is asked for.

    Parameters
    ----------
    path
        pcap or pcapng, plain, gzip or zstd, or ROS bags (``.bag``, ``.db3``, ``.mcap``, the folder
        of a ROS 2 bag; extra ``ros``), whose lidars are named by their topics; one file, or many:
        rotated, or one per lidar.
    config
        A `Test` or `Config`, whose lidars then give names and models.
    sensors
        Models by source, for sensors that the content does not tell: ``{"10.0.0.5": "vlp16"}``.
    beams
        Files of single units, a path or several by source, ``""`` for any lidar:
        ``{"10.0.0.5": ["angle.csv", "firetime.csv"]}``. What they are, their content tells. Files
        beside a capture that have its name (``tower.pcap``, ``tower.angle.csv``) need not be given.

    Returns
    -------
    Capture

    Raises
    ------
    CaptureNotFoundError
        If a file is not there.
    CaptureError
        If a file is no capture.
    MissingExtraError
        If a bag is given and the extra ``ros`` is not installed.
    InvalidValueError
        If a model is not known, or a file of a unit cannot be read (``beams.unreadable``).
        Later, when the capture is read: if a file is of no lidar of the capture
        (``beams.not_taken``), is broken (``beams.malformed``), or a model gives no points without
        one (``beams.missing``).
    """
    given = [Path(path)] if isinstance(path, str | Path) else [Path(one) for one in path]
    paths = [file for one in given for file in bags.located(one)]
    _check(paths)
    lidars = _lidars_of(config)
    own = {lidar.source or "": files for lidar in lidars if (files := getattr(lidar, "beams", ()))}
    files = units.named(own | dict(beams or {})) + units.beside(paths)
    ids = {lidar.id: lidar.source for lidar in lidars}
    named = {lidar.source: lidar.model for lidar in lidars if lidar.source}
    named = {source: model for source, model in named.items() if model != "auto"}
    known = dict(sensor_models())
    for model in (named | dict(sensors or {})).values():
        if _native.sensor_id(model) is None:
            raise InvalidValueError(
                f"sensor model: expected one of {', '.join(known)}, found {model!r}",
                code="sensor.unknown",
            )
    return Capture(paths, named | dict(sensors or {}), ids, files)


def _check(paths: Sequence[Path]) -> None:
    """Look at the heads of all files, so that what is no capture is told at once."""
    bagged = [path for path in paths if bags.kind_of(path)]
    if len(set(bagged)) < len(bagged):
        raise CaptureError(
            "a bag was given twice",
            code="capture.given_twice",
            hint="name every file once, or its packets would count twice",
        )
    plain = [path for path in paths if path not in bagged]
    if bagged:
        bags.require(bagged)
        with tempfile.TemporaryDirectory() as folder:
            bags.looks(bagged, Path(folder))
    if plain or not bagged:
        _native.check_captures(plain)


def sensor_models() -> tuple[tuple[str, str], ...]:
    """Ids of the known sensor models, each with its name."""
    return tuple(_native.sensor_models())


def _lidars_of(config: Any) -> Sequence[Any]:
    """Lidars of a `Config`, or of a `Test` that holds one."""
    holder = getattr(config, "config", config)
    return tuple(getattr(holder, "lidars", ()))


def _document(found: _Found, last_ns: Mapping[str, int], *, quick: bool) -> dict[str, Any]:
    """Make the document of ``info --json``; `last_ns` goes by key."""
    described = found.described
    ends = [last_ns.get(stream.key) for stream in found.streams]
    known = [end for end in ends if end is not None]
    return {
        "schema": INFO_SCHEMA,
        "quick": quick,
        "captures": [_file(entry) for entry in described["captures"]],
        "streams": [
            stream.document() | {"last_utc": None if end is None else utc(end)}
            for stream, end in zip(found.streams, ends, strict=True)
        ],
        "other_streams": described["other_streams"],
        "unused_files": [
            {"file": name, "content": content} for name, content in described["unused_files"]
        ],
        "drops": described["drops"],
        "fragments": described["fragments"],
        "datagrams": described["datagrams"],
        "pauses": [[utc(start), utc(stop)] for start, stop in described["pauses_ns"]],
        "first_utc": utc(int(found.scan.first_time_ns or 0)),
        "last_utc": utc(max(known)) if known else None,
    }


def _named(
    streams: tuple[StreamInfo, ...], ids: Mapping[str, str | None]
) -> tuple[StreamInfo, ...]:
    """Give the streams the ids of the configuration."""

    def name(stream: StreamInfo) -> str:
        for lidar, source in ids.items():
            if source is not None and stream.matches(source):
                return lidar
        if len(ids) == len(streams) == 1 and None in ids.values():
            return next(iter(ids))
        return stream.lidar

    return tuple(replace(stream, lidar=name(stream)) for stream in streams)


def _file(entry: Mapping[str, Any]) -> dict[str, Any]:
    times = {"first_host_ns": "first_host_utc", "last_host_ns": "last_host_utc"}
    shown = {name: value for name, value in entry.items() if name not in times}
    shown["path"] = str(entry["path"])
    for name, title in times.items():
        shown[title] = None if entry[name] is None else utc(entry[name])
    return shown
