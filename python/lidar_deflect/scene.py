"""Scenes of the simulator: TOML in, checked and frozen models out. Defaults live here only."""

from __future__ import annotations

import tomllib
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

import tomlkit
from pydantic import Field, ValidationError, field_validator, model_validator

from lidar_deflect.config import SensorAxes
from lidar_deflect.config.base import (
    Direction,
    Flag,
    Model,
    Name,
    NotNegative,
    Number,
    Point,
    Positive,
    Range,
)
from lidar_deflect.config.nearest import nearest_key, place_of
from lidar_deflect.errors import ConfigError, ConfigNotFoundError

Probability = Annotated[float, Field(ge=0, lt=1)]
UP_TO_HALF_TURN = Annotated[float, Field(gt=0, lt=90)]


class Blade(Model):
    """The blade: whose drawing, how clamped, how well built."""

    reference: str = Field(default="iea15-110m", description="name of a published reference blade")
    drawn: Annotated[int, Field(ge=0, lt=2**63)] | None = Field(
        default=None,
        description="seed of a blade that nobody published, in place of a reference; with length_m",
    )
    length_m: Positive | None = Field(
        default=None, description="stretched to this length; default: its own"
    )
    leading_edge: Direction = Field(
        default=(-1.0, 0.0, 0.0), description="where it points at zero twist"
    )
    suction_side: Direction = Field(
        default=(0.0, -1.0, 0.0), description="where it faces at zero twist"
    )
    chord_percent: NotNegative = Field(default=0.3, description="sigma of the built chord")
    setting_deg: NotNegative = Field(default=0.15, description="sigma of the setting angle")
    prebend_percent: NotNegative = Field(default=2.0, description="sigma of the built prebend")
    stiffness_percent: NotNegative = Field(default=5.0, description="sigma of each stiffness")
    waves_mm: NotNegative = Field(default=2.0, description="sigma of the surface about the drawing")
    mould_mm: NotNegative = Field(
        default=0.0,
        description="sigma of errors of the section that keep their form along the blade",
    )

    @model_validator(mode="after")
    def _length_of_a_drawn_one(self) -> Blade:
        if self.drawn is not None and not 20 <= (self.length_m or 0) <= 200:
            raise ValueError("a drawn blade needs length_m, 20 to 200 m")
        return self


class Saddle(Model):
    """Where a winch pulls."""

    s_m: Positive = Field(description="arc length of the saddle")
    force_kn: Number = Field(description="pull at 100 %")
    lever_m: tuple[Number, Number] = Field(
        default=(0.0, 0.0),
        description="cable's fixing from the axis, along the chord and to the suction side",
    )


class Loading(Model):
    """Load steps, and how the saddles pull."""

    direction: Direction = Field(default=(1.0, 0.0, 0.0), description="of the pull")
    follower: Flag = Field(default=False, description="the pull turns with the section")
    levels_percent: tuple[NotNegative, ...] = Field(
        default=(0.0, 40.0, 70.0, 100.0, 0.0), min_length=1
    )
    hold_s: Positive = Field(default=3.6, description="seconds at each level")
    ramp_s: Positive = Field(default=1.2, description="seconds between levels")
    winch_m: Number = Field(
        default=42.0, description="distance of the winches along the load direction"
    )
    winch_height_m: Number = Field(
        default=0.4, description="height of the winches above the ground"
    )
    root_mrad: Point = Field(default=(0.0, 0.0, 0.0), description="rotation of the root at 100 %")


class Sway(Model):
    """Swaying in one mode."""

    direction: Direction = Field(description="of the tip")
    order: Literal[1, 2] = Field(default=1, description="number of the bending mode")
    frequency_hz: Positive
    amplitude_mm: NotNegative = Field(description="at the tip")
    phase_deg: Number = 0.0


class Swing(Model):
    """One mode of a fatigue test."""

    direction: Direction = Field(description="of the tip")
    order: Literal[1, 2] = Field(default=1, description="number of the bending mode")
    amplitude_m: Positive = Field(description="at the tip")
    phase_deg: Number = 0.0


class Fatigue(Model):
    """A blade that is swung after the first hold, all modes at one frequency."""

    frequency_hz: Annotated[float, Field(ge=0.1, le=3)] = 0.6
    cycles: Annotated[int, Field(ge=1, le=100_000)] = Field(
        default=20, description="at full amplitude"
    )
    growth_s: Positive = Field(default=4.0, description="from rest to full amplitude")
    swings: tuple[Swing, ...] = Field(min_length=1)


