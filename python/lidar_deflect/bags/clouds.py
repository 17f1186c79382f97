"""Points out of the clouds that drivers record: PointCloud2, and Livox CustomMsg.

Only clouds that say when each point was measured are of use: within one turn of a lidar the blade
moves.
"""

import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lidar_deflect.bags.messages import stamp_ns

__all__ = ["Cloud", "custom", "point_cloud"]

KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""Numbers of types in PointField."""

NANOSECOND_TIMES = ("t", "offset_time", "time_stamp", "timeOffset")
RELATIVE_TIMES = ("time", "time_offset")
ABSOLUTE_TIMES = ("timestamp",)
RINGS = ("ring", "line", "channel")
BRIGHTNESS = ("intensity", "reflectivity")

SECONDS_FROM = 1e8
"""An absolute time in seconds is larger (1973), a relative one smaller."""
NANOSECONDS_FROM = 1e16
"""An absolute time in nanoseconds is larger, one in seconds smaller."""

CUSTOM_POINT = {
    "names": ["offset_time", "x", "y", "z", "reflectivity", "tag", "line"],
    "formats": ["u4", "f4", "f4", "f4", "u1", "u1", "u1"],
    "offsets": [0, 4, 8, 12, 16, 17, 18],
}
CUSTOM_BYTES = 19
CDR_LITTLE = b"\x00\x01"


@dataclass(frozen=True)
class Cloud:
    """Points of one message in the order of their times; those without an echo left out.

    Attributes
    ----------
    time_ns
        (n,) nanoseconds since 1970 by the driver.
    xyz_m
        (n, 3) float32, sensor frame.
    ring, intensity
        (n,) uint16; zero where the driver does not tell.
    """

    time_ns: NDArray[np.int64]
    xyz_m: NDArray[np.float32]
    ring: NDArray[np.uint16]
    intensity: NDArray[np.uint16]

    @classmethod
    def of(
        cls,
        time_ns: NDArray[np.int64],
        xyz_m: NDArray[np.float32],
        ring: NDArray[Any] | None,
        intensity: NDArray[Any] | None,
    ) -> "Cloud":
        """Keep what has an echo, in order."""
        kept = np.flatnonzero(np.isfinite(xyz_m).all(axis=1) & xyz_m.any(axis=1))
        order = kept[np.argsort(time_ns[kept], kind="stable")]
        return cls(time_ns[order], xyz_m[order], _counted(ring, order), _counted(intensity, order))

    def __len__(self) -> int:
        return len(self.time_ns)


def point_cloud(message: Any) -> Cloud | None:
    """Read a PointCloud2; None where its points have no times."""
    points = _records(message)
    names = points.dtype.names or ()
    time_ns = _times_ns(points, stamp_ns(message) or 0)
    if time_ns is None or not {"x", "y", "z"} <= set(names):
        return None
    xyz_m = np.column_stack([points[axis].astype(np.float32) for axis in "xyz"])
    ring, intensity = (
        next((points[name] for name in choice if name in names), None)
        for choice in (RINGS, BRIGHTNESS)
    )
    return Cloud.of(time_ns, xyz_m, ring, intensity)


def custom(raw: bytes, *, is_ros1: bool) -> Cloud:
    """Read a Livox CustomMsg from its bytes: a message object per point would take too long.

    Raises
    ------
    ValueError
        If the bytes are no such message.
    """
    try:
        return _custom(raw, is_ros1)
    except struct.error as error:
        raise ValueError(str(error)) from error


def _custom(raw: bytes, is_ros1: bool) -> Cloud:
    if not is_ros1 and raw[:2] != CDR_LITTLE:
        raise ValueError(f"expected little endian CDR, found {raw[:2].hex()}")
    body = raw if is_ros1 else raw[4:]
    align = 1 if is_ros1 else 4
    place = 12 if is_ros1 else 8  # sequence number and stamp, or stamp alone
    (length,) = struct.unpack_from("<I", body, place)
    place = _aligned(place + 4 + length, 1 if is_ros1 else 8)
    (timebase_ns,) = struct.unpack_from("<Q", body, place)
    place = _aligned(place + 16, align)  # time base, number of points, identifier, reserved
    (count,) = struct.unpack_from("<I", body, place)
    place += 4
    step = _aligned(CUSTOM_BYTES, align)
    needed = place + max(count - 1, 0) * step + CUSTOM_BYTES * (count > 0)
    if len(body) < needed:
        raise ValueError(f"expected {needed} bytes for {count} points, found {len(body)}")
    dtype = np.dtype({**CUSTOM_POINT, "itemsize": step})  # type: ignore[call-overload]
    padded = body[place : place + count * step].ljust(count * step, b"\0")
    points = np.frombuffer(padded, dtype, count)
    time_ns = points["offset_time"].astype(np.int64) + timebase_ns
    xyz_m = np.column_stack([points[axis] for axis in "xyz"])
    return Cloud.of(time_ns, xyz_m, points["line"], points["reflectivity"])


def _aligned(place: int, to: int) -> int:
    return -(-place // to) * to


def _records(message: Any) -> NDArray[Any]:
    """Points of a PointCloud2 as records; rows may be padded."""
    order = ">" if message.is_bigendian else "<"
    width, height = int(message.width), int(message.height)
    point_bytes, row_bytes = int(message.point_step), int(message.row_step)
    fields = [field for field in message.fields if field.datatype in KINDS and field.count == 1]
    layout: dict[str, Any] = {
        "names": [field.name for field in fields],
        "formats": [order + KINDS[field.datatype] for field in fields],
        "offsets": [int(field.offset) for field in fields],
        "itemsize": point_bytes,
    }
    data = np.asarray(message.data, np.uint8)
    if height > 1 and row_bytes != width * point_bytes:
        data = data[: height * row_bytes].reshape(height, row_bytes)[:, : width * point_bytes]
    whole = np.ascontiguousarray(data).tobytes()
    return np.frombuffer(whole, np.dtype(layout), width * height)  # type: ignore[call-overload]


def _times_ns(points: NDArray[Any], header_ns: int) -> NDArray[np.int64] | None:
    names = points.dtype.names or ()
    for name in (*NANOSECOND_TIMES, *RELATIVE_TIMES, *ABSOLUTE_TIMES):
        if name in names:
            return _as_ns(points[name], header_ns)
    return None


def _as_ns(values: NDArray[Any], header_ns: int) -> NDArray[np.int64] | None:
    """Bring times to nanoseconds: whole numbers are such, others seconds or large."""
    if values.dtype.kind in "iu":
        whole = values.astype(np.int64)
        is_absolute = len(whole) > 0 and int(np.median(whole)) > NANOSECONDS_FROM
        return whole if is_absolute else header_ns + whole
    wide = np.where(np.isfinite(values), values, 0.0).astype(np.float64)
    if not wide.any():
        return None  # a field that the driver left empty
    middle = float(np.median(wide[wide != 0]))
    if middle > NANOSECONDS_FROM:
        return wide.astype(np.int64)
    seconds = np.floor(wide)
    nanos = seconds.astype(np.int64) * 1_000_000_000 + np.rint((wide - seconds) * 1e9).astype(
        np.int64
    )
    return nanos if middle > SECONDS_FROM else header_ns + nanos


def _counted(values: NDArray[Any] | None, order: NDArray[np.intp]) -> NDArray[np.uint16]:
    if values is None:
        return np.zeros(len(order), np.uint16)
    finite = np.nan_to_num(values[order].astype(np.float64))
    return np.clip(np.rint(finite), 0, 65_535).astype(np.uint16)
