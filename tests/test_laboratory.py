"""Does every file of a laboratory give the same channel, whatever program wrote it?"""

import sys
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from lidar_deflect import channels, delimited
from lidar_deflect.errors import ConfigError, MissingExtraError

START = datetime(2024, 6, 10, 6, 13, 20, 255000, tzinfo=UTC)
START_NS = 1_718_000_000_255_000_000
STEP_NS = 100_000_000
COUNT = 240
LOAD = np.round(np.interp(np.arange(COUNT), [40, 80, 120, 160], [0.0, 40.0, 40.0, 100.0]), 3)
TIMES_NS = START_NS + STEP_NS * np.arange(COUNT)
MOMENTS = [START + timedelta(milliseconds=100 * k) for k in range(COUNT)]


def csv_of(rows: list[str], head: str, separator: str, line_end: str = "\n") -> str:
    return line_end.join([head, *rows]).replace("\x00", separator) + line_end


def text(folder: Path, content: str, encoding: str = "utf-8") -> Path:
    path = folder / "channel.csv"
    path.write_bytes(content.encode(encoding))
    return path


def german(folder: Path) -> Path:
    """Text above the header, units below it, semicolons, decimal commas, day first, Latin-1."""
    rows = [
        f"{m:%d.%m.%Y %H:%M:%S},{m.microsecond // 1000:03d};{v:.3f};".replace(".", ",", 0)
        for m, v in zip(MOMENTS, LOAD, strict=True)
    ]
    rows = [row.rsplit(";", 2)[0] + ";" + row.rsplit(";", 2)[1].replace(".", ",") for row in rows]
    head = "Prüfstand 3;Messung 17\nAbtastrate: 10 Hz\n\nZeit;load_percent\n;%"
    return text(folder, "\r\n".join([head.replace("\n", "\r\n"), *rows]), "latin-1")


def two_columns(folder: Path) -> Path:
    rows = [f"{m:%Y/%m/%d}\t{m:%H:%M:%S.%f}\t{v}" for m, v in zip(MOMENTS, LOAD, strict=True)]
    return text(folder, csv_of(rows, "Date\tTime\tload_percent", "\t"), "utf-16")


def of_day(folder: Path) -> Path:
    rows = [f"{m:%H:%M:%S.%f},{v}" for m, v in zip(MOMENTS, LOAD, strict=True)]
    return text(folder, csv_of(rows, "clock,load_percent", ","))


def parquet(folder: Path) -> Path:
    path = folder / "channel.parquet"
    pl.DataFrame({"t": MOMENTS, "load_percent": LOAD}).write_parquet(path)
    return path


def workbook_of_openpyxl(folder: Path) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["a sheet of notes"])
    sheet = book.create_sheet("data")
    sheet.append(["Test 17", None])
    sheet.append(["t", "load_percent"])
    for moment, value in zip(MOMENTS, LOAD, strict=True):
        sheet.append([moment.replace(tzinfo=None), float(value)])
    path = folder / "channel.xlsx"
    book.save(path)
    return path


def workbook_of_xlsxwriter(folder: Path) -> Path:
    pytest.importorskip("xlsxwriter")
    path = folder / "channel.xlsx"
    frame = pl.DataFrame({"t": MOMENTS, "load_percent": LOAD})
    frame.with_columns(pl.col("t").dt.replace_time_zone(None)).write_excel(path)
    return path


def tdms(folder: Path) -> Path:
    nptdms = pytest.importorskip("nptdms")
    path = folder / "channel.tdms"
    properties = {"wf_start_time": np.datetime64(START_NS, "ns"), "wf_increment": 0.1}
    slow = {"wf_start_time": np.datetime64(START_NS, "ns"), "wf_increment": 1.0}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("slow", "temperature", np.arange(24.0), slow),
                nptdms.ChannelObject("winch", "load_percent", LOAD, properties),
            ]
        )
    return path


def mdf(folder: Path) -> Path:
    asammdf = pytest.importorskip("asammdf")
    path = folder / "channel.mf4"
    seconds = 0.1 * np.arange(COUNT)
    with asammdf.MDF(version="4.10") as file:
        file.header.start_time = START
        file.append([asammdf.Signal(np.arange(24.0), np.arange(24.0), name="temperature")])
        file.append([asammdf.Signal(LOAD, seconds, name="load_percent", unit="%")])
        file.save(path, overwrite=True)
    return path


