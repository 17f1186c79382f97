"""Figures of a result, from its tables alone.

`Plots` holds a result and draws: `series` over time and load, `shapes` in space, `quality` of the
comparison and of the lidars; `style` is how all of them look.
"""

import plotly.graph_objects as go

from lidar_deflect.plots import quality, series, shapes, style
from lidar_deflect.plots.series import Quantity
from lidar_deflect.plots.source import HasTables

__all__ = ["HasTables", "Plots", "Quantity", "style"]


class Plots:
    """Plotly figures of one result.

    Parameters
    ----------
    result
        Anything with the tables `deflection` and `steps` as polars frames; `contour`, `health`,
        `comparison` and `config` are used where it has them.

    Examples
    --------
    >>> Plots(result).time_series(section="tip").show()  # doctest: +SKIP
    """

    def __init__(self, result: HasTables) -> None:
        self._result = result

    def __repr__(self) -> str:
        names = [name for name in dir(self) if not name.startswith("_")]
        return f"Plots({', '.join(names)})"

    def time_series(
        self, section: str | float | None = None, quantity: Quantity = "deflection"
    ) -> go.Figure:
        """Draw x, y and z of one section over time, as the paper's figures 19 and 21 do.

        Gaps stay gaps; holds are shaded, states that are not ``ok`` are marked, stretches without a
        state are tinted, and the 95 % interval is drawn where there is an uncertainty.

        Parameters
        ----------
        section
            Name, arc length in metres, or None and ``tip`` for the outermost.
        quantity
            ``deflection`` from the unloaded hold, or ``position`` in the world frame.
        """
        return series.time_series(self._result, section, quantity)

    def load_deflection(self) -> go.Figure:
        """Draw the total deflection of every section over the load, holds marked."""
        return series.load_deflection(self._result)

    def deflected_shapes(self) -> go.Figure:
        """Draw the blade's line at every load step, seen from above and from the side."""
        return shapes.deflected_shapes(self._result)

    def plan(self) -> go.Figure:
        """Draw the test seen from above: sections, lidars, anchors of the wires."""
        return shapes.plan(self._result)

    def comparison(self, step: str | None = None) -> go.Figure:
        """Draw the errors of every method per section, as the paper's figure 20 does.

        Parameters
        ----------
        step
            Load step; default: the one with the largest deflection.
        """
        return quality.comparison(self._result, step)

    def health(self) -> go.Figure:
        """Draw lost packets, and points on the blade, per lidar and second."""
        return quality.health(self._result)
