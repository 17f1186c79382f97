"""How to measure: the method, the parameters of the paper's method, and the quality gates."""

from typing import Literal

from pydantic import Field

from lidar_deflect.config.base import Count, Flag, Model, NotNegative, Positive, Range


class Measure(Model):
    """Which method, and how often."""

    method: Literal["beam", "paper"] = Field(default="beam", description="beam | paper")
    rate_hz: Positive = Field(default=10.0, le=1000, description="states per second")


class Box(Model):
    """A box in the world frame."""

    x: Range = Field(description="[low, high] in metres")
    y: Range = Field(description="[low, high] in metres")
    z: Range = Field(description="[low, high] in metres")


class Degrees(Model):
    """Degrees of the contour curves as polynomials in z, equation (14)."""

    yoz: Count = Field(default=1, le=5, description="of y over z")
    xoz: Count = Field(default=2, le=5, description="of x over z")


class Paper(Model):
    """Parameters of the method of Hu et al. 2024; numbers in brackets are its equations."""

    ground_range_m: Range | None = Field(
        default=None,
        description="step 2: ground points by distance from the lidar; default: from the data",
    )
    box_m: Box | None = Field(
        default=None,
        description="step 5: pass-through; default: around the blade of the reference hold, "
        "widened along the load",
    )
    alpha_deg: Positive | None = Field(
        default=None, le=10, description="(10) angular step; default: from the data"
    )
    mu: Positive = Field(default=1.5, description="(10) factor on the spacing of the points")
    beta_m: NotNegative = Field(default=0.05, description="(10) constant part of the radius")
    min_points: Count = Field(default=4, description="(10) MinPts, the point itself counts")
    intervals: Count = Field(default=8, le=1000, description="(9) k, intervals of the distance")
    continuous: Flag = Field(
        default=False, description="radius from each point's own distance, no intervals"
    )
    strict: Flag = Field(
        default=False, description="core if count > min_points, as printed, instead of >="
    )
    contour_radius_m: NotNegative = Field(
        default=0.0,
        description="step 8: radius along one contour; 0 = 1.5 x the largest distance between "
        "neighbouring lines",
    )
    contour_min_points: Count = Field(default=3, description="step 8: MinPts along one contour")
    line_degree: Count = Field(
        default=1, le=3, description="step 8: degree of the curve through one cluster"
    )
    line_distance_m: Positive = Field(default=0.6, description="(13) D, a cluster within it agrees")
    degrees: Degrees = Field(default=Degrees(), description="(14) degrees of the contour curves")
    plane: Literal["xoz", "yoz", "auto"] = Field(
        default="auto", description="step 10: xoz | yoz | auto (the two axes that deform most)"
    )
    tip_max_u_m: Positive = Field(
        default=5.0,
        description="step 10: a tip less certain than this along the span is ill-posed, by the "
        "scatter of the contour samples alone",
    )
    overhead_m: NotNegative = Field(
        default=1.5,
        description="step 12: overhead when the blade is nearer than this to the vertical above "
        "the lidar",
    )
    overhead: Literal["interpolate", "drop"] = Field(
        default="interpolate", description="step 12: interpolate | drop"
    )


class Gates(Model):
    """Limits beyond which a run is done, yet exits with 6."""

    max_lost_percent: NotNegative = Field(
        default=5.0, le=100, description="lost packets of any lidar"
    )
    max_u_m: Positive = Field(
        default=0.05,
        description="standard uncertainty of any deflection; skipped where a method has none",
    )