def hdf5(folder: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    path = folder / "channel.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("daq/winch")
        group.create_dataset("t", data=TIMES_NS).attrs["units"] = "ns"
        group.create_dataset("load_percent", data=LOAD)
        file.create_dataset("daq/slow/temperature", data=np.arange(1000.0))
    return path


def hdf5_records(folder: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    path = folder / "records.h5"
    records = np.zeros(COUNT, dtype=[("t", "f8"), ("load_percent", "f4")])
    records["t"], records["load_percent"] = TIMES_NS * 1e-9, LOAD
    with h5py.File(path, "w") as file:
        file.create_dataset("measured", data=records)
    return path


FORMATS: dict[str, tuple[Callable[[Path], Path], str]] = {
    "german": (german, "Zeit"),
    "date and time apart": (two_columns, "Date+Time"),
    "time of day": (of_day, "clock"),
    "parquet": (parquet, "t"),
    "openpyxl": (workbook_of_openpyxl, "t"),
    "xlsxwriter": (workbook_of_xlsxwriter, "t"),
    "tdms": (tdms, "time"),
    "mdf4": (mdf, "time"),
    "hdf5": (hdf5, "t"),
    "hdf5 records": (hdf5_records, "t"),
}


@pytest.mark.parametrize("name", FORMATS)
def test_a_load_is_the_same_in_every_format(tmp_path: Path, name: str) -> None:
    make, time = FORMATS[name]
    near = START_NS + 7 * 3600 * 10**9  # dates a time of day, by the nearest day
    found = channels.read_load(make(tmp_path), time=time, value="load_percent", near_ns=near)
    assert found.value == pytest.approx(LOAD, abs=1e-5)
    # f64 seconds are good to 0.2 us, a workbook's days to some microseconds
    assert np.max(np.abs(found.time_ns - TIMES_NS)) <= 10_000


def test_the_name_of_a_file_does_not_matter(tmp_path: Path) -> None:
    path = tdms(tmp_path).rename(tmp_path / "channel.csv")
    assert delimited.read(path, ["load_percent"]).height == COUNT


def test_a_time_of_day_without_a_day_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="times of day without a date"):
        channels.read_load(of_day(tmp_path), time="clock", value="load_percent")


def test_midnight_starts_a_new_day(tmp_path: Path) -> None:
    path = text(tmp_path, "clock,a\n23:59:59.5,1\n00:00:00.5,2\n")
    near = START_NS // (86_400 * 10**9) * 86_400 * 10**9
    times = delimited.instants(delimited.read(path), "clock", path, near)
    assert np.diff(times).tolist() == [10**9]
    assert times[0] == near - 500_000_000


def test_a_separator_that_is_a_decimal_sign_too_is_refused(tmp_path: Path) -> None:
    path = text(tmp_path, "time_utc_s,load_percent\n1718000000,25,0,5\n1718000001,25,0,6\n")
    with pytest.raises(ConfigError):
        channels.read_load(path, value="load_percent")


@pytest.mark.parametrize(("make", "module"), [(tdms, "nptdms"), (mdf, "asammdf"), (hdf5, "h5py")])
def test_a_missing_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: Callable[[Path], Path], module: str
) -> None:
    path = make(tmp_path)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError) as caught:
        delimited.read(path)
    assert caught.value.hint == "pip install 'lidar-deflect[daq]'"
    assert path.name in str(caught.value)


def test_a_broken_workbook_is_an_error_with_its_name(tmp_path: Path) -> None:
    path = tmp_path / "channel.xlsx"
    path.write_bytes(b"PK\x03\x04" + bytes(100))
    with pytest.raises(ConfigError, match=r"channel\.xlsx"):
        delimited.read(path)


def test_other_instruments_reach_tables_and_report(tmp_path: Path) -> None:
    """A strain gauge and an inclinometer of the root, from one TDMS file and a CSV."""
    from lidar_deflect import config as configs
    from lidar_deflect import instruments
    from lidar_deflect.folder import Folder
    from lidar_deflect.plots import Plots

    tdms(tmp_path)
    (tmp_path / "test.toml").write_text(
        '[blade]\nlength_m = 110.0\n[[lidars]]\nid = "L1"\n'
        '[[channels]]\nname = "strain-30"\nfile = "channel.tdms"\ntime = "time"\n'
        'column = "load_percent"\nunit = "um/m"\nshift_s = 0.5\n'
        '[[channels]]\nname = "hall"\nfile = "channel.tdms"\ntime = "time"\n'
        'column = "temperature"\nunit = "°C"\n'
    )
    strain, hall = instruments.others(configs.load(tmp_path / "test.toml"))
    assert strain.time_ns[0] == START_NS + 500_000_000
    assert (strain.unit, hall.unit) == ("um/m", "°C")
    assert hall.value.size == 24
    import folders

    table = channels.to_table([strain, hall], START_NS)
    folder = folders.write(tmp_path / "results", channels=table)
    figure = Plots(Folder(folder)).channels()
    assert [trace.name for trace in figure.data] == ["strain-30", "hall"]
    assert figure.layout.yaxis2.title.text == "reading (°C)"
