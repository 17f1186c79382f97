"""The streams of a capture: what a scan found, and what to say when it found no lidar."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from lidar_deflect.errors import CaptureError


@dataclass(frozen=True, slots=True)
class StreamInfo:
    """One lidar of a capture.

    Attributes
    ----------
    lidar
        Its name: the id of the configuration, else ``address:port``.
    source, port, source_port
        Address of the sensor, port at the receiver; source port only where the content needs it.
        Of a bag the topic, without ports.
    model, title, candidates
        Id and name of the model, and ids that the content cannot tell from it.
    beams
        Where the angles of the unit come from; begins with ``missing`` where there are none.
    return_mode
        ``strongest``, ``last``, ``first``, ``second``, ``dual``, ``triple``, or a dual mode with
        its two returns in parentheses; ``single`` where packets do not tell which it is.
    rpm
        Turns a minute in the mean; None for sensors without a rotor, and where packets tell none.
    packets, lost, duplicated, late, too_late, foreign
        Data packets that were taken, that never came, came twice, came out of order, came too
        late to be put back; datagrams of the stream that are not the lidar's.
    points, merged
        Points, and second returns that repeat the first and were merged into it.
    first_ns, last_ns
        UTC of the first shot and of the end of the last packet, nanoseconds.
    field_of_view_deg
        Part of the turn that the sensor sends.
    clock
        ``kind`` (``locked``, ``utc`` or ``free_running``), ``offset_s`` of the host from the
        device, ``drift_ppm``, ``jumps``.
    position
        What position packets of the same address say, if there are any.
    conflict
        Set where two sensors share the name, so that sweeps would mix them.
    notes
        What else one should know.
    key
        Its name within the compiled core.
    """

    lidar: str
    source: str
    port: int | None
    source_port: int | None
    model: str
    title: str
    candidates: tuple[str, ...]
    named: bool
    beams: str
    return_mode: str
    rpm: float | None
    packets: int
    lost: int
    duplicated: int
    late: int
    too_late: int
    foreign: int
    points: int
    merged: int
    first_ns: int
    last_ns: int
    field_of_view_deg: float
    clock: Mapping[str, Any]
    position: Mapping[str, Any] | None
    conflict: str | None
    notes: tuple[str, ...]
    key: str

    @property
    def address(self) -> str:
        """``address:port``, with the source port where the content needs it; of a bag the topic."""
        if self.port is None:
            return self.source
        host = f"[{self.source}]" if ":" in self.source else self.source
        tail = "" if self.source_port is None else f"@{self.source_port}"
        return f"{host}:{self.port}{tail}"

    @property
    def clock_kind(self) -> str:
        """``locked``, ``utc`` or ``free_running``."""
        return str(self.clock["kind"])

    def matches(self, source: str) -> bool:
        """Whether `source` (an address, or an address with a port) names this stream."""
        return source in (self.lidar, self.address, self.address.split("@")[0], self.source)

    def document(self) -> dict[str, Any]:
        """Entry of ``streams`` in the document of ``info --json``."""
        shown = (
            *("lidar", "source", "port", "source_port", "model", "title", "candidates"),
            *("beams", "return_mode", "rpm", "packets", "lost", "duplicated", "late", "too_late"),
            *("foreign", "points", "merged", "field_of_view_deg", "clock", "position", "notes"),
        )
        entry = {name: getattr(self, name) for name in shown}
        return entry | {
            "candidates": list(self.candidates),
            "clock": dict(self.clock),
            "notes": list(self.notes),
            "first_utc": utc(self.first_ns),
            "last_utc": utc(self.last_ns),
        }


def utc(time_ns: int) -> str:
    """ISO 8601 text of an instant, to the nanosecond."""
    return f"{np.datetime64(time_ns, 'ns')}Z"


def stream(entry: dict[str, Any]) -> StreamInfo:
    """Make a `StreamInfo` of what the compiled core describes."""
    lists = {name: tuple(entry[name]) for name in ("candidates", "notes")}
    clock = MappingProxyType(entry["clock"])
    return StreamInfo(**(entry | lists | {"clock": clock}))


def no_lidar(
    paths: Sequence[Path],
    described: Mapping[str, Any],
    models: Sequence[tuple[str, str]],
) -> CaptureError:
    """Tell that a capture holds no known lidar, and which stream comes closest to one."""
    others = described["other_streams"]
    facts = [("read", f"{_grouped(described['datagrams'])} packets in {len(others)} UDP streams")]
    hint = "check that the sensor sends to this computer while you record"
    near = [stream for stream in others if stream["why_not"]] or others
    if near:
        facts.append(("closest", _closest(near[0])))
        hint = f"sensors that are known: {', '.join(model for model, _ in models)}"
    if near and near[0]["positions"] + near[0]["companions"]:
        hint = "record the sensor's data packets as well: they go to another port"
    if near and near[0]["closest_model"]:
        source, model = near[0]["source"], near[0]["closest_model"]
        hint = f"name the model: --sensor {source}={model}"
    names = ", ".join(path.name for path in paths)
    return CaptureError(
        f"no lidar packets in {names}", code="capture.no_lidar", facts=facts, hint=hint
    )


def _closest(stream: Mapping[str, Any]) -> str:
    is_topic = stream["source"].startswith("/")
    place = "" if is_topic else f" -> port {stream['port']}"
    text = f"{stream['source']}{place}, {stream['payload_bytes']} bytes"
    if stream["rate_hz"]:
        text += f", {stream['rate_hz']:.0f}/s"
    return f"{text}: {stream['why_not'] or 'no known sensor sends packets of this size'}"


def same_address(conflict: str) -> CaptureError:
    """Tell that two sensors send under one name."""
    return CaptureError(
        conflict,
        code="capture.same_address",
        hint="give each sensor its own address or port, or record them into files of their own",
    )


def _grouped(count: int) -> str:
    return f"{count:,}".replace(",", " ")
