"""Poses of all lidars with the evidence they rest on, and their file `calibration.toml`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomlkit

from lidar_deflect.errors import CalibrationError
from lidar_deflect.files import whole_file, write_text
from lidar_deflect.notebook import card

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

SCHEMA = "lidar-deflect.calibration/1"


@dataclass(frozen=True)
class Pose:
    """Pose of one lidar.

    Attributes
    ----------
    id, source
        The lidar, as the configuration names it and as its packets are addressed.
    world_from_sensor
        Shape (4, 4), metres; the sensor frame is that of the vendor's driver.
    evidence
        What it rests on: numbers and words, by name.
    covariance
        Shape (6, 6), order wx wy wz tx ty tz: R_true = Exp(w) R, t_true = t + dt, about the world
        axes (rad, m). None where the method gives none.
    """

    id: str
    source: str
    world_from_sensor: NDArray[np.float64]
    evidence: Mapping[str, Any] = field(default_factory=dict)
    covariance: NDArray[np.float64] | None = None

    @property
    def position_m(self) -> NDArray[np.float64]:
        """Optical centre in the world frame, shape (3,)."""
        return self.world_from_sensor[:3, 3]


@dataclass(frozen=True)
class Nuisances:
    """What the adjustment found to be wrong with one lidar.

    Attributes
    ----------
    channel_offset_m
        By ring, shape (channels,): measured range plus offset is the true range.
    elevation_offset_rad
        Added to every nominal elevation.
    range_scale
        True range is larger than the measured one by this share.
    """

    channel_offset_m: NDArray[np.float64]
    elevation_offset_rad: float = 0.0
    range_scale: float = 0.0


@dataclass(frozen=True, repr=False)
class Joint:
    """Poses of all lidars as one estimate; saved as `calibration.npz`.

    Attributes
    ----------
    lidars
        Ids, in the order of the covariances.
    covariance
        Shape (6 n, 6 n), each lidar wx wy wz tx ty tz as in `Pose.covariance`.
    nuisances
        By lidar.
    full_covariance
        Per lidar: the pose's six, elevation offset, range scale, then every channel's offset.
    """

    lidars: tuple[str, ...]
    covariance: NDArray[np.float64]
    nuisances: tuple[Nuisances, ...]
    full_covariance: NDArray[np.float64]

    def __repr__(self) -> str:
        return f"Joint({', '.join(self.lidars)}; {len(self.full_covariance)} unknowns)"

    def save(self, path: Path) -> None:
        """Write `calibration.npz`, under a temporary name first."""
        columns: dict[str, Any] = {
            "lidars": np.array(self.lidars),
            "covariance": self.covariance,
            "full_covariance": self.full_covariance,
            "elevation_offset_rad": np.array([n.elevation_offset_rad for n in self.nuisances]),
            "range_scale": np.array([n.range_scale for n in self.nuisances]),
        }
        for id, own in zip(self.lidars, self.nuisances, strict=True):
            columns[f"channel_offset_m:{id}"] = own.channel_offset_m
        with whole_file(path, overwrite=True) as temporary, temporary.open("wb") as file:
            np.savez(file, **columns)

    @classmethod
    def load(cls, path: Path) -> Joint:
        """Read `calibration.npz`."""
        with np.load(path) as file:
            lidars = tuple(str(id) for id in file["lidars"])
            nuisances = tuple(
                Nuisances(file[f"channel_offset_m:{id}"], float(elevation), float(scale))
                for id, elevation, scale in zip(
                    lidars, file["elevation_offset_rad"], file["range_scale"], strict=True
                )
            )
            return cls(lidars, file["covariance"], nuisances, file["full_covariance"])


@dataclass(frozen=True, repr=False)
class Calibration:
    """Poses of all lidars, how they were found, and the unloaded blade where it was seen.

    Attributes
    ----------
    poses
        One per lidar.
    method
        ``network`` (one adjustment), or ``closed_form`` (steps 1-4 of the paper).
    warnings
        What a user should know before trusting it.
    reference
        State of the unloaded blade by measuring method, so that a run without an unloaded hold can
        be measured; empty where none was seen.
    joint
        Poses and nuisances of all lidars with their joint covariance; None where the method has
        none.
    evidence
        What the adjustment as a whole rests on: verdict, surfaces, survey with residuals.
    """

    poses: tuple[Pose, ...]
    method: str
    warnings: tuple[str, ...] = ()
    reference: Mapping[str, Any] = field(default_factory=dict)
    joint: Joint | None = None
    evidence: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        names = ", ".join(pose.id for pose in self.poses)
        return f"Calibration({self.method}: {names}; {len(self.warnings)} warnings)"

    def _repr_html_(self) -> str:
        """Return where every lidar stands, and how well that is known."""
        head = ("lidar", "x (m)", "y (m)", "z (m)", "U shift (mm)", "U turn (mrad)")
        rows = [
            (pose.id, *map(float, pose.position_m), *_expanded(pose.covariance))
            for pose in self.poses
        ]
        note = "; ".join(self.warnings) or "U: largest expanded uncertainty (k = 2) of an axis"
        return card(repr(self), head, rows, note)

    def pose(self, id: str) -> Pose:
        """Return the pose of one lidar.

        Raises
        ------
        CalibrationError
            If the calibration has no such lidar.
        """
        for pose in self.poses:
            if pose.id == id:
                return pose
        raise CalibrationError(
            f"the calibration has no lidar {id!r}",
            code="calibration.unknown_lidar",
            facts=[("lidars", ", ".join(pose.id for pose in self.poses))],
            hint="calibrate with the configuration of this test",
        )

    def summary(self) -> str:
        """One page for people."""
        lines = [f"calibration ({self.method.replace('_', ' ')})"]
        for pose in self.poses:
            x, y, z = pose.position_m
            lines.append(f"  {pose.id:8} at {x:9.3f} {y:8.3f} {z:9.3f} m")
            lines += [f"    {name}: {_said(value)}" for name, value in pose.evidence.items()]
        lines += _evidence_lines(self.evidence)
        lines += [f"  warning: {warning}" for warning in self.warnings]
        return "\n".join(lines)

    @property
    def is_poor(self) -> bool:
        """Whether the verdict of the adjustment is that no pose of it deserves trust."""
        return str(self.evidence.get("verdict", "")).startswith("poor")

    def to_dict(self) -> dict[str, Any]:
        """Plain document of `calibration.toml`."""
        return {
            "schema": SCHEMA,
            "method": self.method,
            "warnings": list(self.warnings),
            "evidence": _plain(dict(self.evidence)),
            "lidars": [_pose_to_dict(pose) for pose in self.poses],
        } | ({"reference": _plain(dict(self.reference))} if self.reference else {})

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write `calibration.toml` and, beside it, the joint covariance as `.npz`."""
        path = write_text(Path(path), tomlkit.dumps(self.to_dict()), overwrite=overwrite)
        if self.joint is not None:
            self.joint.save(path.with_suffix(".npz"))
        return path

    @classmethod
    def load(cls, path: str | Path) -> Calibration:
        """Read `calibration.toml`.

        Raises
        ------
        CalibrationError
            If the file is missing, no TOML, or not a calibration.
        """
        path = Path(path)
        try:
            document = tomllib.loads(path.read_text(encoding="utf-8"))
            if document["schema"] != SCHEMA:
                raise KeyError("schema")
            poses = tuple(_pose_from_dict(entry) for entry in document["lidars"])
            beside = path.with_suffix(".npz")
            is_joint = document.get("method") == "network" and beside.is_file()
            joint = Joint.load(beside) if is_joint else None
        except (OSError, tomllib.TOMLDecodeError, KeyError, ValueError, TypeError) as error:
            raise CalibrationError(
                f"{path} is no calibration",
                code="calibration.file",
                facts=[("found", _why(error)), ("expected", f'schema = "{SCHEMA}"')],
                hint=f"make one: lidar-deflect calibrate -c test.toml CAPTURE -o {path.name}",
            ) from error
        return cls(
            poses,
            str(document.get("method", "unknown")),
            tuple(document.get("warnings", ())),
            document.get("reference", {}),
            joint,
            document.get("evidence", {}),
        )


