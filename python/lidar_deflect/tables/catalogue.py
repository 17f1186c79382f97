"""Every table that lidar-deflect writes; docs/tables.md is made from here."""

from collections.abc import Mapping
from types import MappingProxyType

import polars as pl

from lidar_deflect.tables.schema import UTC_NS, Column, Table

SCHEMA_VERSION = 1
"""Raised whenever a column changes its name, type, unit or meaning."""

STATUSES = ("ok", "degraded", "interpolated", "extrapolated", "missing")
"""Values of ``status``, from best to worst."""

RETURN_KINDS = ("first", "last", "strongest", "second", "merged")
"""Values of ``return_kind``."""

F64 = pl.Float64()
F32 = pl.Float32()
STR = pl.String()
U32 = pl.UInt32()
STATUS = pl.Enum(STATUSES)


def _metres(name: str, meaning: str, *, nullable: bool = True) -> Column:
    return Column(name, F64, "m", meaning, nullable)


def _xyz(pattern: str, meaning: str, *, nullable: bool = True) -> tuple[Column, ...]:
    """Three columns of one vector, one per world axis."""
    return tuple(
        _metres(pattern.format(axis), f"{meaning}, {axis}", nullable=nullable) for axis in "xyz"
    )


TIME = (
    Column("time", UTC_NS, "UTC", "instant that the row stands for"),
    Column("t_s", F64, "s", "seconds since the first accepted lidar packet"),
)
LIDAR = Column("lidar", STR, "name", "lidar as the configuration names it, else its source")
SECTION = (
    Column("section", STR, "name", "section as the configuration names it"),
    Column("s_m", F64, "m", "arc length from the root along the neutral axis"),
)
STEP = Column(
    "step", STR, "name", "load step: `0 %`, `40 %`, a second time `100 % (2)`; null between", True
)
STATUS_COLUMN = Column(
    "status",
    STATUS,
    "name",
    "`ok`; `degraded`: fewer lidars or points than in the reference; `interpolated`: between "
    "states in time; `extrapolated`: beyond the last seen section; `missing`",
)
STATE = (
    *_xyz("{}_m", "mid-chord point in the world frame"),
    *_xyz("d{}_m", "deflection: position minus the reference"),
    _metres("d_m", "total deflection: norm of dx_m, dy_m, dz_m"),
    *_xyz("d{}r_m", "deflection with the root's measured motion taken off"),
    _metres("dr_m", "norm of dxr_m, dyr_m, dzr_m"),
    *_xyz("u{}_m", "standard uncertainty (k = 1) of the position"),
    *_xyz("ud{}_m", "standard uncertainty (k = 1) of the deflection"),
    _metres("ud_m", "standard uncertainty (k = 1) of the total deflection"),
    Column("twist_deg", F64, "deg", "twist change, positive: trailing edge to suction side", True),
    Column("utwist_deg", F64, "deg", "standard uncertainty (k = 1) of the twist change", True),
    Column("n_points", U32, "count", "points used"),
    Column("lidars", STR, "name", "lidars whose points were used, such as `L1+L3`; empty: none"),
    STATUS_COLUMN,
    Column("reason", STR, "name", "why it is not `ok`: `overhead`, `lost`, `ill_posed`, ...", True),
)
LOAD = Column("load", F64, "percent", "load; null where no channel says it", True)