class Ground(Model):
    """The ground: a sloped plane with rough heights on it."""

    height_m: Number = Field(default=-7.2, description="at x = z = 0")
    slope_x: Number = 0.018
    slope_z: Number = -0.012
    roughness_mm: NotNegative = Field(default=8.0, description="sigma of the heights")
    correlation_m: Positive = Field(
        default=0.8, description="distance over which heights are alike"
    )
    swell_mm: NotNegative = Field(
        default=0.0, description="sigma of wider swells, eight times as long"
    )


class Wall(Model):
    """A wall that stands upright along the blade."""

    x_m: Number = Field(default=-24.2, description="at z = 0")
    slope: Number = Field(default=0.0225, description="change of x per metre of z")
    z_m: Range = (60.0, 140.0)
    top_m: Number = Field(default=0.0, description="height of its top")
    bow_mm: Number = Field(default=0.0, description="its middle stands out against its ends")
    lean: Number = Field(default=0.0, description="change of x per metre of height")


class Box(Model):
    """A box that stands about."""

    middle_m: Point
    size_m: tuple[Positive, Positive, Positive]


class Target(Model):
    """A surveyed retroreflector."""

    name: Name
    kind: Literal["sheet", "sphere"] = "sheet"
    size_m: Positive = Field(
        default=0.3, le=10, description="edge of a sheet, diameter of a sphere"
    )
    position_m: Point = Field(description="its centre")
    facing: Direction = Field(default=(0.0, 0.0, -1.0), description="where a sheet faces")


class Clock(Model):
    """A lidar's clock against UTC."""

    offset_ms: Number = Field(default=0.0, description="ahead of UTC at the start")
    drift_ppm: Number = 0.0
    locked: Flag = Field(
        default=False, description="position packets tell of a receiver that holds it"
    )


class Kick(Model):
    """A tripod that somebody knocks against."""

    at_s: Positive = Field(description="since the start")
    turn_mrad: Point = Field(default=(0.0, 0.0, 0.0), description="about the world axes")
    shift_mm: Point = Field(default=(0.0, 0.0, 0.0), description="of the optical centre")


class Lidar(Model):
    """A lidar on the ground."""

    id: Name
    model: str = Field(
        default="vlp16",
        description="id of a sensor; one that cannot be simulated is refused with a list",
    )
    address: Annotated[str, Field(pattern=r"^\d{1,3}(\.\d{1,3}){3}$")]
    port: Annotated[int, Field(gt=0, lt=65536)] = 2368
    position_m: Point = Field(description="optical centre")
    axes: SensorAxes = Field(
        default_factory=lambda: SensorAxes.model_validate({"x": "-x", "y": "-y", "z": "+z"}),
        description="where its axes point by the plan",
    )
    rpm: Annotated[float, Field(ge=60, le=3000)] = 600.0
    clock: Clock = Clock()
    kick: Kick | None = Field(default=None, description="moves it during the test")
    silent_s: tuple[Range, ...] = Field(
        default=(), description="spans in which nothing arrives from it"
    )

    @field_validator("address")
    @classmethod
    def _octets(cls, value: str) -> str:
        if any(int(part) > 255 for part in value.split(".")):
            raise ValueError("an IPv4 address")
        return value


class Sensors(Model):
    """Mounting, optics and electronics of all lidars."""

    tilt_deg: NotNegative = Field(default=2.5, description="sigma of the tilt about each axis")
    beam_mrad: Positive = Field(default=1.0, description="full angle of a beam")
    noise_mm: NotNegative = Field(default=14.0, description="sigma of one range")
    channel_offset_mm: NotNegative = Field(
        default=7.0, description="sigma of the offset of each laser"
    )
    unit_offset_mm: NotNegative = Field(default=4.0, description="sigma of the offset of each unit")
    elevation_deg: NotNegative = Field(
        default=0.0, description="sigma of an elevation offset that all beams of a unit share"
    )
    incidence_bias_mm: Number = Field(
        default=0.0, description="error times (1 / cos(incidence) - 1)"
    )
    faint_bias_mm: Number = Field(
        default=0.0, description="error for each halving of the light that comes back"
    )
    retro_bias_mm: Number = Field(default=0.0, description="error of range to retroreflectors")
    noise_freedom: Annotated[int, Field(ge=0, le=1000)] = Field(
        default=0, description="degrees of freedom of Student's noise; 0 = normal"
    )
    dropout: Probability = Field(default=0.01, description="echoes lost whatever they meet")
    merge_m: NotNegative = Field(default=0.45, description="echoes closer than this melt into one")
    range_at_10_percent_m: Positive = Field(
        default=60.0, description="95 % of echoes of a 10 % surface"
    )
    max_range_m: Annotated[float, Field(gt=1, le=130)] = 100.0
    grazing_deg: UP_TO_HALF_TURN = Field(
        default=88.0, description="incidence that loses half of the echoes"
    )


