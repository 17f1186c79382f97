"""Chapters of figures: curves over time, replay, load, shapes, cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lidar_deflect import behaviour, words
from lidar_deflect.comparison import largest_step
from lidar_deflect.plots import Plots
from lidar_deflect.plots.series import other_names, wire_names
from lidar_deflect.plots.source import sections, some
from lidar_deflect.plots.spans import has_rotations
from lidar_deflect.report import digits, replay
from lidar_deflect.report.document import Block, Cell, Column, Figure, Fold, Replay, Table, Text
from lidar_deflect.report.document import words as said

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lidar_deflect.folder import Folder

_SHOWN = 6
_MOST_POINTS = 80_000
"""States of all sections together: what keeps the file of an hour under 15 MB."""


def curves(folder: Folder) -> tuple[Block, ...]:
    """Time series of every section, the outermost first; of many, the others on demand."""
    known = list(reversed(sections(folder.deflection)))
    most = max(300, min(8000, _MOST_POINTS // max(len(known), 1)))
    figures = {name: _series(folder, name, s_m, most) for name, s_m in known}
    shown = [name for name, _ in some(known, _SHOWN)]
    rest = tuple(figure for name, figure in figures.items() if name not in shown)
    found: list[Block] = [figures[name] for name in shown]
    if rest:
        found.append(Fold(words.MORE_SECTIONS.format(count=len(rest)), rest))
    if other_names(folder):
        caption = words.CAPTIONS["channels"]
        found.append(Figure("channels", caption, Plots(folder).channels(), link="time"))
    if folder.deflection.height > most * len(known):
        found.append(Text((words.THINNED,), quiet=True))
    return tuple(found)


def _series(folder: Folder, name: str, s_m: float, most: int) -> Figure:
    band = folder.deflection["udx_m"].null_count() < folder.deflection.height
    caption = words.CAPTIONS["time_series"].format(
        section=name, s_m=s_m, band=words.BAND if band else ""
    )
    figure = Plots(folder).time_series(name, most_states=most)
    return Figure(f"time_series_{name}", caption, figure, link="time")


def in_space(folder: Folder) -> tuple[Block, ...]:
    """Return the replay."""
    data = replay.data(folder)
    if data is None:
        return (Text((words.NO_REPLAY,)),)
    return (Replay(words.CAPTIONS["replay"], data),)


def load(folder: Folder) -> tuple[Block, ...]:
    """Load against deflection, with slope, linearity, hysteresis, residual and creep."""
    unit = behaviour.direction(folder.config, folder.steps)
    if unit is None:
        return (Text((words.NO_LOADED,)),)
    found: list[Block] = []
    if folder.deflection["load"].null_count() < folder.deflection.height:
        figure = Plots(folder).load_deflection()
        found.append(Figure("load_deflection", words.CAPTIONS["load_deflection"], figure))
    else:
        found.append(Text((words.NO_LOAD,)))
    rows = behaviour.stiffnesses(folder.steps, folder.deflection, unit)
    found += [_stiffness_table(rows)] if rows else []
    drifts = behaviour.creep(folder.steps, folder.deflection, unit)
    if drifts:
        figure = Plots(folder).creep()
        name = str(figure.layout.meta["section"]) if figure.layout.meta else ""
        caption = words.CAPTIONS["creep"].format(section=name)
        found += [Figure("creep", caption, figure), _creep_table(drifts)]
    return tuple(found)


def _stiffness_table(rows: list[behaviour.Stiffness]) -> Table:
    label = words.STIFFNESS_COLUMNS
    columns = (
        Column(label["section"], numeric=False),
        Column(label["s"], "m"),
        Column(label["slope"], "mm per %"),
        Column(label["linearity"], "%"),
        Column(label["hysteresis"], "mm"),
        Column(label["at"], "%"),
        Column(label["residual"], "mm"),
    )
    cells = tuple(
        (
            said(each.section),
            Cell(digits.place(each.s_m), each.s_m),
            digits.measured(each.slope_m_per_percent, each.u_slope, scale=1e3, decimals=2),
            digits.number(each.linearity_percent, 2),
            digits.millimetres(each.hysteresis_m),
            digits.number(each.hysteresis_at_percent, 0),
            digits.millimetres(each.residual_m, each.u_residual_m),
        )
        for each in rows
    )
    return Table("load_response", words.STIFFNESS_CAPTION, columns, (cells,))


def _creep_table(drifts: list[behaviour.Creep]) -> Table:
    label = words.COLUMNS | words.CREEP_COLUMNS
    columns = (
        Column(label["step"], numeric=False),
        Column(label["section"], numeric=False),
        Column(label["duration"], "s"),
        Column(label["drift"], "mm"),
        Column(label["seen"], numeric=False),
    )
    steps = dict.fromkeys(each.step for each in drifts)
    groups = tuple(
        tuple(
            (
                said(each.step),
                said(each.section),
                digits.number(each.duration_s, 1),
                digits.measured(each.drift_m, each.u_m, scale=1e3, decimals=1),
                said(words.DRIFTS[each.is_beyond]),
            )
            for each in drifts
            if each.step == step
        )
        for step in steps
    )
    return Table("creep", words.CREEP_CAPTION, columns, groups, head_columns=2)


def shapes(folder: Folder) -> tuple[Block, ...]:
    """Deflected line per step, and rotations where the method has them."""
    found: list[Block] = []
    plots = Plots(folder)
    if folder.steps["x_m"].null_count() < folder.steps.height:
        caption = words.CAPTIONS["deflected_shapes"]
        found.append(Figure("deflected_shapes", caption, plots.deflected_shapes()))
    if has_rotations(folder) and folder.steps.height:
        found.append(Figure("rotation", words.CAPTIONS["rotation"], plots.rotation()))
    return (*found, *_cuts(folder)) or (Text((words.NO_LOADED,)),)


def _cuts(folder: Folder) -> Iterator[Figure]:
    """Sections across their axes, at the step with most load."""
    if folder.outline.is_empty():
        return
    step = largest_step(folder.steps)
    for name, s_m in some(list(reversed(sections(folder.outline))), _SHOWN):
        figure = Plots(folder).section_cut(name, step)
        caption = words.CAPTIONS["section_cut"].format(section=name, s_m=s_m, step=step)
        yield Figure(f"section_cut_{name}", caption, figure)


def cycles(folder: Folder) -> tuple[Block, ...]:
    """Amplitude and frequency of every section; empty for a static test."""
    if folder.cycles.is_empty():
        return ()
    known = list(reversed(sections(folder.cycles)))
    return tuple(
        Figure(
            f"cycles_{name}",
            words.CAPTIONS["cycles"].format(section=name, s_m=s_m),
            Plots(folder).cycles(name),
            link="cycles",
        )
        for name, s_m in some(known, _SHOWN)
    )


def wires(folder: Folder) -> tuple[Block, ...]:
    """Wires beside what they would have read."""
    if not wire_names(folder.channels):
        return ()
    return (Figure("wires", words.CAPTIONS["wires"], Plots(folder).wires(), link="time"),)
