"""Figures of a result, from its tables alone.

`Plots` holds a result and draws: `series` over time, `load` over the load, `shapes` in space,
`spans` along the blade, `places` of the yard, `quality` of the comparison and of the lidars,
`surface` of section cuts and residuals, `yard` of what the registration left,
`fatigue` over cycles; `style` is how all of them look.
"""

import plotly.graph_objects as go

from lidar_deflect.plots import (
    fatigue,
    load,
    places,
    quality,
    series,
    shapes,
    spans,
    style,
    surface,
    yard,
)
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
        self,
        section: str | float | None = None,
        quantity: Quantity = "deflection",
        *,
        most_states: int = series.MOST_STATES,
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
        most_states
            Longer series are thinned to about so many states; their extremes stay.
        """
        return series.time_series(self._result, section, quantity, most_states)

    def wires(self) -> go.Figure:
        """Draw every draw wire beside what it would have read at the measured positions."""
        return series.wires(self._result)

    def channels(self) -> go.Figure:
        """Draw the channels that are neither load nor wire, one panel per unit."""
        return series.channels(self._result)

    def load_deflection(self) -> go.Figure:
        """Draw the deflection along the load over the load: holds, lines through them, paths."""
        return load.load_deflection(self._result)

    def creep(self, section: str | None = None) -> go.Figure:
        """Draw the drift of one section along the load over every hold.

        Parameters
        ----------
        section
            Name; default: the outermost that was measured.
        """
        return load.creep(self._result, section)

    def rotation(self) -> go.Figure:
        """Draw rotations about x and y and the twist change along the span at every step."""
        return spans.rotation(self._result)

    def pose_uncertainty(self) -> go.Figure:
        """Draw the expanded uncertainty of every lidar's pose."""
        return places.pose_uncertainty(self._result)

    def yard_residuals(self) -> go.Figure:
        """Draw the mean residual of the registration's rays over ground and walls."""
        return yard.yard_residuals(self._result)

    def lidar_shares(self) -> go.Figure:
        """Draw how many rays of every lidar hold ground and walls."""
        return yard.lidar_shares(self._result)

    def drift(self) -> go.Figure:
        """Draw how far every lidar turned and moved during the test."""
        return places.drift(self._result)

    def residuals(self) -> go.Figure:
        """Draw how far the blade's points lie from the model, by lidar along the span."""
        return quality.residuals(self._result)

    def residual_map(self) -> go.Figure:
        """Draw the mean residual over span and chord, suction and pressure side."""
        return surface.residual_map(self._result)

    def section_cut(self, section: str | float | None = None, step: str | None = None) -> go.Figure:
        """Draw a section across its axis: outline, its 95 % band, points within 0.3 m.

        Parameters
        ----------
        section
            Name, arc length in metres, or None and ``tip`` for the outermost.
        step
            Load step; default: the last.
        """
        return surface.section_cut(self._result, section, step)

    def cycles(self, section: str | float | None = None) -> go.Figure:
        """Draw amplitudes and frequency of one section over the cycles of a fatigue test."""
        return fatigue.cycles(self._result, section)

    def deflected_shapes(self) -> go.Figure:
        """Draw the blade's line at every load step, seen from above and from the side."""
        return shapes.deflected_shapes(self._result)

    def plan(self) -> go.Figure:
        """Draw the test seen from above: sections, lidars, surveyed points, anchors."""
        return places.plan(self._result)

    def comparison(self, step: str | None = None) -> go.Figure:
        """Draw the errors of every method per section, as the paper's figure 20 does.

        Parameters
        ----------
        step
            Load step; default: the one with the largest deflection.
        """
        return quality.comparison(self._result, step)

    def health(self) -> go.Figure:
        """Draw loss, points, coverage and clock per lidar and second."""
        return quality.health(self._result)