class Network(Model):
    """What happens between lidars and recording."""

    loss: Probability = Field(default=0.002, description="of a packet by itself")
    bursts_per_s: NotNegative = Field(default=0.05, description="bursts of loss per lidar")
    burst_packets: NotNegative = Field(default=6.0, description="mean length of a burst")
    duplicates: Probability = 0.0005
    late: Probability = Field(
        default=0.0005, description="arrives behind its successors, within 30 ms"
    )
    jitter_us: NotNegative = Field(default=35.0, description="mean of the random delay")
    foreign_hz: NotNegative = Field(default=7.5, description="datagrams of others, of each kind")
    position_hz: NotNegative = Field(default=10.0, description="position packets per lidar")


class Survey(Model):
    """What surveyors and channels would tell."""

    position_mm: NotNegative = Field(default=5.0, description="sigma of surveyed points")
    ground_points: Annotated[int, Field(ge=0, le=600)] = 24
    wall_points: Annotated[int, Field(ge=0, le=600)] = 8
    wire_mm: NotNegative = Field(default=2.0, description="noise of a draw wire")
    target_mm: NotNegative = Field(default=1.0, description="sigma of surveyed targets")
    root_mrad: NotNegative = Field(default=0.02, description="noise of the root's channel")
    load_percent: NotNegative = Field(default=0.08, description="noise of the load channel")
    rate_hz: Positive = Field(default=10.0, description="of load and wires")
    prediction_percent: NotNegative = Field(default=1.0, description="sigma of the prediction")


class Scene(Model):
    """Everything that a simulated test is made of."""

    id: Name = "simulated"
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    start: datetime = datetime(2024, 6, 10, 6, 13, 20, tzinfo=UTC)
    blade: Blade = Blade()
    loading: Loading = Loading()
    saddles: tuple[Saddle, ...] = ()
    show_saddles: Flag = True
    cable_mm: NotNegative = Field(default=24.0, description="diameter of the cables; 0 = none")
    sways: tuple[Sway, ...] = ()
    fatigue: Fatigue | None = None
    ground: Ground = Ground()
    wall: Wall | None = None
    boxes: tuple[Box, ...] = ()
    targets: tuple[Target, ...] = ()
    lidars: tuple[Lidar, ...] = Field(min_length=1)
    sensors: Sensors = Sensors()
    network: Network = Network()
    sections_m: tuple[Positive, ...] = Field(default=(84.0, 100.0, 110.0), min_length=1)
    survey: Survey = Survey()

    @model_validator(mode="after")
    def _distinct(self) -> Scene:
        if self.fatigue is not None and len(self.loading.levels_percent) > 1:
            raise ValueError("a fatigue test has one load level, held before it starts")
        for name in ("id", "address"):
            values = [getattr(lidar, name) for lidar in self.lidars]
            if len(set(values)) < len(values):
                raise ValueError(f"two lidars of one {name}")
        return self

    @classmethod
    def from_document(cls, document: dict[str, Any], origin: str = "scene") -> Scene:
        """Check a parsed TOML document.

        Raises
        ------
        ConfigError
            With the key, what was found and the nearest known key.
        """
        try:
            return cls.model_validate(document)
        except ValidationError as error:
            raise _told(error, document, origin) from None

    @classmethod
    def load(cls, path: str | Path) -> Scene:
        """Read a scene file; see `from_document` for what it refuses."""
        try:
            document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise ConfigNotFoundError(f"no scene {path}") from None
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise ConfigError(f"{path} is not a scene: {error}", code="config.syntax") from None
        return cls.from_document(document, str(path))

    def dump(self) -> str:
        """Write the resolved scene as TOML."""
        return tomlkit.dumps(_plain(self.model_dump(exclude_none=True)))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        # Tables come after plain keys, or they would swallow them.
        simple = {k: _plain(v) for k, v in value.items() if not _is_table(v)}
        return simple | {k: _plain(v) for k, v in value.items() if _is_table(v)}
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, tuple | list) and bool(value) and isinstance(value[0], dict)
    )


