"""Measured deflections held against a reference: rows of the table ``comparison``."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from lidar_deflect import channels, tables
from lidar_deflect import wires as wire_lines
from lidar_deflect.comparison import measured as lidar
from lidar_deflect.comparison.error import NEGLIGIBLE, error_percent
from lidar_deflect.comparison.measured import AXES, Measured
from lidar_deflect.comparison.reference import Reference, Wire, prediction, recognise, wires
from lidar_deflect.errors import ResultError
from lidar_deflect.folder import Folder
from lidar_deflect.wires import Line

Row = dict[str, Any]


class ComparisonWarning(UserWarning):
    """Something of a reference that could not be held against the measurement."""


def compare(
    folder: str | Path | Folder,
    reference: str | Path | Reference,
    *,
    kind: str | None = None,
    config: Any = None,
) -> pl.DataFrame:
    """Hold the steps of a result folder against a reference.

    Parameters
    ----------
    folder
        Result folder with its table ``steps``.
    reference
        File of draw wires, of a prediction or of true states, or another result folder.
    kind
        ``wire``, ``prediction``, ``truth`` or ``run``; default: told by the columns.
    config
        Configuration, as a mapping or a pydantic model; default: ``test.toml`` of the folder.

    Returns
    -------
    polars.DataFrame
        Table ``comparison``. The error, equation (16), is null where the reference is under one
        percent of its largest value: relative to nothing there is no error.

    Raises
    ------
    ResultNotFoundError
        If folder or reference are not there.
    ResultError
        If the folder has no steps, or the reference nothing that fits them.

    Notes
    -----
    A draw wire measures along its line: its rows of the quantity ``wire`` hold it against what it
    would have read at the measured positions, those of ``total`` against the total deflection.
    """
    folder = folder if isinstance(folder, Folder) else Folder(folder)
    if not isinstance(reference, Reference):
        reference = recognise(reference, kind=kind)
    settings = _mapping(folder.config if config is None else config)
    rows = lidar.of_steps(folder.steps)
    if not rows:
        raise ResultError(
            f"{folder.path} has no measured load step",
            code="comparison.no_steps",
            hint="a load channel under [load] names the steps where the data do not",
        )
    shifts = {each["file"]: each["applied_s"] for each in folder.run.get("channel_clocks") or ()}
    found = list(_against(reference, rows, folder.steps, settings, shifts))
    if not found:
        raise ResultError(
            f"nothing in {reference.path} fits a step and section of {folder.path}",
            code="comparison.nothing_fits",
            facts=[
                ("taken as", f"{reference.kind}: {reference.why}"),
                ("sections", ", ".join(f"{s} m" for s in sorted({r.row["s_m"] for r in rows}))),
                ("steps", ", ".join(dict.fromkeys(r.row["step"] for r in rows))),
            ],
        )
    return _table(found)


def configured(
    steps: pl.DataFrame,
    config: Mapping[str, Any],
    read: Sequence[channels.Channel] = (),
    predicted: channels.Prediction | None = None,
) -> pl.DataFrame:
    """Hold steps against the wires and the prediction that their configuration names.

    Parameters
    ----------
    steps
        Table ``steps``.
    config
        Configuration as a mapping.
    read
        Draw wires, on the clock of the lidars.
    predicted
        The prediction, or None.

    Returns
    -------
    polars.DataFrame
        Table ``comparison``; rows of virtual wires have no reference. Empty where nothing fits.
    """
    rows = lidar.of_steps(steps)
    if not rows:
        return tables.empty("comparison")
    spans = lidar.spans_of(steps)
    named = {channel.name: channel for channel in read}
    lines = {line.name: line for line in wire_lines.lines(config)}
    given = [
        Wire(named[each["name"]], each["section"], None, lines.get(each["name"]))
        for each in config.get("wires") or ()
        if each["name"] in named
    ]
    found = list(_against_wires(given, rows, spans, steps))
    for name, line in lines.items():
        if name not in named:
            found += _virtual(line, rows, steps)
    if predicted is not None and any(each.row["load"] is not None for each in rows):
        found += _against_prediction(predicted, rows, config)
    return _table(found) if found else tables.empty("comparison")


def _virtual(line: Line, rows: Sequence[Measured], steps: pl.DataFrame) -> Iterator[Row]:
    turns = _turns(line, steps)
    for each in rows:
        if each.row["section"] == line.section:
            yield _row(each, line.name, "wire", each.shortening(line, _turn(turns, each)), None)


def _turns(line: Line, steps: pl.DataFrame) -> dict[object, lidar.Vector] | None:
    """Rotation of a wire's section in every step, by its time; None where it is not needed."""
    if not line.offset_m.any():
        return None
    times = steps.filter(pl.col("section") == line.section).sort("time")["time"].to_list()
    return dict(zip(times, wire_lines.turns(steps, line.section), strict=True))


