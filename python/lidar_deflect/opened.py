"""A configuration brought together with captures: which lidars are there, when what happened."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from lidar_deflect import capture as captures
from lidar_deflect import holds as hold_finder
from lidar_deflect import instruments
from lidar_deflect.errors import CaptureError, InvalidValueError
from lidar_deflect.measurement import Inputs, unloaded
from lidar_deflect.measurement.inputs import stage_listener

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from lidar_deflect.calibration import Calibration
    from lidar_deflect.capture import Capture
    from lidar_deflect.channels import Channel
    from lidar_deflect.config import Config
    from lidar_deflect.holds import Hold
    from lidar_deflect.measurement.inputs import Progress
    from lidar_deflect.measurement.unloaded import HoldCloud


@dataclass(frozen=True)
class OpenedTest:
    """A configuration brought together with captures.

    Attributes
    ----------
    lidars, absent
        Ids of the configured lidars that are in the captures, and of those that are not.
    load
        Load channel in percent, or None.
    holds
        Its holds, or None.
    shifts
        Seconds by which the clocks of other instruments were moved, by file.
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
    shifts: Mapping[Path, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        config: Config,
        paths: Sequence[str | Path],
        *,
        progress: Progress | None,
        threads: int | None,
    ) -> OpenedTest:
        """Open captures, see which lidars are in them, and read the load channel."""
        files = tuple(Path(path) for path in paths)
        capture = captures.open(files, config=config)
        return cls.of_capture(config, capture, progress=progress, threads=threads)

    @classmethod
    def of_capture(
        cls,
        config: Config,
        capture: Capture,
        *,
        progress: Progress | None,
        threads: int | None,
    ) -> OpenedTest:
        """See which lidars are in a capture that was opened, and read the load channel."""
        capture.scan(stage_listener(progress, "scan"))
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
        load = instruments.load(config, capture.first_time_ns)
        steps = None if config.test.kind == "fatigue" else load  # a swing has no load steps
        return cls(
            config,
            capture.paths,
            capture,
            capture.lidars,
            capture.missing,
            load,
            None if steps is None else hold_finder.from_load(steps.time_ns, steps.value),
            progress,
            threads,
        )

    def with_shifts(self, shifts: Mapping[Path, float]) -> OpenedTest:
        """Return the same with the clocks of other instruments moved, seconds by file."""
        load = instruments.load(self.config, self.capture.first_time_ns, shifts)
        holds = None if load is None else hold_finder.from_load(load.time_ns, load.value)
        return replace(self, load=load, holds=holds, shifts=shifts)

    @cached_property
    def wires(self) -> tuple[Channel, ...]:
        """The real draw wires by their clocks as known, read once."""
        return instruments.wires(self.config, self.capture.first_time_ns, self.shifts)

    @cached_property
    def root(self) -> tuple[Channel, ...]:
        """The measured rotations of the root, likewise."""
        return instruments.root(self.config, self.capture.first_time_ns, self.shifts)

    @cached_property
    def others(self) -> tuple[Channel, ...]:
        """The other instruments, likewise."""
        return instruments.others(self.config, self.capture.first_time_ns, self.shifts)

    def limits_ns(self, start_s: float | None, stop_s: float | None) -> tuple[int, int]:
        """Return limits in seconds since the first lidar packet as instants."""
        first, last = self.capture.first_time_ns, self.capture.last_time_ns
        given_start, given_stop = map(self.capture.instant_ns, (start_s, stop_s))
        start = first if given_start is None else given_start
        stop = last if given_stop is None else min(last, given_stop)
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

    def hold(
        self,
        window_ns: tuple[int, int],
        lidars: Sequence[str] | None = None,
        *,
        with_intensity: bool = True,
    ) -> Mapping[str, HoldCloud]:
        """Gather what every lidar sees in a hold, or some of them."""
        return unloaded.collect_all(
            self.capture,
            self.lidars if lidars is None else lidars,
            window_ns,
            self.threads,
            with_intensity=with_intensity,
        )

    def unloaded_or_kept_ns(self, known: Calibration | None) -> tuple[int, int] | None:
        """Return the unloaded hold of these captures, None where the calibration's state serves."""
        kept = known is not None and "paper" in known.reference
        return None if kept and not self._has_unloaded_hold() else self.unloaded_ns(None, None)

    @property
    def reference_is_here(self) -> bool:
        """Whether the unloaded hold is to be looked for in these captures."""
        return self.config.reference.capture in (None, *self.paths)

    def _has_unloaded_hold(self) -> bool:
        given = self.config.reference
        if not self.reference_is_here:
            return False
        if given.from_s is not None or given.to_s is not None:
            return True
        span = (self.capture.first_time_ns, self.capture.last_time_ns)
        return unloaded.unloaded_hold(self.holds or (), span) is not None

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
            load=self.load,
            progress=self.progress,
            threads=self.threads,
        )
