"""A test from captures to tables: what the command line and notebooks call.

The order of a measurement, one line per step, stands in `Test.measure`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import capture as captures
from lidar_deflect import channels, instruments, provenance, steps, tables
from lidar_deflect import config as configs
from lidar_deflect import holds as hold_finder
from lidar_deflect.calibrate import calibrate
from lidar_deflect.calibration import Calibration, with_reference
from lidar_deflect.checks import check
from lidar_deflect.errors import CaptureError, ConfigError, InvalidValueError
from lidar_deflect.measurement import METHODS, Inputs, paper, tabulate, unloaded
from lidar_deflect.measurement.health import health_table
from lidar_deflect.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import polars as pl

    from lidar_deflect.capture import Capture
    from lidar_deflect.channels import Channel
    from lidar_deflect.checks import Finding
    from lidar_deflect.config import Config
    from lidar_deflect.holds import Hold
    from lidar_deflect.measurement import States
    from lidar_deflect.measurement.unloaded import HoldCloud

    Progress = Callable[[str, int, int], None]

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
        setup = Setup.of(self.config, paths, progress=progress, threads=threads)
        window = setup.unloaded_ns(start_s, stop_s)
        clouds = unloaded.collect_all(setup.capture, setup.lidars, window)
        calibration = calibrate(self.config, clouds)
        if not self.config.sections:
            return calibration
        inputs = setup.inputs(calibration, clouds, window, limits=window)
        return with_reference(calibration, "paper", paper.calibrated_reference(inputs))

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
        setup = Setup.of(self.config, paths, progress=progress, threads=threads)
        watch.lap("scan")
        known = _given_calibration(calibration)
        window = setup.unloaded_or_kept_ns(known)
        clouds = unloaded.collect_all(setup.capture, setup.lidars, window) if window else {}
        known = known or calibrate(self.config, clouds)
        watch.lap("calibrate")
        inputs = setup.inputs(
            known, clouds, window, limits=setup.limits_ns(start_s, stop_s), rate_hz=rate_hz
        )
        name = method or self.config.measure.method
        states = _method(name)(inputs)
        watch.lap("measure")
        return result_of(setup, inputs, states, name, watch)


@dataclass(frozen=True)
class Setup:
    """A configuration brought together with captures.

    Attributes
    ----------
    lidars, absent
        Ids of the configured lidars that are in the captures, and of those that are not.
    load
        Load channel in percent, or None.
    holds
        Its holds, or None.
    """

    config: Config
    paths: tuple[Path, ...]
    capture: Capture
    lidars: tuple[str, ...]
    absent: tuple[str, ...]
    load: Channel | None
    holds: tuple[Hold, ...] | None
    progress: Progress | None
    threads: int | None

    @classmethod
    def of(
        cls,
        config: Config,
        paths: Sequence[str | Path],
        *,
        progress: Progress | None,
        threads: int | None,
    ) -> Setup:
        """Open captures, see which lidars are in them, and read the load channel."""
        files = tuple(Path(path) for path in paths)
        capture = captures.open(files, config=config)
        capture.scan(_stage(progress, "scan"))
        if not capture.lidars:
            raise CaptureError(
                "none of the configured lidars is in the capture",
                code="capture.no_configured_lidar",
                facts=[
                    ("configured", ", ".join(f"{x.id} = {x.source}" for x in config.lidars)),
                    ("captured", ", ".join(stream.address for stream in capture.streams)),
                ],
                hint="correct source of [[lidars]]",
            )
        load = instruments.load(config)
        return cls(
            config,
            files,
            capture,
            capture.lidars,
            capture.missing,
            load,
            None if load is None else hold_finder.from_load(load.time_ns, load.value),
            progress,
            threads,
        )

    def limits_ns(self, start_s: float | None, stop_s: float | None) -> tuple[int, int]:
        """Return limits in seconds since the first lidar packet as instants."""
        first, last = self.capture.first_time_ns, self.capture.last_time_ns
        start = first if start_s is None else first + round(start_s * 1e9)
        stop = last if stop_s is None else min(last, first + round(stop_s * 1e9))
        if not first <= start < stop:
            raise InvalidValueError(
                f"from {start_s} s to {stop_s} s holds nothing of the capture",
                facts=[("capture", f"0 s to {(last - first) * 1e-9:.3f} s")],
                hint="choose a stretch within it",
            )
        return start, stop

    def unloaded_ns(self, start_s: float | None, stop_s: float | None) -> tuple[int, int]:
        """Return the unloaded hold: given, else configured or found."""
        if start_s is not None or stop_s is not None:
            return self.limits_ns(start_s, stop_s)
        return unloaded.window_ns(self.config, self.capture, self.holds)

    def unloaded_or_kept_ns(self, known: Calibration | None) -> tuple[int, int] | None:
        """Return the unloaded hold of these captures, None where the calibration's state serves."""
        kept = known is not None and "paper" in known.reference
        given = self.config.reference
        if kept and given.from_s is None and given.to_s is None:
            span = (self.capture.first_time_ns, self.capture.last_time_ns)
            if self.holds is None or unloaded.unloaded_hold(self.holds, span) is None:
                return None
        return self.unloaded_ns(None, None)

    def inputs(
        self,
        calibration: Calibration,
        clouds: Mapping[str, HoldCloud],
        unloaded_ns: tuple[int, int] | None,
        *,
        limits: tuple[int, int],
        rate_hz: float | None = None,
    ) -> Inputs:
        """Return what every method starts from."""
        return Inputs(
            config=self.config,
            capture=self.capture,
            calibration=calibration,
            lidars=self.lidars,
            clouds=clouds,
            unloaded_ns=unloaded_ns,
            start_ns=limits[0],
            stop_ns=limits[1],
            rate_hz=rate_hz or self.config.measure.rate_hz,
            progress=self.progress,
            threads=self.threads,
        )


def result_of(
    setup: Setup, inputs: Inputs, states: States, method: str, watch: provenance.Stopwatch
) -> Result:
    """Tables and provenance of what a method found."""
    first_ns = setup.capture.first_time_ns
    holds = setup.holds
    if holds is None:
        holds = hold_finder.from_deflection(states.time_ns, states.farthest_m)
    root = instruments.root(setup.config)
    deflection = tabulate.deflection(states, holds, load=setup.load, root=root, first_ns=first_ns)
    health = health_table(setup.capture, inputs.lidars, states)
    given = [*([setup.load] if setup.load else []), *instruments.wires(setup.config), *root]
    frames = {
        "deflection": deflection,
        "steps": steps.average(deflection, holds),
        **{name: _timed(name, getattr(states, name), first_ns) for name in DETAILS},
        "health": health,
        "channels": channels.to_table(given, first_ns),
    }
    watch.lap("tables")
    run = provenance.run_document(setup, inputs, states, method, health, watch)
    return Result(frames, run, setup.config, inputs.calibration)


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


def _given_calibration(given: Calibration | str | Path | None) -> Calibration | None:
    return Calibration.load(given) if isinstance(given, str | Path) else given


def _stage(progress: Progress | None, name: str) -> Callable[[int, int], None] | None:
    if progress is None:
        return None
    return lambda done, total: progress(name, done, total)