DEFLECTION = Table("deflection", "time and section", (*TIME, STEP, LOAD, *SECTION, *STATE))
STEPS = Table(
    "steps",
    "load step and section, averaged over the hold; `time` is the middle of the hold",
    (
        *TIME,
        Column("from", UTC_NS, "UTC", "first instant of the hold"),
        Column("to", UTC_NS, "UTC", "last instant of the hold"),
        Column("step", STR, "name", "load step: `0 %`, `40 %`, a second time `100 % (2)`"),
        LOAD,
        *SECTION,
        *STATE,
    ),
)
CONTOUR = Table(
    "contour",
    "time and station of the blade line (step states and 1 Hz)",
    (
        *TIME,
        SECTION[1],
        *_xyz("{}_m", "mid-chord point in the world frame"),
        *_xyz("u{}_m", "standard uncertainty (k = 1) of the position"),
        Column("rx_rad", F64, "rad", "rotation about world x since the unloaded hold", True),
        Column("ry_rad", F64, "rad", "rotation about world y since the unloaded hold", True),
        Column("urx_rad", F64, "rad", "standard uncertainty (k = 1) of rx_rad", True),
        Column("ury_rad", F64, "rad", "standard uncertainty (k = 1) of ry_rad", True),
        Column("twist_deg", F64, "deg", "twist change", True),
        Column("utwist_deg", F64, "deg", "standard uncertainty (k = 1) of the twist change", True),
        STATUS_COLUMN,
    ),
)
POINTS = Table(
    "points",
    "blade point of a few frames per step, thinned",
    (
        *TIME,
        LIDAR,
        Column("ring", U32, "index", "laser of the lidar, 0 = lowest for Velodyne"),
        *_xyz("{}_m", "point in the world frame", nullable=False),
        _metres("s_m", "arc length of the nearest station"),
        _metres("residual_m", "signed distance to the model"),
        Column(
            "chord",
            F64,
            "ratio",
            "chord fraction where its ray meets the model, from the leading edge; below 0 on the "
            "pressure side",
            True,
        ),
    ),
)
OUTLINE = Table(
    "outline",
    "load step, section and point of its outline: the surface as the adjustment has it",
    (
        *TIME,
        Column("step", STR, "name", "load step"),
        *SECTION,
        Column(
            "place",
            U32,
            "index",
            "from the leading edge over the suction side to the trailing edge and back",
        ),
        *_xyz(
            "{}_m",
            "point of the surface in the world frame, averaged over the hold",
            nullable=False,
        ),
        Column("u_m", F64, "m", "standard uncertainty (k = 1) along the normal"),
    ),
)
REJECTED = Table(
    "rejected",
    "object on or near the blade that did not count",
    (
        *TIME,
        Column("reason", STR, "name", "why it did not count"),
        Column("count", U32, "count", "points of the object"),
        _metres("s_m", "arc length of the nearest station"),
        *_xyz("{}_m", "centre of the object in the world frame"),
    ),
)
HEALTH = Table(
    "health",
    "second and lidar",
    (
        *TIME,
        LIDAR,
        Column("packets", U32, "count", "data packets that arrived"),
        Column("lost", U32, "count", "packets that never arrived"),
        Column("duplicated", U32, "count", "packets that arrived twice"),
        Column("late", U32, "count", "packets out of order beyond what is put in order"),
        Column("points", U32, "count", "points decoded"),
        Column("blade_points", U32, "count", "points that counted as blade", True),
        Column("rpm", F64, "1/min", "turns of the lidar per minute", True),
        Column("clock_offset_s", F64, "s", "device clock minus UTC", True),
        Column("coverage", F64, "ratio", "share of the turn whose packets arrived", True),
    ),
)
POSES = Table(
    "poses",
    "lidar and time where it moved or was watched",
    (
        *TIME,
        LIDAR,
        *(Column(f"r{a}_mrad", F64, "mrad", f"turn since the calibration, {a}") for a in "xyz"),
        *(Column(f"t{a}_mm", F64, "mm", f"shift since the calibration, {a}") for a in "xyz"),
        *(Column(f"ur{a}_mrad", F64, "mrad", f"its uncertainty (k = 1), {a}", True) for a in "xyz"),
        *(Column(f"ut{a}_mm", F64, "mm", f"its uncertainty (k = 1), {a}", True) for a in "xyz"),
        Column("moved", pl.Boolean(), "name", "whether the change is beyond its uncertainty"),
        Column("followed", pl.Boolean(), "name", "whether states take it into account"),
    ),
)
CHANNELS = Table(
    "channels",
    "sample of every read channel (load, wires, root, others; after any clock shift)",
    (
        *TIME,
        Column("channel", STR, "name", "load, a wire's name, root_rx, ..."),
        Column("value", F64, "see unit", "reading; null where the file has none", True),
        Column("unit", STR, "name", "unit of `value`"),
    ),
)
COMPARISON = Table(
    "comparison",
    "step, section and source; written by `compare`",
    (
        *TIME,
        Column("step", STR, "name", "load step"),
        *SECTION,
        Column("source", STR, "name", "what was held against: wire name, prediction, truth, run"),
        Column(
            "quantity",
            STR,
            "name",
            "`total`, `wire` (shortening along the wire's line), `direction`, `dx`, `dy`, `dz`",
        ),
        _metres("measured_m", "measured value of the quantity"),
        _metres("u_m", "standard uncertainty (k = 1) of the measured value"),
        _metres("reference_m", "value of the reference"),
        Column(
            "error_percent", F64, "percent", "(measured - reference) / reference, eq. (16)", True
        ),
    ),
)
CYCLES = Table(
    "cycles",
    "section and cycle of a fatigue test",
    (
        *TIME,
        *SECTION,
        Column("cycle", U32, "index", "number of the cycle from 0"),
        *_xyz("amplitude_{}_m", "amplitude"),
        *_xyz("uamplitude_{}_m", "standard uncertainty (k = 1) of the amplitude"),
        *_xyz("mean_{}_m", "mean position in the cycle"),
        *_xyz("umean_{}_m", "standard uncertainty (k = 1) of the mean"),
        *(Column(f"phase_{a}_deg", F64, "deg", f"phase, {a}", True) for a in "xyz"),
        *(
            Column(f"uphase_{a}_deg", F64, "deg", f"its uncertainty (k = 1), {a}", True)
            for a in "xyz"
        ),
        Column("frequency_hz", F64, "Hz", "frequency of the cycle", True),
        Column("ufrequency_hz", F64, "Hz", "standard uncertainty (k = 1) of the frequency", True),
    ),
)
DECODED = Table(
    "decoded",
    "point of a capture, in the order of arrival; written by `decode`",
    (
        TIME[0],
        LIDAR,
        Column("sweep", U32, "index", "turn since the start of the capture"),
        Column("packet", U32, "index", "data packet of the stream"),
        Column("block", U32, "index", "block or column within the packet"),
        Column("frame_id", U32, "index", "frame counter of the sensor", True),
        Column("ring", U32, "index", "laser or row of the sensor"),
        Column("azimuth_deg", F64, "deg", "azimuth of the firing"),
        Column("range_m", F64, "m", "distance from the optical centre"),
        *(Column(f"{a}_m", F32, "m", f"point in the sensor frame, {a}") for a in "xyz"),
        Column("intensity", F32, "see sensor", "intensity as the sensor gives it"),
        Column("return_index", pl.UInt8(), "index", "number of the echo of its shot"),
        Column("return_kind", pl.Enum(RETURN_KINDS), "name", "which echo it was"),
    ),
)

SCHEMAS: Mapping[str, Table] = MappingProxyType(
    {
        table.name: table
        for table in (
            DEFLECTION,
            STEPS,
            CONTOUR,
            POINTS,
            OUTLINE,
            REJECTED,
            HEALTH,
            POSES,
            CHANNELS,
            COMPARISON,
            CYCLES,
            DECODED,
        )
    }
)
"""All tables by name; a file ``NAME.parquet`` of a result folder holds the table ``NAME``."""
