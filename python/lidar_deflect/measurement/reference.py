"""The unloaded blade of the paper's method: its sections and their arc lengths to the tip."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import geometry
from lidar_deflect.errors import MeasurementError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lidar_deflect.measurement.contours import ContourRun
    from lidar_deflect.measurement.inputs import Inputs

    Floats = NDArray[np.float64]

MIN_FRAMES = 3
"""Fewer unloaded frames than this fix no reference."""


@dataclass(frozen=True)
class Reference:
    """The unloaded blade: where its sections are and how far from the tip.

    Attributes
    ----------
    s_m
        Sections, arc length from the root, shape (s,).
    position_m
        Where they are, shape (s, 3), world frame.
    to_tip_m
        Arc length from each section to the tip, equation (15), shape (s,).
    tip_z_m, u_tip_z_m
        Median place of the intersection along the span, and the scatter of a single one.
    blade_points
        Median points per frame of each lidar, shape (lidars,).
    plane
        Plane of step 10, ``xoz`` or ``yoz``.
    frames
        Frames it rests on.
    """

    s_m: Floats
    position_m: Floats
    to_tip_m: Floats
    tip_z_m: float
    u_tip_z_m: float
    blade_points: Floats
    plane: str
    frames: int

    def arc_to_tip_m(self, s_m: Floats) -> Floats:
        """Arc length to the tip of any stations, shape as given: as of the nearest section."""
        nearest = np.abs(s_m[:, None] - self.s_m).argmin(axis=1)
        return np.asarray(self.to_tip_m[nearest] + self.s_m[nearest] - s_m)

    def to_dict(self) -> dict[str, Any]:
        """Plain document for files."""
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in asdict(self).items()
        }

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Reference:
        """Read what `to_dict` wrote."""
        fields: dict[str, Any] = dict(document)
        for name in ("s_m", "position_m", "to_tip_m", "blade_points"):
            fields[name] = np.array(fields[name], dtype=np.float64)
        return cls(**fields)


def reference_of(inputs: Inputs, contours: ContourRun, plane: str) -> Reference:
    """Return the unloaded state from this capture's unloaded hold, else from the calibration.

    Raises
    ------
    MeasurementError
        If neither has one, or too few frames of the hold give a tip.
    """
    s_m = np.array([section.s_m for section in inputs.config.sections])
    if inputs.unloaded_ns is None:
        return _kept_reference(inputs, s_m)
    unloaded = _inside(contours.time_ns, inputs.unloaded_ns)
    z_m = _unloaded_z_m(inputs, s_m)
    to_tip = contours.arc_to_tip(plane, z_m)
    used = contours.uses.used
    # Where a lidar of the hold is missing, the curves reach its part of the blade blindly.
    complete = (used[:, np.median(used[unloaded], axis=0) > 0] > 0).all(axis=1)
    good = unloaded & complete & ~np.isnan(to_tip).any(axis=1)
    if good.sum() < MIN_FRAMES:
        raise _no_tip(contours, plane, unloaded)
    tips = contours.tip_z_m(plane)[good]
    return Reference(
        s_m=s_m,
        position_m=np.mean(contours.points_at(z_m)[good], axis=0),
        to_tip_m=np.median(to_tip[good], axis=0),
        tip_z_m=float(np.median(tips)),
        u_tip_z_m=float(np.std(tips)),
        blade_points=np.median(used[unloaded], axis=0),
        plane=plane,
        frames=int(good.sum()),
    )


def _kept_reference(inputs: Inputs, s_m: Floats) -> Reference:
    kept = Reference.from_dict(inputs.calibration.reference["paper"]["state"])
    if not np.array_equal(kept.s_m, s_m):
        raise MeasurementError(
            "the unloaded state in the calibration is of other sections",
            code="measurement.reference_sections",
            facts=[
                ("calibration", ", ".join(f"{s:g} m" for s in kept.s_m)),
                ("test", ", ".join(f"{s:g} m" for s in s_m)),
            ],
            hint="calibrate again with the configuration of this test",
        )
    return kept


def _unloaded_z_m(inputs: Inputs, s_m: Floats) -> Floats:
    """Place of the sections along the unloaded axis: shortened by prebend where it is known."""
    nominal = geometry.read_geometry(inputs.config.blade)
    if nominal is None:
        return s_m
    station, prebend = nominal.stations.s_m, nominal.stations.prebend_m
    along = np.sqrt(np.clip(np.diff(station) ** 2 - np.diff(prebend) ** 2, 0.0, None))
    z_m = np.concatenate([[0.0], np.cumsum(along)]) + station[0]
    return np.asarray(np.interp(s_m, station, z_m))


def _inside(time_ns: NDArray[np.int64], window: tuple[int, int]) -> NDArray[np.bool_]:
    return (time_ns >= window[0]) & (time_ns <= window[1])


def _no_tip(contours: ContourRun, plane: str, unloaded: NDArray[np.bool_]) -> MeasurementError:
    names = [name for name in contours.failures(plane)[unloaded] if name is not None]
    return MeasurementError(
        f"no tip in the unloaded hold: {len(names)} of {int(unloaded.sum())} frames refused",
        code="measurement.no_reference",
        facts=[(name, f"{names.count(name)} frames") for name in sorted(set(names))],
        hint="see the contours of a frame, then degrees, plane and line_distance_m of [paper]",
    )