def _turn(turns: dict[object, lidar.Vector] | None, each: Measured) -> lidar.Vector | None:
    return None if turns is None else turns[each.row["time"]]


def save(folder: str | Path | Folder, frame: pl.DataFrame) -> Path:
    """Write ``comparison.parquet``; rows of other sources that it holds are kept."""
    folder = folder if isinstance(folder, Folder) else Folder(folder)
    kept = tables.empty("comparison")
    path = folder.path / "comparison.parquet"
    if path.is_file():
        kept = tables.read(path, name="comparison")
        kept = kept.filter(~pl.col("source").is_in(frame["source"].unique().to_list()))
    own = {k: v for k, v in folder.metadata.items() if not k.startswith("lidar_deflect.")}
    return tables.write(pl.concat([kept, frame]), path, own)


def _mapping(config: Any) -> Mapping[str, Any]:
    found: Mapping[str, Any] = config if isinstance(config, Mapping) else config.model_dump()
    return found


def _against(
    reference: Reference,
    rows: Sequence[Measured],
    steps: pl.DataFrame,
    config: Mapping[str, Any],
    shifts: Mapping[str, float],
) -> Iterator[Row]:
    spans = lidar.spans_of(steps)
    if reference.kind == "wire":
        yield from _against_wires(wires(reference, config, shifts), rows, spans, steps)
    elif reference.kind == "prediction":
        yield from _against_prediction(prediction(reference, config), rows, config)
    elif reference.kind == "truth":
        yield from _against_truth(channels.read_truth(reference.path), rows, spans)
    else:
        yield from _against_run(Folder(reference.path), rows)


def _against_wires(
    given: Sequence[Wire], rows: Sequence[Measured], spans: pl.DataFrame, steps: pl.DataFrame
) -> Iterator[Row]:
    zero_ns = lidar.reference_span_ns(spans)
    for wire in given:
        zero = wire.channel.mean(*zero_ns) if zero_ns else 0.0
        zero = zero if np.isfinite(zero) else 0.0
        turns = None if wire.line is None else _turns(wire.line, steps)
        for each in rows:
            if not _is_tied_to(wire, each):
                continue
            reading = wire.channel.mean(*lidar.span_ns(each.row, spans)) - zero
            if np.isfinite(reading):
                yield from _against_wire(wire, each, reading, _turn(turns, each))


def _is_tied_to(wire: Wire, each: Measured) -> bool:
    if wire.section is not None:
        return bool(each.row["section"] == wire.section)
    return wire.s_m is not None and _is_same(each.row["s_m"], wire.s_m)


def _is_same(s_m: float, other_m: float) -> bool:
    return abs(s_m - other_m) <= channels.SAME_SECTION_M


def _against_wire(
    wire: Wire, each: Measured, reading: float, turn: lidar.Vector | None
) -> Iterator[Row]:
    if wire.line is not None:
        along = each.shortening(wire.line, turn)
        yield _row(each, wire.channel.name, "wire", along, reading)
    else:
        warnings.warn(
            f"wire {wire.channel.name}: its line is not known; it is held against the total "
            "deflection alone",
            ComparisonWarning,
            stacklevel=2,
        )
    yield _row(each, wire.channel.name, "total", each.total, reading)


