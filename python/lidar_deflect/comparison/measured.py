"""What the lidars say of one step and section, in the quantity that a reference has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from lidar_deflect.wires import Line, spans, unit_vector

Vector = npt.NDArray[np.float64]
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Measured:
    """One row of the table ``steps`` with its place in the unloaded state.

    Parameters
    ----------
    row
        Row of ``steps``.
    deflection_m
        Deflection, shape (3,).
    u_m
        Standard uncertainty of its components, shape (3,); NaN where the method has none.
    place_m
        Mid-chord point in the hold, world frame, shape (3,).
    """

    row: dict[str, Any]
    deflection_m: Vector
    u_m: Vector
    place_m: Vector

    @property
    def total(self) -> tuple[float, float]:
        """Total deflection and its uncertainty."""
        u = self.row["ud_m"]
        return float(np.linalg.norm(self.deflection_m)), float("nan") if u is None else u

    def along(self, direction: Vector) -> tuple[float, float]:
        """Component along a unit vector and its uncertainty (axes taken as independent)."""
        u = float(np.sqrt(np.sum((direction * self.u_m) ** 2)))
        return float(self.deflection_m @ direction), u

    def shortening(self, line: Line, turn: Vector | None = None) -> tuple[float, float]:
        """Return what a wire would have read, and its uncertainty.

        That is the distance from anchor to tie in the reference, minus the distance in the hold.

        Parameters
        ----------
        line
            Line of the wire.
        turn
            Rotation of the section since the reference, shape (3, 3); needed where the wire is
            tied beside the mid-chord point.
        """
        loaded, unloaded = spans(line, self.place_m, self.deflection_m, turn)
        length = float(np.linalg.norm(loaded))
        u = float(np.sqrt(np.sum((loaded / length * self.u_m) ** 2)))
        return float(np.linalg.norm(unloaded)) - length, u


def of_steps(steps: pl.DataFrame) -> list[Measured]:
    """Rows of the table ``steps`` that were measured, in their order."""
    known = steps.filter(pl.all_horizontal(pl.col("dx_m", "dy_m", "dz_m").is_not_null()))
    return [
        Measured(
            row,
            _vector(row, "d{}_m"),
            _vector(row, "ud{}_m"),
            _vector(row, "{}_m"),
        )
        for row in known.iter_rows(named=True)
    ]


def _vector(row: dict[str, Any], pattern: str) -> Vector:
    values = (row[pattern.format(axis)] for axis in AXES)
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def span_ns(row: dict[str, Any], spans: pl.DataFrame) -> tuple[int, int]:
    """First and last instant of the step of `row`, nanoseconds, from `spans_of`."""
    found = spans.filter(pl.col("step") == row["step"])
    return int(found["from_ns"][0]), int(found["to_ns"][0])


def spans_of(steps: pl.DataFrame) -> pl.DataFrame:
    """Table of ``step``, ``from_ns``, ``to_ns`` and ``load``, in time order."""
    return (
        steps.select(
            "step",
            pl.col("from").cast(pl.Int64).alias("from_ns"),
            pl.col("to").cast(pl.Int64).alias("to_ns"),
            "load",
        )
        .unique("step", maintain_order=True)
        .sort("from_ns")
    )


def reference_span_ns(spans: pl.DataFrame) -> tuple[int, int] | None:
    """First unloaded hold, or None where no step is unloaded."""
    unloaded = spans.filter((pl.col("load").abs() < 1.0) | pl.col("step").str.starts_with("0 %"))
    return (unloaded["from_ns"][0], unloaded["to_ns"][0]) if unloaded.height else None


def load_direction(config: Mapping[str, Any], rows: Sequence[Measured]) -> Vector:
    """Return the unit vector of the load: as configured, else of the largest deflection."""
    given = (config.get("load") or {}).get("direction")
    if given is not None:
        return unit_vector(given)
    largest = max(rows, key=lambda each: float(np.linalg.norm(each.deflection_m)))
    return unit_vector(largest.deflection_m.tolist())
