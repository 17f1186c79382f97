"""The test, its blade, and the sections that are wanted."""

from typing import Literal, Self

from pydantic import Field, model_validator

from lidar_deflect.config.base import (
    Direction,
    FilePath,
    Model,
    Name,
    NotNegative,
    Positive,
    Share,
    Text,
    problem,
)


class TestInfo(Model):
    """What is tested and by whom."""

    __test__ = False  # no test case of pytest, whatever its name begins with

    id: Text = Field(default="test", min_length=1, description="name of the test, on every table")
    kind: Literal["static", "fatigue"] = Field(default="static", description="static | fatigue")
    customer: Text = Field(default="", description="for the report's cover")
    operator: Text = Field(default="", description="for the report's cover")
    blade_serial: Text = Field(default="", description="for the report's cover")
    standard: Text = Field(default="", description="for the report's cover")
    place: Text = Field(default="", description="for the report's cover")
    notes: Text = Field(default="", description="for the report's cover")


class Blade(Model):
    """The blade as the drawing gives it and as it is clamped."""

    length_m: Positive = Field(
        le=500, description="arc length from root to tip along the neutral axis"
    )
    geometry: FilePath | None = Field(
        default=None, description="nominal geometry per station, blade.csv"
    )
    contours: FilePath | None = Field(default=None, description="section contours, contours.csv")
    leading_edge: Direction | None = Field(
        default=None,
        description="where the leading edge points at zero twist: world axis or vector",
    )
    suction_side: Direction | None = Field(
        default=None, description="where the suction side faces at zero twist: world axis or vector"
    )
    setting_u_deg: NotNegative = Field(
        default=0.3, le=45, description="how well the setting angle in the stand is known"
    )
    axis_fraction: Share = Field(
        default=0.35,
        description="without geometry: chord fraction of the neutral axis, from the leading edge",
    )
    axis_fraction_u: NotNegative = Field(
        default=0.1, le=0.5, description="standard uncertainty of axis_fraction"
    )

    @model_validator(mode="after")
    def _sides_fit(self) -> Self:
        for key in ("leading_edge", "suction_side"):
            vector = getattr(self, key)
            if vector is not None and abs(vector[2]) > 0.2:
                raise problem(
                    key,
                    "points along the blade",
                    expected="a direction across the blade: the world's z axis runs to the tip",
                )
        if self.leading_edge and self.suction_side:
            cosine = sum(a * b for a, b in zip(self.leading_edge, self.suction_side, strict=True))
            if abs(cosine) > 0.1:
                raise problem(
                    "suction_side",
                    "is not at right angles to leading_edge",
                    expected="two directions at right angles to each other",
                )
        return self


class Section(Model):
    """One material cross-section whose deflection is wanted."""

    name: Name = Field(description="name of the section in all tables")
    s_m: NotNegative = Field(description="arc length from the root along the neutral axis")
