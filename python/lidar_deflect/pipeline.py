"""A test from captures to tables: what the command line and notebooks call.

The order of a measurement, one line per step, stands in `Test.measure`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import capture as captures
from lidar_deflect import (
    channels,
    comparison,
    cycles,
    drift,
    instruments,
    matching,
    provenance,
    steps,
    tables,
)
from lidar_deflect import config as configs
from lidar_deflect import holds as hold_finder
from lidar_deflect import wires as wire_lines
from lidar_deflect.calibrate import calibrate
from lidar_deflect.calibration import Calibration
from lidar_deflect.checks import check
from lidar_deflect.errors import ConfigError
from lidar_deflect.measurement import METHODS, tabulate
from lidar_deflect.measurement.contours import frame_plan
from lidar_deflect.measurement.health import health_table
from lidar_deflect.opened import OpenedTest
from lidar_deflect.rest import Rest, with_unloaded_state
from lidar_deflect.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import polars as pl

    from lidar_deflect.checks import Finding
    from lidar_deflect.config import Config
    from lidar_deflect.drift import Drift
    from lidar_deflect.holds import Hold
    from lidar_deflect.matching import Match
    from lidar_deflect.measurement import Inputs, States
    from lidar_deflect.measurement.inputs import Progress

DETAILS = ("contour", "points", "rejected")
"""Tables whose columns a method gives itself."""


@dataclass(frozen=True, repr=False)
class Test:
    """A blade test as its configuration describes it."""

    __test__ = False  # no test case of pytest, whatever its name begins with

    config: Config
    path: Path | None = None

    def __repr__(self) -> str:
        blade, lidars = self.config.blade, len(self.config.lidars)
        return f"Test({self.config.test.id}: blade {blade.length_m:g} m, {lidars} lidars)"

    @classmethod
    def load(cls, path: str | Path, overrides: Sequence[str] = ()) -> Test:
        """Read a configuration.

        Parameters
        ----------
        path
            TOML file.
        overrides
            ``key=value`` pairs as of ``--set``.

        Raises
        ------
        ConfigError
            Naming file, key, what was found and what was expected.
        """
        return cls(configs.load(Path(path), overrides), Path(path))

    def check(self, paths: Sequence[str | Path]) -> tuple[Finding, ...]:
        """Hold the configuration against captures; measure nothing."""
        return check(self.config, captures.open([*paths], config=self.config))

    def calibrate(
        self,
        *paths: str | Path,
        start_s: float | None = None,
        stop_s: float | None = None,
        progress: Progress | None = None,
        threads: int | None = None,
    ) -> Calibration:
        """Find the pose of every lidar, and the unloaded blade, from an unloaded hold.

        Parameters
        ----------
        paths
            Captures.
        start_s, stop_s
            The hold, seconds since the first lidar packet; default: `[reference]`, the load
            channel, or the first seconds.

        Raises
        ------
        CalibrationError
            If ground or wall of a lidar cannot be found.
        """
        opened = OpenedTest.of(self.config, paths, progress=progress, threads=threads)
        window = opened.unloaded_ns(start_s, stop_s)
        clouds = opened.hold(window)
        calibration = calibrate(self.config, clouds)
        if not self.config.sections:
            return calibration
        return with_unloaded_state(opened, calibration, clouds, window)

    def measure(
        self,
        *paths: str | Path,
        calibration: Calibration | str | Path | None = None,
        method: str | None = None,
        rate_hz: float | None = None,
        start_s: float | None = None,
        stop_s: float | None = None,
        progress: Progress | None = None,
        threads: int | None = None,
    ) -> Result:
        """Measure the deflection of every section.

        Parameters
        ----------
        paths
            Captures.
        calibration
            Poses and unloaded state; default: found in the reference hold of these captures.
        method, rate_hz
            Instead of those of `[measure]`.
        start_s, stop_s
            Limits, seconds since the first lidar packet.

        Raises
        ------
        MeasurementError
            If the data do not allow it.
        """
        if not self.config.sections:
            raise ConfigError(
                "no section to measure",
                code="config.no_sections",
                hint="add [[sections]] with name and s_m",
            )
        watch = provenance.Stopwatch()
        capture = captures.open([*paths], config=self.config)
        name = method or self.config.measure.method
        with provenance.FileFacts(capture.paths) as files:
            opened = OpenedTest.of_capture(self.config, capture, progress=progress, threads=threads)
            limits = opened.limits_ns(start_s, stop_s)
            watch.lap("scan")
            inputs, states, drifted = self._states(
                opened, calibration, name, limits, rate_hz, watch
            )
            matches = matching.match(opened, inputs, states)
            shifts = matching.shifts_of(matches)
            watch.lap("clocks")
            if shifts:  # the load says where the unloaded hold is: look again by the right clock
                opened = opened.with_shifts(shifts)
                if self.config.load.file in shifts:
                    inputs, states, drifted = self._states(
                        opened, calibration, name, limits, rate_hz, watch
                    )
            return result_of(opened, inputs, states, drifted, name, watch, files, matches)

    def _states(
        self,
        opened: OpenedTest,
        calibration: Calibration | str | Path | None,
        name: str,
        limits: tuple[int, int],
        rate_hz: float | None,
        watch: provenance.Stopwatch,
    ) -> tuple[Inputs, States, Drift]:
        """Calibrate where that is still to be done, watch the tripods, measure by one method."""
        known = self._known(calibration, opened, opened.progress, opened.threads)
        rest = Rest.of(opened, known, name, limits, rate_hz)
        watch.lap("calibrate")
        inputs = rest.inputs
        frames = frame_plan(inputs, inputs.plan) if name == "paper" and inputs.plan else None
        drifted = drift.watch(inputs, rest.cells, frames)
        inputs = replace(inputs, moves=drifted.moves, survey=drifted.survey)
        watch.lap("drift")
        states = drift.marked(_method(name)(inputs), drifted)
        watch.lap("measure")
        return inputs, states, drifted

    def _known(
        self,
        calibration: Calibration | str | Path | None,
        opened: OpenedTest,
        progress: Progress | None,
        threads: int | None,
    ) -> Calibration | None:
        """Return the given calibration, else that of the configured other capture, else None."""
        if isinstance(calibration, Calibration):
            return calibration
        if calibration is not None:
            return Calibration.load(calibration)
        if opened.reference_is_here:
            return None
        assert self.config.reference.capture is not None
        return self.calibrate(self.config.reference.capture, progress=progress, threads=threads)


def result_of(
    opened: OpenedTest,
    inputs: Inputs,
    states: States,
    drifted: Drift,
    method: str,
    watch: provenance.Stopwatch,
    files: provenance.FileFacts,
    matches: Sequence[Match] = (),
) -> Result:
    """Tables and provenance of what a method found."""
    first_ns = opened.capture.first_time_ns
    holds = _measured_holds(opened, inputs, states)
    wires, root = opened.wires, opened.root
    deflection = tabulate.deflection(states, holds, load=opened.load, root=root, first_ns=first_ns)
    health = health_table(opened.capture, inputs.lidars, states)
    settings = opened.config.model_dump()
    given = [*([opened.load] if opened.load else []), *wires, *root, *opened.others]
    given += wire_lines.predicted(deflection, settings)
    averages = steps.average(deflection, holds)
    frames = {
        "deflection": deflection,
        "steps": averages,
        **{name: _timed(name, getattr(states, name), first_ns) for name in DETAILS},
        "health": health,
        "poses": drifted.table,
        "channels": channels.to_table(given, first_ns),
    }
    if states.outline:
        frames["outline"] = _timed("outline", states.outline, first_ns)
    compared = comparison.configured(
        averages, settings, wires, instruments.prediction(opened.config)
    )
    if compared.height:
        frames["comparison"] = compared
    found = cycles.find(deflection) if opened.config.test.kind == "fatigue" else None
    if found is not None:
        frames["cycles"] = found.table
    watch.lap("tables")
    run = provenance.run_document(
        opened, inputs, states, method, health, watch, files, matches, drifted, found
    )
    return Result(frames, run, opened.config, inputs.calibration)


def _measured_holds(opened: OpenedTest, inputs: Inputs, states: States) -> Sequence[Hold]:
    """Return the measured holds of the load channel, else those of the deflection itself.

    Of a fatigue test that is the unloaded hold alone: crests are no holds.
    """
    if opened.config.test.kind == "fatigue":
        rest = inputs.unloaded_ns
        return () if rest is None else (hold_finder.Hold(*rest, "0 %", None),)
    if opened.holds is None:
        return hold_finder.from_deflection(states.time_ns, states.farthest_m)
    return [hold for hold in opened.holds if hold.contains(states.time_ns).any()]


def _timed(name: str, columns: Mapping[str, Any], first_ns: int) -> pl.DataFrame:
    """Build a table of which a method gives all columns but `t_s`; what it leaves out is null."""
    t_s = (np.asarray(columns["time"], dtype=np.int64) - first_ns) * 1e-9
    open_columns: dict[str, Any] = dict.fromkeys(tables.SCHEMAS[name].names)
    return tables.build(name, open_columns | dict(columns) | {"t_s": t_s})


def _method(name: str) -> Callable[[Inputs], States]:
    if name not in METHODS:
        raise ConfigError(
            f"method {name!r} is not there yet",
            code="config.method",
            facts=[("methods", ", ".join(METHODS))],
            hint='set method = "paper" under [measure]',
        )
    return METHODS[name]
