"""How every figure looks: one palette that the colour-blind can read, units on every axis."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
import polars as pl
from plotly.subplots import make_subplots

# Okabe and Ito's palette without its yellow and black, which one of the two backgrounds swallows.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6D46", "#7F7F7F")
DASHES = ("solid", "dash", "dot", "dashdot")
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "cross", "x", "triangle-down", "star")
GREY = "#808080"
FAINT = "rgba(128,128,128,0.14)"
GRID = "rgba(128,128,128,0.25)"
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif"

# Without the button that sends the data to a host: a test's numbers stay where they are.
MODEBAR = {
    "bgcolor": "rgba(0,0,0,0)",
    "color": "rgba(128,128,128,0.6)",
    "activecolor": GREY,
    "remove": ["sendChartToCloud", "lasso", "select"],
}

COVERAGE = 1.96
"""Half-width of a 95 % interval of a normal distribution, in standard uncertainties."""

STATUS_MARKS = {
    "degraded": ("#E69F00", "triangle-up"),
    "interpolated": ("#CC79A7", "circle-open"),
    "extrapolated": ("#8C6D46", "diamond-open"),
}
"""Colour and symbol of each status that carries a number but is not ``ok``."""


def colour(index: int) -> str:
    """Return the colour of the n-th thing of a figure; beyond the palette it starts again."""
    return COLOURS[index % len(COLOURS)]


def dash(index: int) -> str:
    """Return the dash of the n-th thing: it changes when the colours start again."""
    return DASHES[index // len(COLOURS) % len(DASHES)]


def symbol(index: int) -> str:
    """Return the mark of the n-th thing: colour is never the only difference."""
    return SYMBOLS[index % len(SYMBOLS)]


def translucent(hex_colour: str, alpha: float) -> str:
    """Return ``#rrggbb`` with an opacity."""
    red, green, blue = (int(hex_colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha:g})"


def panels(rows: int, columns: int = 1, **options: Any) -> go.Figure:
    """Return an empty figure of several panels in the house style."""
    spacing = {"vertical_spacing": 0.06} if rows > 1 else {}
    return finish(make_subplots(rows=rows, cols=columns, **(spacing | options)))


def plain() -> go.Figure:
    """Return an empty figure in the house style."""
    return finish(go.Figure())


def finish(figure: go.Figure) -> go.Figure:
    """Give a figure the house style."""
    figure.update_layout(
        template="none",
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        font={"family": FONT, "size": 13, "color": "#444444"},
        colorway=COLOURS,
        margin={"l": 70, "r": 20, "t": 40, "b": 55},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0.0},
        modebar=MODEBAR,
        hovermode="closest",
    )
    axis: dict[str, Any] = {
        "gridcolor": GRID,
        "zerolinecolor": GREY,
        "zerolinewidth": 1,
        "ticks": "outside",
    }
    axis |= {"title": {"font": {"size": 13}, "standoff": 8}}
    figure.update_xaxes(**axis, automargin=True)
    figure.update_yaxes(**axis, automargin=True)
    return figure


def note(figure: go.Figure, text: str) -> go.Figure:
    """Write into an empty figure why it is empty."""
    figure.update_xaxes(visible=False)
    figure.update_yaxes(visible=False)
    figure.add_annotation(
        text=text, x=0.5, y=0.5, xref="paper", yref="paper", showarrow=False, font={"color": GREY}
    )
    return figure


def text(value: object) -> str:
    """Return a name from a file for a label, escaped: plotly reads a little HTML there."""
    return str(value).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def stretches(mask: Sequence[bool]) -> list[tuple[int, int]]:
    """First and last index of every stretch of True."""
    found: list[tuple[int, int]] = []
    for place, value in enumerate(mask):
        if value and found and found[-1][1] == place - 1:
            found[-1] = (found[-1][0], place)
        elif value:
            found.append((place, place))
    return found


def thinned(frame: pl.DataFrame, columns: Sequence[str], most: int) -> pl.DataFrame:
    """Keep about `most` rows of a series: of every stretch those with the extremes of each column.

    So no peak is lost, whatever the width of the screen. Rows without a value keep their gap.
    """
    if frame.height <= most:
        return frame
    buckets = max(most // (2 * len(columns) + 1), 1)
    place = np.arange(frame.height)
    indexed = pl.DataFrame({"row": place, "bucket": place * buckets // frame.height})
    indexed = indexed.hstack(frame.select(columns))
    picks = [pl.col("row").first().alias("first")]
    for name in columns:
        value = pl.col(name).cast(pl.Float64)
        picks.append(pl.col("row").get(value.arg_min().fill_null(0)).alias(f"low {name}"))
        picks.append(pl.col("row").get(value.arg_max().fill_null(0)).alias(f"high {name}"))
        gap = pl.col("row").filter(value.is_null()).first()
        picks.append(gap.alias(f"gap {name}"))
    kept = indexed.group_by("bucket").agg(picks).drop("bucket")
    rows = pl.concat([kept[name] for name in kept.columns]).drop_nulls().unique().sort()
    return frame[rows]
