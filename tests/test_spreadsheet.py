"""Are workbook and CSV files equal to the tables?"""

import csv
import math
from pathlib import Path
from typing import Any

import openpyxl
import polars as pl
import pytest

import beam_folders
import folders
from lidar_deflect import tables
from lidar_deflect.errors import MissingExtraError
from lidar_deflect.report import csvs, spreadsheet

pytest.importorskip("xlsxwriter", reason="the extra xlsx is not installed")


def columns_of(sheet: Any) -> dict[str, list[Any]]:
    _units, names, *rows = sheet.iter_rows(values_only=True)
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def test_every_table_stands_in_the_workbook_with_its_units(tmp_path: Path) -> None:
    folder = beam_folders.write(tmp_path / "results")
    path = spreadsheet.write(folder, tmp_path / "report.xlsx")
    book = openpyxl.load_workbook(path)
    for file in folder.glob("*.parquet"):
        declared = tables.SCHEMAS[file.stem]
        sheet = book[file.stem]
        units = [cell.value or "" for cell in sheet[1]]
        assert [cell.value for cell in sheet[2]] == list(declared.names)
        assert units == ["" if c.unit == "name" else c.unit for c in declared.columns]


@pytest.mark.parametrize("name", ["steps", "deflection", "comparison", "health", "channels"])
def test_numbers_are_those_of_the_table(tmp_path: Path, name: str) -> None:
    folder = beam_folders.write(tmp_path / "results")
    book = openpyxl.load_workbook(spreadsheet.write(folder, tmp_path / "report.xlsx"))
    frame = tables.read(folder / f"{name}.parquet")
    if name in ("steps", "deflection"):
        frame = frame.sort("s_m", "section", "time", maintain_order=True)
    found = columns_of(book[name])
    for column, dtype in frame.schema.items():
        own = frame[column]
        if isinstance(dtype, pl.Datetime):
            own = own.dt.replace_time_zone(None).dt.cast_time_unit("us")
            off = [abs((a - b).total_seconds()) for a, b in zip(found[column], own, strict=True)]
            assert max(off) < 1e-3
        elif dtype.is_numeric():
            for a, b in zip(found[column], own, strict=True):
                assert (a is None) == (b is None)
                assert a is None or math.isclose(a, b, rel_tol=1e-14)
        else:
            assert [a or None for a in found[column]] == [b or None for b in own.cast(pl.String)]


def test_numbers_have_the_format_of_their_unit_and_curves_a_chart(tmp_path: Path) -> None:
    folder = beam_folders.write(tmp_path / "results")
    book = openpyxl.load_workbook(spreadsheet.write(folder, tmp_path / "report.xlsx"))
    sheet = book["steps"]
    formats = {cell.value: sheet.cell(3, cell.column).number_format for cell in sheet[2]}
    assert formats["d_m"] == "0.0000"
    assert formats["time"] == "yyyy-mm-dd hh:mm:ss.000"
    assert formats["n_points"] == "#,##0"
    assert len(book["charts"]._charts) == len(beam_folders.SECTIONS) + 1
    assert [len(chart.series) for chart in book["charts"]._charts] == [3, 3, 3, 3]


def test_the_key_table_has_its_uncertainty_beside_each_value(tmp_path: Path) -> None:
    folder = beam_folders.write(tmp_path / "results")
    book = openpyxl.load_workbook(spreadsheet.write(folder, tmp_path / "report.xlsx"))
    found = columns_of(book["key"])
    steps = tables.read(folder / "steps.parquet")
    assert found["total"] == pytest.approx([1e3 * d for d in steps["d_m"]], rel=1e-12)
    assert found["U(total)"] == pytest.approx([2e3 * u for u in steps["ud_m"]], rel=1e-12)
    assert "Within" in str([cell.value for cell in book["report"]["B"]])


def test_hostile_names_are_text_and_no_formula(tmp_path: Path) -> None:
    bad = '=HYPERLINK("http://x.invalid","y")'
    folder = folders.write(tmp_path / "results", folders.deflection({bad: (84.0, 3.0, 0.1, 0.0)}))
    book = openpyxl.load_workbook(spreadsheet.write(folder, tmp_path / "report.xlsx"))
    cells = [row[0] for row in book["steps"].iter_rows(min_row=3, min_col=7, max_col=7)]
    assert {cell.value for cell in cells} == {bad}
    assert {cell.data_type for cell in cells} == {"s"}


def test_long_tables_are_thinned_and_the_workbook_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(spreadsheet, "MOST_ROWS", 500)
    folder = beam_folders.write(tmp_path / "results")
    book = openpyxl.load_workbook(spreadsheet.write(folder, tmp_path / "report.xlsx"))
    assert book["deflection"].max_row - 2 == 450  # 1800 rows, every fourth
    assert "Every 4. of 1800 rows" in str([cell.value for cell in book["report"]["B"]])


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "xlsxwriter", None)
    folder = folders.write(tmp_path / "results")
    with pytest.raises(MissingExtraError) as caught:
        spreadsheet.write(folder, tmp_path / "report.xlsx")
    assert caught.value.hint == "pip install 'lidar-deflect[xlsx]'"
    assert not (tmp_path / "report.xlsx").exists()


def test_csv_files_hold_the_tables(tmp_path: Path) -> None:
    folder = beam_folders.write(tmp_path / "results")
    out = csvs.write(folder, tmp_path / "csv")
    for file in folder.glob("*.parquet"):
        frame = tables.read(file)
        read = pl.read_csv(out / f"{file.stem}.csv", infer_schema_length=None)
        assert read.columns == frame.columns
        assert read.height == frame.height
        for name, dtype in frame.schema.items():
            if dtype.is_float() and frame[name].null_count() < frame.height:
                assert read[name].cast(pl.Float64).equals(frame[name], null_equal=True), name
    first = pl.read_csv(out / "steps.csv")["time"][0]
    assert first.startswith("2024-06-10T06:13:2")
    assert first.endswith("Z")
    with (out / "report_key.csv").open(encoding="utf-8") as file:
        head, *rows = list(csv.reader(file))
    steps = tables.read(folder / "steps.parquet")
    place = head.index("total (mm)")
    assert head[place + 1] == "U total (mm)"
    assert [float(row[place]) for row in rows] == pytest.approx([1e3 * d for d in steps["d_m"]])
