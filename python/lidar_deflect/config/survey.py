"""What total station and tape know: surfaces, targets, distances; and priors on the lidars."""

from typing import Annotated, Literal

from pydantic import Field

from lidar_deflect.config.base import Model, Name, NotNegative, Point, Positive


class ControlPoint(Model):
    """One surveyed point on a surface that the lidars see."""

    on: Annotated[str, Field(pattern=r"^(ground|wall|plane:[\w.\-]+)$")] = Field(
        description="ground | wall | plane:NAME"
    )
    xyz_m: Point = Field(description="world frame")
    u_m: Positive = Field(default=0.005, description="standard uncertainty per coordinate")


class Target(Model):
    """One surveyed target."""

    name: Name = Field(description="name of the target")
    kind: Literal["sheet", "sphere"] = Field(description="sheet (retroreflective) | sphere")
    size_m: Positive = Field(le=10, description="edge length of a sheet, diameter of a sphere")
    xyz_m: Point = Field(description="its centre, world frame")
    u_m: Positive = Field(default=0.001, description="standard uncertainty per coordinate")


class Distance(Model):
    """One taped distance between two sensors."""

    between: tuple[Name, Name] = Field(description="ids of the two lidars")
    m: Positive = Field(description="distance between their optical centres")
    u_m: Positive = Field(default=0.01, description="standard uncertainty")


class Calibrate(Model):
    """How the lidars are registered, and priors of what may be wrong with one."""

    method: Literal["network", "closed_form"] = Field(
        default="network",
        description="network (one adjustment of everything known) | closed_form (paper, steps 1-4)",
    )
    channel_offset_u_m: NotNegative = Field(
        default=0.02, description="prior sigma of each channel's range offset"
    )
    elevation_u_deg: NotNegative = Field(
        default=0.02, description="prior sigma of a common elevation offset per lidar"
    )
    range_scale_u: NotNegative = Field(default=1e-4, description="prior sigma of the range scale")
    drift: Literal["follow", "mark"] = Field(
        default="follow",
        description="a tripod that moves in the test: follow to its new pose | mark the results",
    )
