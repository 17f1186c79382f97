"""The whole configuration, and what its tables must agree on."""

from collections.abc import Iterator
from typing import Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from lidar_deflect.config.base import Model, problem, split_source
from lidar_deflect.config.blade import Blade, Section, TestInfo
from lidar_deflect.config.channels import Load, OtherChannel, Prediction, Reference, Root, Wire
from lidar_deflect.config.lidars import Lidar
from lidar_deflect.config.measure import Gates, Measure, Paper
from lidar_deflect.config.survey import Calibrate, ControlPoint, Distance, Target


class Config(Model):
    """Everything a run is told. Attributes are named like the tables of the TOML file."""

    test: TestInfo = Field(default=TestInfo(), description="what is tested and by whom")
    blade: Blade = Field(description="the blade")
    lidars: tuple[Lidar, ...] = Field(min_length=1, description="the lidars")
    control: tuple[ControlPoint, ...] = Field(default=(), description="surveyed points on surfaces")
    targets: tuple[Target, ...] = Field(default=(), description="surveyed targets")
    distance: tuple[Distance, ...] = Field(default=(), description="taped distances between lidars")
    calibrate: Calibrate = Field(default=Calibrate(), description="priors for the calibration")
    sections: tuple[Section, ...] = Field(default=(), description="the wanted sections")
    wires: tuple[Wire, ...] = Field(default=(), description="draw wires, real and virtual")
    channels: tuple[OtherChannel, ...] = Field(
        default=(), description="any other instruments, shown beside the deflection"
    )
    root: Root | None = Field(default=None, description="measured rotation of the root")
    reference: Reference = Field(default=Reference(), description="the unloaded hold")
    load: Load = Field(default=Load(), description="load channel, direction and saddles")
    prediction: Prediction | None = Field(default=None, description="a prediction to hold against")
    measure: Measure = Field(default=Measure(), description="method and rate")
    paper: Paper = Field(default=Paper(), description="parameters of the paper's method")
    gates: Gates = Field(default=Gates(), description="quality gates")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for contradiction in _contradictions(self):
            raise contradiction
        return self

    def lidar(self, name: str) -> Lidar:
        """Return the lidar of that id; a KeyError where there is none."""
        return {lidar.id: lidar for lidar in self.lidars}[name]

    def section(self, name: str) -> Section:
        """Return the section of that name; a KeyError where there is none."""
        return {section.name: section for section in self.sections}[name]


def _contradictions(config: Config) -> Iterator[PydanticCustomError]:
    yield from _doubles("lidars", "id", [lidar.id for lidar in config.lidars])
    yield from _doubles("sections", "name", [section.name for section in config.sections])
    yield from _doubles("targets", "name", [target.name for target in config.targets])
    yield from _doubles("wires", "name", [wire.name for wire in config.wires])
    yield from _doubles("channels", "name", [channel.name for channel in config.channels])
    yield from _sources(config)
    yield from _lengths(config)
    yield from _references(config)


def _doubles(table: str, key: str, names: list[str]) -> Iterator[PydanticCustomError]:
    for index, name in enumerate(names):
        if name in names[:index]:
            yield problem(
                f"{table}.{index}.{key}",
                f"{name!r} is used twice",
                expected=f"one {key} for each of [[{table}]]",
            )


def _sources(config: Config) -> Iterator[PydanticCustomError]:
    """Several lidars are told apart by their source, so each needs one that no other covers."""
    seen: list[tuple[str, str, int | None]] = []
    for index, lidar in enumerate(config.lidars if len(config.lidars) > 1 else ()):
        key = f"lidars.{index}.source"
        if lidar.source is None:
            yield problem(
                key,
                f"lidar {lidar.id!r} has no source",
                expected="the address its packets come from, since there are several lidars",
                hint="lidar-deflect info CAPTURE lists the addresses",
            )
            continue
        address, port = split_source(lidar.source)
        for other, known, known_port in seen:
            if address == known and (port == known_port or None in (port, known_port)):
                yield problem(
                    key,
                    f"lidars {other!r} and {lidar.id!r} have the same source {lidar.source}",
                    expected="one source per lidar",
                    hint="where two sensors share an address, add the port: address:port",
                )
        seen.append((lidar.id, address, port))


def _lengths(config: Config) -> Iterator[PydanticCustomError]:
    length_m = config.blade.length_m
    places = [(f"sections.{i}.s_m", section.s_m) for i, section in enumerate(config.sections)]
    places += [(f"load.saddles_s_m.{i}", s_m) for i, s_m in enumerate(config.load.saddles_s_m)]
    for key, s_m in places:
        if s_m > length_m:
            yield problem(
                key,
                f"{s_m:g} m lies beyond the blade, which ends at {length_m:g} m",
                expected=f"an arc length from 0 to blade.length_m = {length_m:g}",
                hint="the tip is at s_m = blade.length_m",
            )


def _references(config: Config) -> Iterator[PydanticCustomError]:
    sections = [section.name for section in config.sections]
    ids = [lidar.id for lidar in config.lidars]
    for index, wire in enumerate(config.wires):
        if wire.section not in sections:
            yield problem(
                f"wires.{index}.section",
                f"there is no section {wire.section!r}",
                expected="one of " + (", ".join(sections) or "[[sections]], which is empty"),
            )
    for index, distance in enumerate(config.distance):
        unknown = [end for end in distance.between if end not in ids]
        if unknown or distance.between[0] == distance.between[1]:
            yield problem(
                f"distance.{index}.between",
                f"there is no lidar {unknown[0]!r}" if unknown else "both ends are one lidar",
                expected="two different ids of " + ", ".join(ids),
            )
