"""The lidars: which packets are theirs, where they stand and how they are mounted."""

import math
from typing import Annotated, Self

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from lidar_deflect.config.base import (
    Direction,
    FilePath,
    Model,
    Name,
    Number,
    Point,
    Positive,
    Range,
    Source,
    Text,
    problem,
)

Vector = tuple[float, float, float]
Row = tuple[Number, Number, Number, Number]


def _dot(a: Vector, b: Vector) -> float:
    return sum(p * q for p, q in zip(a, b, strict=True))


def _cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


class SensorAxes(Model):
    """Where the sensor's own axes point in the world, as its driver publishes points."""

    x: Direction = Field(description="world direction of the sensor's x axis")
    y: Direction = Field(description="world direction of the sensor's y axis")
    z: Direction = Field(description="world direction of the sensor's z axis, the spin axis")

    @model_validator(mode="after")
    def _right_handed(self) -> Self:
        pairs = ((self.x, self.y), (self.y, self.z), (self.z, self.x))
        if any(abs(_dot(a, b)) > 0.02 for a, b in pairs):
            raise problem("", "these axes are not at right angles to one another")
        if _dot(_cross(self.x, self.y), self.z) < 0:
            raise problem(
                "",
                "these axes form a left-handed frame, which no mounting can reach",
                expected="x cross y = z",
                hint="turn one of them round: see where x (azimuth 0) really points",
            )
        return self

    def world_from_sensor(self) -> tuple[Vector, Vector, Vector]:
        """Rotation matrix, rows first: its columns are the sensor's axes in the world."""
        x, y, z = self.x, self.y, self.z
        return ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))


def _rigid(rows: tuple[Row, ...]) -> tuple[Row, ...]:
    """Accept nothing, or a rigid transform."""
    if not rows:
        return rows
    if len(rows) != 4 or any(abs(a - b) > 1e-9 for a, b in zip(rows[3], (0, 0, 0, 1), strict=True)):
        raise PydanticCustomError("pose", "Input should have 4 rows, the last [0, 0, 0, 1]")
    columns: list[Vector] = [(rows[0][i], rows[1][i], rows[2][i]) for i in range(3)]
    a, b, c = columns
    products = [_dot(a, a) - 1, _dot(b, b) - 1, _dot(c, c) - 1, _dot(a, b), _dot(b, c), _dot(c, a)]
    if max(map(abs, products)) > 1e-5 or _dot(_cross(a, b), c) < 0:
        raise PydanticCustomError("pose", "Input should hold a right-handed rotation matrix")
    return rows


Pose = Annotated[
    tuple[Row, ...],
    AfterValidator(_rigid),
    WithJsonSchema(
        {
            "type": "array",
            "maxItems": 4,
            "items": {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4},
        }
    ),
]


class Lidar(Model):
    """One lidar."""

    id: Name = Field(description="name of the lidar in all tables")
    model: Text = Field(
        default="auto", pattern=r"^[a-z0-9-]+$", description='"auto", or a model id such as "vlp16"'
    )
    source: Source | None = Field(
        default=None,
        description="address, address:port or topic of its packets; needed with several lidars",
    )
    position_m: Point | None = Field(
        default=None,
        description="surveyed optical centre (or survey mark, see lever_arm_m), world frame",
    )
    position_u_m: Positive = Field(default=0.005, description="standard uncertainty per coordinate")
    lever_arm_m: Point = Field(
        default=(0.0, 0.0, 0.0),
        description="from the surveyed point to the optical centre, sensor frame",
    )
    axes: SensorAxes | None = Field(
        default=None, description="where the sensor's own axes point, to within axes_u_deg"
    )
    axes_u_deg: Positive = Field(default=10.0, le=180, description="how well axes are known")
    world_from_sensor: Pose = Field(
        default=(), description="4 x 4 pose from elsewhere, used as the start; [] for none"
    )
    beams: tuple[FilePath, ...] = Field(
        default=(), description="the unit's own angle, fire-time, channel or metadata files"
    )
    ground_range_m: Range | None = Field(
        default=None, description="for this lidar instead of paper.ground_range_m"
    )

    def nominal_rotation(self) -> tuple[Vector, Vector, Vector] | None:
        """Rotation world_from_sensor as mounted: of `axes`, else of the given pose, else none."""
        if self.axes is not None:
            return self.axes.world_from_sensor()
        if not self.world_from_sensor or not all(map(math.isfinite, self.world_from_sensor[0])):
            return None
        first, second, third = (row[:3] for row in self.world_from_sensor[:3])
        return (first, second, third)
