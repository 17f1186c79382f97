"""What other instruments and calculations say: draw wires, root rotation, load, prediction."""

from typing import Literal, Self

from pydantic import Field, model_validator

from lidar_deflect.config.base import (
    Column,
    Direction,
    FilePath,
    Flag,
    LengthUnit,
    Model,
    Name,
    NotNegative,
    Number,
    Point,
    Positive,
    problem,
)


class Wire(Model):
    """One draw wire; without a file it is virtual and its reading is predicted."""

    name: Name = Field(description="name of the wire")
    section: Name = Field(description="name of the section it is tied to")
    attach: Literal["mid_chord", "leading_edge", "trailing_edge"] | tuple[Number, Number] = Field(
        default="mid_chord",
        description="mid_chord | leading_edge | trailing_edge | [chordwise_m, thickness_m]",
    )
    anchor_m: Point = Field(description="winch or sensor end, world frame")
    file: FilePath | None = Field(default=None, description="channel file with its readings")
    time: Column = Field(default="time_utc_s", description="column of the time, UTC")
    column: Column | None = Field(default=None, description="column of the reading")
    unit: LengthUnit = Field(default="mm", description="mm | cm | m")
    negate: Flag = Field(
        default=False, description="true where the reading grows with the distance"
    )
    shift_s: Number | None = Field(
        default=None,
        description="seconds to add to the file's times; default: estimated where clocks differ",
    )

    @model_validator(mode="after")
    def _has_column(self) -> Self:
        if self.file is not None and self.column is None:
            raise problem("column", "a wire with a file needs the column of its reading")
        return self


class OtherChannel(Model):
    """Any other instrument (strain, inclinometer, wind): kept and shown beside the deflection."""

    name: Name = Field(description="name of the channel in tables and figures")
    file: FilePath = Field(description="channel file")
    time: Column = Field(default="time_utc_s", description="column of the time, UTC")
    column: Column = Field(description="column of the reading")
    unit: str = Field(default="", description="its unit, as it is to be shown")
    shift_s: Number | None = Field(
        default=None,
        description="seconds to add to the file's times; default: estimated where clocks differ",
    )


class Root(Model):
    """Measured rotation of root or stand: right-hand about the world axes, zero at reference."""

    file: FilePath = Field(description="channel file")
    time: Column = Field(default="time_utc_s", description="column of the time, UTC")
    rx: Column | None = Field(default=None, description="column of the rotation about x, in mrad")
    ry: Column | None = Field(default=None, description="column of the rotation about y, in mrad")
    rz: Column | None = Field(default=None, description="column of the rotation about z, in mrad")
    u_mrad: Positive = Field(default=0.05, description="standard uncertainty of each rotation")
    shift_s: Number | None = Field(
        default=None,
        description="seconds to add to the file's times; default: estimated where clocks differ",
    )

    @model_validator(mode="after")
    def _has_a_rotation(self) -> Self:
        if self.rx is None and self.ry is None and self.rz is None:
            raise problem("rx", "no rotation is named", expected="at least one of rx, ry, rz")
        return self


class Reference(Model):
    """The unloaded hold; what is left out is found from the data."""

    capture: FilePath | None = Field(default=None, description="which capture; default: the first")
    from_s: NotNegative | None = Field(
        default=None, description="start, since the first accepted lidar packet of that capture"
    )
    to_s: NotNegative | None = Field(default=None, description="end, on the same scale")

    @model_validator(mode="after")
    def _is_a_span(self) -> Self:
        if self.to_s is not None and self.to_s <= (self.from_s or 0.0):
            raise problem("to_s", "the hold ends before it starts", expected="to_s > from_s")
        return self


class Load(Model):
    """The load channel, and where the load enters the blade."""

    file: FilePath | None = Field(default=None, description="channel file; steps come from it")
    time: Column = Field(default="time_utc_s", description="column of the time, UTC")
    value: Column | None = Field(default=None, description="column of the load")
    unit: Literal["percent", "fraction", "N", "kN", "MN", "Nm", "kNm", "MNm", "t", "bar", "V"] = (
        Field(
            default="percent",
            description="percent | fraction, or N kN MN Nm kNm MNm t bar V (highest hold: 100 %)",
        )
    )
    shift_s: Number | None = Field(
        default=None,
        description="seconds to add to the file's times; default: estimated where clocks differ",
    )
    direction: Direction | None = Field(
        default=None, description="world axis or vector; default: of the largest deflection"
    )
    saddles_s_m: tuple[Positive, ...] = Field(
        default=(), description="where the load enters, arc length along the neutral axis"
    )

    @model_validator(mode="after")
    def _has_value(self) -> Self:
        if self.file is not None and self.value is None:
            raise problem("value", "a load file needs the column of the load")
        return self


class Prediction(Model):
    """A calculation to hold the measurement against; linear in load."""

    file: FilePath = Field(description="table of the prediction")
    section: Column = Field(
        default="section_m", description="column of the section's arc length in m"
    )
    value: Column | tuple[Column, Column, Column] = Field(
        description="column of the deflection; three columns x, y, z for a vector"
    )
    unit: LengthUnit = Field(default="mm", description="mm | cm | m")
    quantity: Literal["total", "direction", "vector"] = Field(
        default="total", description="total | direction (component along the load) | vector"
    )
    at_percent: Positive = Field(default=100.0, description="load at which the prediction holds")
    tolerance_percent: Positive | None = Field(
        default=None, description="the user's own tolerance; no standard's number is built in"
    )

    @model_validator(mode="after")
    def _columns_fit(self) -> Self:
        if (self.quantity == "vector") == isinstance(self.value, str):
            raise problem(
                "value",
                f"does not fit quantity = {self.quantity!r}",
                expected="three columns for a vector, else one column",
            )
        return self
