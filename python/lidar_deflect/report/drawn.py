"""Figures on paper: the same plotly figures, drawn by matplotlib as vector graphics."""

from __future__ import annotations

import html
import io
import re
from base64 import b64decode
from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect.extras import need

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    import plotly.graph_objects as go

WIDTH_IN = 7.1
_LONGEST = 48
_PIXELS_PER_IN = 125.0
_DASHES = {"dash": (0, (5, 2)), "dot": (0, (1, 1.6)), "dashdot": (0, (5, 1.6, 1, 1.6))}
_MARKS = {
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "triangle-up": "^",
    "triangle-down": "v",
    "cross": "P",
    "x": "X",
    "star": "*",
    "circle-open": "o",
    "diamond-open": "D",
    "cross-thin-open": "+",
}
_HATCHES = {"/": "////", ".": "....", "x": "xxxx"}
_COLOUR = re.compile(r"rgba?\(([\d.]+),([\d.]+),([\d.]+)(?:,([\d.]+))?\)")
_STYLE = {
    "font.size": 7.5,
    "axes.labelsize": 7.5,
    "legend.fontsize": 7,
    "text.parse_math": False,  # names of sections are text, whatever stands in them
    "svg.fonttype": "none",  # words stay words, in the fonts of the document
    "svg.hashsalt": "lidar-deflect",  # the same figure gives the same bytes
    "axes.unicode_minus": True,
}


