"""The figures of the report, as data that cannot close the script they stand in."""

from dataclasses import dataclass

import plotly.graph_objects as go
from markupsafe import Markup

from lidar_deflect.folder import Folder
from lidar_deflect.plots import Plots
from lidar_deflect.plots.source import sections
from lidar_deflect.report import words


@dataclass(frozen=True)
class Figure:
    """One numbered figure."""

    number: int
    caption: str
    json: Markup
    height: int


class Figures:
    """Draws and numbers the figures of one report."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        self._plots = Plots(folder)
        self._count = 0

    def _numbered(self, figure: go.Figure, caption: str) -> Figure:
        self._count += 1
        data = figure.to_json()  # plotly writes <, > and / as \u escapes
        if "<" in data:
            raise AssertionError("a figure could close its script")
        return Figure(self._count, caption, Markup(data), int(figure.layout.height or 450))

    def curves(self) -> list[Figure]:
        """Time series of every section, the outermost first."""
        return [
            self._numbered(
                self._plots.time_series(name),
                words.CAPTIONS["time_series"].format(section=name, s_m=s_m)
                + (" " + words.LIKE_THE_PAPER.format(figures="figures 19 and 21") if not k else ""),
            )
            for k, (name, s_m) in enumerate(reversed(sections(self._folder.deflection)))
        ]

    def comparison(self) -> Figure | None:
        """Errors by method; None where nothing was compared."""
        if self._folder.comparison.is_empty():
            return None
        caption = (
            f"{words.CAPTIONS['comparison']} {words.LIKE_THE_PAPER.format(figures='figure 20')}"
        )
        return self._numbered(self._plots.comparison(), caption)

    def shapes(self) -> list[Figure]:
        """Load against deflection, lines of the blade, plan; those that have something to show."""
        folder = self._folder
        loaded = folder.deflection["load"].null_count() < folder.deflection.height
        wanted = [("load_deflection", self._plots.load_deflection)] if loaded else []
        if folder.steps["x_m"].null_count() < folder.steps.height:
            wanted.append(("deflected_shapes", self._plots.deflected_shapes))
        wanted.append(("plan", self._plots.plan))
        return [self._numbered(draw(), words.CAPTIONS[name]) for name, draw in wanted]

    def health(self) -> Figure | None:
        """Loss and points per lidar; None where no health was written."""
        if self._folder.health.is_empty():
            return None
        return self._numbered(self._plots.health(), words.CAPTIONS["health"])
