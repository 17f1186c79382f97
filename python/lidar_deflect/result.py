"""A measurement's tables with their provenance, and the folder that keeps them."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lidar_deflect import config as configs
from lidar_deflect import tables
from lidar_deflect.calibration import Calibration
from lidar_deflect.files import whole_folder
from lidar_deflect.folder import Folder
from lidar_deflect.notebook import card

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

    from lidar_deflect.config import Config
    from lidar_deflect.plots import Plots


@dataclass(frozen=True, repr=False)
class Result:
    """What a measurement gave.

    Attributes
    ----------
    frames
        The tables by name, as docs/tables.md declares them.
    run
        Document of run.json: versions, inputs, decisions, timings, drops, gates.
    config, calibration
        What it was measured with.
    """

    frames: Mapping[str, pl.DataFrame]
    run: Mapping[str, Any]
    config: Config
    calibration: Calibration
    folder: Path | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        sections = self.deflection["section"].n_unique()
        return (
            f"Result({self.config.test.id}: {sections} sections, {self.steps.height} step rows, "
            f"{self.deflection.height} states, method {self.run['method']})"
        )

    def _repr_html_(self) -> str:
        """Return the sections at the largest load step, and what to know of them."""
        from lidar_deflect.comparison import largest_step

        step = largest_step(self.steps)
        head = ("section", "s (m)", "dx (m)", "dy (m)", "dz (m)", "total (m)", "U (m)", "status")
        rows = [
            (
                row["section"],
                row["s_m"],
                *(row[name] for name in ("dx_m", "dy_m", "dz_m", "d_m")),
                None if row["ud_m"] is None else 2.0 * row["ud_m"],
                row["status"],
            )
            for row in self.steps.iter_rows(named=True)
            if row["step"] == step
        ]
        title = f"{self!r}, at {step}" if step else repr(self)
        known = len(self.run["warnings"]) + len(self.failed_gates)
        note = f"{known} warnings; U is the expanded uncertainty (k = 2)"
        return card(title, head if rows else (), rows, note)

    @property
    def deflection(self) -> pl.DataFrame:
        """One row per time and section."""
        return self.frames["deflection"]

    @property
    def steps(self) -> pl.DataFrame:
        """One row per load step and section."""
        return self.frames["steps"]

    @property
    def contour(self) -> pl.DataFrame:
        """Blade line over time."""
        return self.frames["contour"]

    @property
    def points(self) -> pl.DataFrame:
        """Some of the blade's points."""
        return self.frames["points"]

    @property
    def rejected(self) -> pl.DataFrame:
        """Objects that did not count."""
        return self.frames["rejected"]

    @property
    def outline(self) -> pl.DataFrame:
        """Outlines of the sections in every hold; without rows under a method that has none."""
        return self.frames["outline"] if "outline" in self.frames else tables.empty("outline")

    @property
    def cycles(self) -> pl.DataFrame:
        """One row per section and cycle of a fatigue test; without rows of a static one."""
        return self.frames["cycles"] if "cycles" in self.frames else tables.empty("cycles")

    @property
    def health(self) -> pl.DataFrame:
        """Packets and points per second and lidar."""
        return self.frames["health"]

    @property
    def channels(self) -> pl.DataFrame:
        """Every read channel."""
        return self.frames["channels"]

    @property
    def failed_gates(self) -> tuple[str, ...]:
        """Quality gates that this run did not pass, as sentences."""
        return tuple(self.run["gates"]["failed"])

    @property
    def plot(self) -> Plots:
        """Figures of this result."""
        from lidar_deflect.plots import Plots  # plotly only for those who plot

        return Plots(self)

    def save(self, folder: str | Path, *, overwrite: bool = False) -> Path:
        """Write the result folder: complete, or not at all.

        Raises
        ------
        OutputError
            If it exists and may not be overwritten, or cannot be written.
        """
        folder = Path(folder)
        with whole_folder(folder, overwrite=overwrite) as part:
            metadata = {tables.HASH_KEY: configs.config_hash(self.config)}
            for name, frame in self.frames.items():
                tables.write(frame, part / f"{name}.parquet", metadata)
            (part / "test.toml").write_text(configs.dump(self.config), encoding="utf-8")
            self.calibration.save(part / "calibration.toml")
            document = json.dumps(self.run, indent=2, ensure_ascii=False)
            (part / "run.json").write_text(document + "\n", encoding="utf-8")
        return folder

    @classmethod
    def load(cls, folder: str | Path) -> Result:
        """Read a result folder.

        Raises
        ------
        ResultNotFoundError
            If it is not one.
        ConfigError, CalibrationError
            If its configuration or calibration cannot be read.
        """
        folder = Folder(folder).path
        frames = {path.stem: tables.read(path) for path in sorted(folder.glob("*.parquet"))}
        return cls(
            frames,
            json.loads((folder / "run.json").read_text(encoding="utf-8")),
            configs.load(folder / "test.toml", check_files=False),
            Calibration.load(folder / "calibration.toml"),
            folder,
        )