def svg(figure: go.Figure, families: Sequence[str], fonts: Sequence[Path] = ()) -> bytes:
    """Draw a plotly figure as SVG.

    Parameters
    ----------
    figure
        Figure of this package: lines, marks, bands, bars and shaded stretches on plain axes.
    families
        Fonts to use, in order.
    fonts
        Files of those that matplotlib may not know.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    matplotlib = need("matplotlib", "pdf", "a PDF")
    need("matplotlib.figure", "pdf", "a PDF")
    manager = need("matplotlib.font_manager", "pdf", "a PDF").fontManager
    for path in fonts:
        manager.addfont(path)
    known = {entry.name for entry in manager.ttflist}
    families = [name for name in families if name in known]
    with matplotlib.rc_context(_STYLE | {"font.family": list(families)}):
        drawn = matplotlib.figure.Figure(figsize=(WIDTH_IN, _height_in(figure)))
        _Drawing(drawn, figure.to_dict()).fill()
        out = io.BytesIO()
        drawn.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return out.getvalue()


def _height_in(figure: go.Figure) -> float:
    return float(np.clip((figure.layout.height or 450) / _PIXELS_PER_IN, 2.4, 5.4))


class _Drawing:
    def __init__(self, drawn: Any, given: Mapping[str, Any]) -> None:
        self._drawn = drawn
        self._layout: Mapping[str, Any] = given["layout"]
        self._traces: list[Mapping[str, Any]] = list(given["data"])
        self._axes: dict[str, Any] = {}

    def fill(self) -> None:
        for trace in self._traces:
            self._axis(trace.get("yaxis", "y"))
        if not self._axes:
            self._axis("y")
        self._shade()
        bars = [trace for trace in self._traces if trace["type"] == "bar"]
        for trace in self._traces:
            if trace["type"] == "scatter":
                self._scatter(trace)
        for own in {trace.get("yaxis", "y") for trace in bars}:
            self._bars([trace for trace in bars if trace.get("yaxis", "y") == own], own)
        for note in self._layout.get("annotations", ()):
            self._note(note)
        for name, axis in self._axes.items():
            self._finish(name, axis)
        self._legend()

    def _axis(self, name: str) -> Any:
        """Axes of one panel, made where plotly puts it."""
        if name in self._axes:
            return self._axes[name]
        number = name[1:]
        y = self._layout.get(f"yaxis{number}", {})
        x = self._layout.get(f"xaxis{number}", {})
        left, right = x.get("domain", (0.0, 1.0))
        low, high = y.get("domain", (0.0, 1.0))
        bottom, top = 0.48 / self._height(), 1.0 - 0.42 / self._height()
        scale, across = top - bottom, 0.885
        box = (0.09 + left * across, bottom + low * scale)
        axis = self._drawn.add_axes((*box, (right - left) * across, (high - low) * scale))
        axis.grid(visible=True, color="#000000", alpha=0.13, linewidth=0.5)
        axis.set_axisbelow(True)
        axis.ticklabel_format(useOffset=False)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
        self._axes[name] = axis
        return axis

    def _height(self) -> float:
        return float(self._drawn.get_size_inches()[1])

    def _scatter(self, trace: Mapping[str, Any]) -> None:
        axis = self._axis(trace.get("yaxis", "y"))
        x, y = numbers(trace.get("x")), numbers(trace.get("y"))
        mode = trace.get("mode", "lines")
        line, marker = trace.get("line", {}), trace.get("marker", {})
        if trace.get("fill") == "toself":
            if len(x):
                axis.fill(x, y, **_fill(trace.get("fillcolor")), label=_label(trace))
            return
        options: dict[str, Any] = {"label": _label(trace), "alpha": trace.get("opacity", 1.0)}
        hue = _rgba(line.get("color") or marker.get("color") or "#444444")
        options |= {"color": hue, "linewidth": 0.62 * float(line.get("width", 1.6))}
        if "lines" not in mode:
            options["linestyle"] = "none"
        elif line.get("dash") in _DASHES:
            options["linestyle"] = _DASHES[line["dash"]]
        if "markers" in mode:
            symbol = marker.get("symbol", "circle")
            options |= {"marker": _MARKS.get(symbol, "o"), "color": hue}
            options |= {"markersize": 0.5 * float(marker.get("size", 6))}
            if "lines" not in mode:
                options["color"] = _rgba(marker.get("color") or "#444444")
            if symbol.endswith("-open"):
                options["markerfacecolor"] = "none"
        if line.get("shape") == "hv":
            options["drawstyle"] = "steps-post"
        axis.plot(x, y, **options)
        self._errors(axis, trace, x, y, options["color"])
        if "text" in mode:
            for place_x, place_y, word in zip(x, y, trace.get("text", ()), strict=False):
                axis.annotate(
                    _plain(word), (place_x, place_y), (0, -9), textcoords="offset points",
                    ha="center", fontsize=6.5,
                )  # fmt: skip

    @staticmethod
    def _errors(axis: Any, trace: Mapping[str, Any], x: Any, y: Any, hue: Any) -> None:
        size = numbers(trace.get("error_y", {}).get("array"))
        if len(size) and np.any(size > 0.0):
            axis.errorbar(x, y, size, fmt="none", ecolor=hue, elinewidth=0.8, capsize=2)

    def _bars(self, traces: list[Mapping[str, Any]], name: str) -> None:
        axis = self._axis(name)
        words = list(dict.fromkeys(_plain(each) for trace in traces for each in trace["x"]))
        order = self._layout.get("xaxis", {}).get("categoryarray")
        if order is not None:
            words = [w for w in map(_plain, order) if w in words]
        width = 0.8 / len(traces)
        for k, trace in enumerate(traces):
            at = np.array([words.index(_plain(each)) for each in trace["x"]], dtype=float)
            at += (k - 0.5 * (len(traces) - 1)) * width
            y, size = numbers(trace["y"]), numbers(trace.get("error_y", {}).get("array"))
            marker = trace.get("marker", {})
            hatch = _HATCHES.get(marker.get("pattern", {}).get("shape") or "")
            hue = _rgba(marker.get("color", "#444444"))
            look = {"facecolor": "none", "edgecolor": hue} if hatch else {"color": hue}
            axis.bar(at, y, 0.92 * width, hatch=hatch, label=_label(trace), **look)
            if len(size) and np.any(size > 0.0):
                axis.errorbar(at, y, size, fmt="none", ecolor="#222222", elinewidth=0.8, capsize=2)
        axis.set_xticks(range(len(words)), words)

    def _shade(self) -> None:
        for shape in self._layout.get("shapes", ()):
            if shape.get("type") != "rect":
                continue
            name = str(shape.get("yref", "y")).split(" ")[0]
            if name in self._axes:
                look = _fill(shape.get("fillcolor"))
                self._axes[name].axvspan(float(shape["x0"]), float(shape["x1"]), **look)

    def _note(self, note: Mapping[str, Any]) -> None:
        word = _plain(note.get("text", ""))
        if note.get("xref") == "paper":
            self._drawn.text(float(note["x"]), float(note["y"]), word, ha="center", color="#666666")
            return
        axis = self._axis(str(note.get("yref", "y")).split(" ")[0])
        axis.annotate(
            word, (float(note["x"]), 1.0), (0, 2), xycoords=("data", "axes fraction"),
            textcoords="offset points", ha="center", va="bottom", fontsize=6.5, color="#666666",
        )  # fmt: skip

    def _finish(self, name: str, axis: Any) -> None:
        y = self._layout.get(f"yaxis{name[1:]}", {})
        x = self._layout.get(f"xaxis{name[1:]}", {})
        if y.get("visible") is False:
            axis.set_axis_off()
        axis.set_ylabel(_plain(y.get("title", {}).get("text", "")))
        axis.set_xlabel(_plain(x.get("title", {}).get("text", "")))
        if x.get("matches") and not x.get("title", {}).get("text"):
            axis.tick_params(labelbottom=False)
        if y.get("scaleanchor"):
            axis.set_aspect("equal", adjustable="datalim")
        if y.get("rangemode") == "tozero":
            low, high = axis.get_ylim()
            axis.set_ylim(min(low, 0.0), max(high, 0.0))
        first = next(iter(self._axes.values()))
        if axis is not first and (x.get("matches") or x.get("anchor")) and x.get("type") is None:
            low, high = self._common()
            for each in self._axes.values():
                each.set_xlim(low, high)

    def _common(self) -> tuple[float, float]:
        limits = [axis.get_xlim() for axis in self._axes.values()]
        return min(low for low, _ in limits), max(high for _, high in limits)

    def _legend(self) -> None:
        found: dict[str, Any] = {}
        for axis in self._axes.values():
            for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
                found.setdefault(label, handle)
        if found:
            self._drawn.legend(
                list(found.values()), list(found), loc="upper left", ncols=6, frameon=False,
                bbox_to_anchor=(0.08, 1.005), borderaxespad=0.1, handlelength=1.8,
            )  # fmt: skip


def numbers(values: Any) -> Any:
    """Return values of a trace as f64, shape (n,), NaN for None."""
    if values is None:
        return np.empty(0)
    if isinstance(values, dict):
        return np.frombuffer(b64decode(values["bdata"]), dtype=values["dtype"]).astype(np.float64)
    return np.array([np.nan if v is None else v for v in values], dtype=np.float64)


def _label(trace: Mapping[str, Any]) -> str:
    shown = trace.get("showlegend", True) and trace.get("name")
    return _plain(trace["name"]) if shown else "_"


def _plain(word: Any) -> str:
    """Undo the escapes that plotly needs, and shorten what would leave the page."""
    found = html.unescape(str(word).replace("<br>", "\n"))
    return found if len(found) <= _LONGEST else found[: _LONGEST - 1] + "…"


def _rgba(colour: str) -> Any:
    match = _COLOUR.match(colour.replace(" ", ""))
    if match is None:
        return colour
    red, green, blue = (float(match[k]) / 255.0 for k in (1, 2, 3))
    return red, green, blue, float(match[4] or 1.0)


def _fill(colour: str | None) -> dict[str, Any]:
    return {"facecolor": _rgba(colour or "rgba(128,128,128,0.2)"), "edgecolor": "none"}