def _told(error: ValidationError, document: dict[str, Any], origin: str) -> ConfigError:
    issues = sorted(error.errors(include_url=False), key=lambda i: i["type"] != "extra_forbidden")
    issue = issues[0]
    place, found = place_of(Scene, list(issue["loc"]), document)
    unknown = issue["type"] == "extra_forbidden"
    return ConfigError(
        f"unknown key {place}" if unknown else f"{place}: {issue['msg']}",
        code="config.unknown_key" if unknown else "config.value",
        facts=[("file", origin), ("key", place), ("found", repr(found)[:80])],
        hint=nearest_key(Scene, issue["loc"]) if unknown else None,
    )


def _lidars(x_m: float, ground: Ground, first_z_m: float, step_m: float) -> list[dict[str, Any]]:
    places = [first_z_m + step_m * i for i in range(4)]
    return [
        {
            "id": f"L{i + 1}",
            "address": f"192.168.1.{201 + i}",
            "position_m": (
                x_m,
                round(ground.height_m + ground.slope_x * x_m + ground.slope_z * z + 1.2, 3),
                z,
            ),
        }
        for i, z in enumerate(places)
    ]


def _saddles(total_kn: float, lever_m: tuple[float, float]) -> list[dict[str, Any]]:
    places = {33.0: 0.30, 57.2: 0.30, 75.0: 0.25, 95.0: 0.15}
    return [
        {"s_m": s, "force_kn": round(total_kn * share, 3), "lever_m": lever_m}
        for s, share in places.items()
    ]


def demo(seed: int = 1) -> Scene:
    """Return a minimum edgewise test of a 110 m blade, seen by four VLP-16 for 24 s.

    The tip moves by about 7 m at 100 %.
    """
    ground = Ground()
    lidars = _lidars(3.0, ground, 85.2, 8.1)
    # One sensor without a time server: on since three minutes ago, its clock gaining.
    lidars[2]["clock"] = {"offset_ms": -1_219_432.1, "drift_ppm": 14.0}
    return Scene.from_document(
        {
            "id": "demo-edge",
            "seed": seed,
            "saddles": _saddles(1000.0, (0.02, 0.01)),
            "sways": _sways(8.0, 6.0),
            "wall": {},
            "boxes": _boxes(),
            "lidars": lidars,
        }
    )


def flapwise(seed: int = 1) -> Scene:
    """Return a maximum flapwise test: the blade passes over four VLP-16 by about 30 m."""
    ground = Ground(height_m=-7.0)
    return Scene.from_document(
        {
            "id": "demo-flap",
            "seed": seed,
            "blade": {"leading_edge": "+y", "suction_side": "+x"},
            "loading": {"levels_percent": (0.0, 100.0), "hold_s": 4.0, "ramp_s": 12.0},
            "saddles": _saddles(2500.0, (0.02, 0.01)),
            "sways": _sways(12.0, 5.0),
            "ground": ground.model_dump(),
            "wall": {},
            "boxes": _boxes(),
            "lidars": _lidars(12.0, ground, 81.0, 8.0),
        }
    )


def _sways(along_mm: float, up_mm: float) -> list[dict[str, Any]]:
    return [
        {"direction": "+x", "frequency_hz": 0.58, "amplitude_mm": along_mm, "phase_deg": 20.0},
        {"direction": "+y", "frequency_hz": 0.41, "amplitude_mm": up_mm, "phase_deg": 130.0},
        {"direction": "+x", "order": 2, "frequency_hz": 1.7, "amplitude_mm": 1.5},
    ]


def _boxes() -> list[dict[str, Any]]:
    return [
        {"middle_m": (-12.0, -7.4, 96.0), "size_m": (2.4, 1.6, 1.2)},
        {"middle_m": (17.0, -7.0, 88.0), "size_m": (1.2, 1.2, 3.0)},
        {"middle_m": (10.0, -7.9, 112.0), "size_m": (0.8, 1.0, 0.8)},
    ]