def _against_prediction(
    predicted: channels.Prediction, rows: Sequence[Measured], config: Mapping[str, Any]
) -> Iterator[Row]:
    if all(each.row["load"] is None for each in rows):
        raise ResultError(
            "a prediction holds at a load, and no load channel was read",
            code="comparison.no_load",
            hint="name the load channel under [load] in the configuration",
        )
    direction = lidar.load_direction(config, rows)
    for each in rows:
        load = each.row["load"]
        value = None if load is None else predicted.at(each.row["s_m"], load)
        if value is None:
            continue
        if predicted.quantity == "vector":
            yield from _components(each, "prediction", value)
        elif predicted.quantity == "direction":
            yield _row(each, "prediction", "direction", each.along(direction), float(value))
        else:
            yield _row(each, "prediction", "total", each.total, float(value))


def _components(each: Measured, source: str, vector: lidar.Vector) -> Iterator[Row]:
    for k, axis in enumerate(AXES):
        own = (float(each.deflection_m[k]), float(each.u_m[k]))
        yield _row(each, source, f"d{axis}", own, float(vector[k]))


def _against_truth(
    truth: pl.DataFrame, rows: Sequence[Measured], spans: pl.DataFrame
) -> Iterator[Row]:
    zero_ns = lidar.reference_span_ns(spans)
    if zero_ns is None:
        raise ResultError(
            "true states are compared from an unloaded hold, and there is none among the steps",
            code="comparison.no_reference",
        )
    for each in rows:
        zero = _mean_place(truth, each.row["s_m"], zero_ns)
        loaded = _mean_place(truth, each.row["s_m"], lidar.span_ns(each.row, spans))
        if zero is None or loaded is None:
            continue
        true = loaded - zero
        yield _row(each, "truth", "total", each.total, float(np.linalg.norm(true)))
        yield from _components(each, "truth", true)


def _mean_place(truth: pl.DataFrame, s_m: float, span: tuple[int, int]) -> lidar.Vector | None:
    rows = truth.filter(
        (pl.col("s_m") - s_m).abs() <= channels.SAME_SECTION_M, pl.col("time_ns").is_between(*span)
    )
    if rows.is_empty():
        return None
    place: lidar.Vector = rows.select("x_m", "y_m", "z_m").to_numpy().mean(axis=0)
    return place if np.all(np.isfinite(place)) else None


def _against_run(other: Folder, rows: Sequence[Measured]) -> Iterator[Row]:
    theirs = lidar.of_steps(other.steps)
    for each in rows:
        for twin in theirs:
            if twin.row["step"] == each.row["step"] and _is_same(twin.row["s_m"], each.row["s_m"]):
                yield _row(each, other.path.name, "total", each.total, twin.total[0])
                yield from _components(each, other.path.name, twin.deflection_m)


def _row(
    each: Measured, source: str, quantity: str, own: tuple[float, float], reference_m: float | None
) -> Row:
    head = {key: each.row[key] for key in ("time", "t_s", "step", "section", "s_m")}
    values = {"measured_m": own[0], "u_m": own[1], "reference_m": reference_m}
    return {**head, "source": source, "quantity": quantity, **values}


def _table(rows: Sequence[Row]) -> pl.DataFrame:
    frame = pl.DataFrame(list(rows), infer_schema_length=None)
    frame = frame.with_columns(pl.col("reference_m").cast(pl.Float64))
    largest = frame.select(pl.col("reference_m").abs().max().over("source")).to_series()
    small = (frame["reference_m"].abs() <= NEGLIGIBLE * largest).fill_null(value=True)
    errors = error_percent(frame["measured_m"].to_numpy(), frame["reference_m"].to_numpy())
    return tables.build(
        "comparison", frame.with_columns(error_percent=np.where(small, np.nan, errors))
    )
