"""The page of two runs: where they differ, by how much, and whether uncertainty explains it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import plotly.graph_objects as go

from lidar_deflect import words
from lidar_deflect.comparison import runs
from lidar_deflect.files import write_text
from lidar_deflect.folder import Folder
from lidar_deflect.plots import style
from lidar_deflect.report import digits
from lidar_deflect.report.document import (
    Block,
    Cell,
    Chapter,
    Column,
    Document,
    Figure,
    Headline,
    Row,
    Table,
    Text,
    Verdict,
)
from lidar_deflect.report.document import words as said
from lidar_deflect.report.page import render

if TYPE_CHECKING:
    from lidar_deflect.comparison.runs import Difference


def write(
    first: str | Path, second: str | Path, out: str | Path, *, overwrite: bool = True
) -> Path:
    """Write the page of two runs.

    Raises
    ------
    ResultNotFoundError, ResultError
        If one is no result folder, or they have nothing in common.
    OutputError
        If the page cannot be written.
    """
    page = render(document(Folder(first), Folder(second)))
    return write_text(Path(out), page, overwrite=overwrite)


def names_of(first: Folder, second: Folder) -> tuple[str, str]:
    """Name two runs by their folders, told apart."""
    one, two = (each.path.resolve() for each in (first, second))
    if one.name != two.name:
        return one.name, two.name
    return f"{one.parent.name}/{one.name}", f"{two.parent.name}/{two.name}"


def document(first: Folder, second: Folder) -> Document:
    """Return the differences of two runs as a document."""
    found = runs.differences(first, second)
    names = names_of(first, second)
    blocks: tuple[Block, ...] = (
        _table(found, names),
        Figure("differences", words.TWO_RUNS_FIGURE, figure(found)),
    )
    chapters = (
        Chapter("result", words.TWO_RUNS, blocks),
        Chapter("configuration", words.TWO_RUNS_SETTINGS, (_settings(first, second, names),)),
    )
    return Document(
        title=f"{names[0]} – {names[1]}",  # noqa: RUF001
        kicker=words.TWO_RUNS_KICKER,
        cover=tuple((name, _when(each)) for name, each in zip(names, (first, second), strict=True)),
        verdict=_verdict(found),
        headlines=_headlines(found),
        chapters=chapters,
        facts={
            "version": first.metadata.get("lidar_deflect.program_version", ""),
            "hash": first.metadata.get("configuration_hash", ""),
            "folder": " and ".join(names),
        },
    ).numbered()


def _when(folder: Folder) -> str:
    test = folder.config.get("test", {}).get("id", "")
    method = folder.run.get("method", "")
    start = digits.instant(folder.deflection["time"].min())  # type: ignore[arg-type]
    return ", ".join(str(each) for each in (test, method, start) if each)


def _verdict(found: list[Difference]) -> Verdict:
    beyond = [each for each in found if each.is_beyond]
    unknown = [each for each in found if each.is_beyond is None]
    if len(unknown) == len(found):
        return Verdict("none", words.TWO_RUNS_SILENT)
    count = len(found) - len(unknown)
    if not beyond:
        return Verdict("good", words.TWO_RUNS_SAME.format(count=count))
    title = words.TWO_RUNS_DIFFER.format(beyond=len(beyond), count=count)
    return Verdict("bad", title, (words.TWO_RUNS_CHANCE,))


def _headlines(found: list[Difference]) -> tuple[Headline, ...]:
    totals = [each for each in found if each.quantity == "total"]
    if not totals:
        return ()
    worst = max(totals, key=lambda each: abs(each.difference))
    cell = digits.millimetres(worst.difference, worst.u)
    value = f"{cell.text} {cell.interval} mm".replace("  ", " ")
    return (Headline(value, words.TWO_RUNS_LARGEST, f"{worst.section}, {worst.step}"),)


def _table(found: list[Difference], names: tuple[str, str]) -> Table:
    label = words.COLUMNS | words.AGAINST_COLUMNS
    columns = (
        Column(label["step"], numeric=False),
        Column(label["section"], numeric=False),
        Column(label["quantity"], numeric=False),
        Column(names[0], "mm, °"),
        Column(names[1], "mm, °"),
        Column(label["difference"], "mm, °"),
        Column(label["verdict"], numeric=False),
    )
    steps = dict.fromkeys(each.step for each in found)
    groups = tuple(tuple(_row(each) for each in found if each.step == step) for step in steps)
    caption = words.TWO_RUNS_CAPTION.format(first=names[0], second=names[1])
    return Table("two_runs", caption, columns, groups, head_columns=3)


def _row(each: Difference) -> Row:
    mark = {None: "open", True: "bad", False: "good"}[each.is_beyond]
    place = f"{each.section} ({each.s_m:g} m)"
    head = (said(each.step), said(place), said(words.QUANTITIES[each.quantity]))
    values = [_value(v, None, each) for v in (each.first, each.second)]
    off = _value(each.difference, each.u, each)
    return (*head, *values, off, said(words.BEYOND[mark], mark))


def _value(value: float, u: float | None, each: Difference) -> Cell:
    if each.quantity == "twist":
        return digits.degrees(value, u)
    return digits.measured(value, u, scale=1e3, decimals=1)


def _settings(first: Folder, second: Folder, names: tuple[str, str]) -> Block:
    rows = tuple(
        tuple(said(each) for each in row) for row in runs.settings(first.config, second.config)
    )
    if not rows:
        return Text((words.SAME_SETTINGS,))
    columns = tuple(Column(each, numeric=False) for each in (words.KEY, *names))
    return Table("settings", words.TWO_RUNS_SETTINGS, columns, (rows,))


def figure(found: list[Difference]) -> go.Figure:
    """Draw the difference of the total deflection along the span, one mark per step."""
    drawn = style.plain()
    totals = [each for each in found if each.quantity == "total"]
    for k, step in enumerate(dict.fromkeys(each.step for each in totals)):
        own = sorted((each for each in totals if each.step == step), key=lambda each: each.s_m)
        drawn.add_trace(
            go.Scatter(
                x=[each.s_m for each in own],
                y=[1e3 * each.difference for each in own],
                error_y={"type": "data", "array": [_half(each) for each in own]},
                mode="lines+markers",
                name=style.text(step),
                line={"color": style.colour(k), "dash": style.dash(k), "width": 1.4},
                marker={"symbol": style.symbol(k), "size": 8},
                text=[style.text(each.section) for each in own],
                hovertemplate="%{text}<br>%{y:.1f} mm<extra>" + style.text(step) + "</extra>",
            )
        )
    if not totals:
        return style.note(drawn, "no total deflection in common")
    drawn.update_xaxes(title_text="arc length s (m)")
    drawn.update_yaxes(title_text="difference of the total (mm)")
    drawn.update_layout(height=440)
    return drawn


def _half(each: Difference) -> float:
    return 0.0 if each.u is None else 1e3 * style.COVERAGE * each.u