def _expanded(covariance: NDArray[np.float64] | None) -> tuple[float | None, float | None]:
    """Largest expanded uncertainty (k = 2) of shift, mm, and turn, mrad, about any axis."""
    if covariance is None:
        return None, None
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return 2e3 * float(sigma[3:].max()), 2e3 * float(sigma[:3].max())


def _pose_to_dict(pose: Pose) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "id": pose.id,
        "source": pose.source,
        "world_from_sensor": pose.world_from_sensor.tolist(),
    }
    if pose.covariance is not None:
        entry["covariance"] = pose.covariance.tolist()
    return entry | {"evidence": _plain(dict(pose.evidence))}


def _pose_from_dict(entry: Mapping[str, Any]) -> Pose:
    covariance = entry.get("covariance")
    return Pose(
        str(entry["id"]),
        str(entry["source"]),
        np.array(entry["world_from_sensor"], dtype=np.float64).reshape(4, 4),
        entry.get("evidence", {}),
        None if covariance is None else np.array(covariance, dtype=np.float64).reshape(6, 6),
    )


def _plain(value: Any) -> Any:
    """Without arrays, numpy scalars and None, which TOML does not know."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items() if entry is not None}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value.item() if isinstance(value, np.generic) else value


def _evidence_lines(evidence: Mapping[str, Any]) -> Iterator[str]:
    """Say what all poses together rest on: surfaces, survey, targets, verdict."""
    for surface in evidence.get("surfaces", ()):
        rough_mm = surface.get("roughness_mm", 0.0)
        yield f"  {surface['name']}: rough by {rough_mm:.1f} mm"
    survey = evidence.get("survey", ())
    if survey:
        worst = max(survey, key=lambda entry: max(map(abs, entry["studentised"])))
        size = max(map(abs, worst["studentised"]))
        yield f"  survey: {len(survey)} values, the worst {worst['what']} ({size:.1f} sigma)"
    for target in evidence.get("targets", ()):
        seen = ", ".join(f"{id} {count}" for id, count in target["echoes"].items())
        yield f"  target {target['name']}: {seen or 'not seen'}"
    if "u_flapwise_mm_per_10_m" in evidence:
        turn, shift = evidence["u_common_roll_mrad"], evidence["u_flapwise_mm_per_10_m"]
        yield f"  all lidars about z: {turn:.2f} mrad, {shift:.1f} mm in 10 m of deflection (k = 1)"
    if "verdict" in evidence:
        yield f"  verdict: {evidence['verdict']}"


def _said(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_said(entry) for entry in value) + "]"
    return str(value)


def _why(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"no or another {error.args[0]}"
    return str(error).splitlines()[0] if str(error) else type(error).__name__


def with_reference(
    calibration: Calibration, method: str, reference: Mapping[str, Any]
) -> Calibration:
    """Return the calibration with the unloaded state of the blade under one more method."""
    kept = {**calibration.reference, method: _plain(dict(reference))}
    return replace(calibration, reference=kept)
