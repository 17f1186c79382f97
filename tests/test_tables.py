import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from lidar_deflect import tables
from lidar_deflect.errors import InvalidValueError, OutputError, ResultError, ResultNotFoundError

ROOT = Path(__file__).parent.parent
METADATA = {tables.HASH_KEY: "ab" * 32}
START_NS = 1_718_000_000_255_000_001


def channel_columns() -> dict[str, tables.Values]:
    return {
        "unit": ["mm", "mm", "mm"],
        "time": START_NS + np.arange(3, dtype=np.int64) * 100_000_000,
        "t_s": np.array([0.0, 0.1, 0.2]),
        "channel": ["W84"] * 3,
        "value": np.array([1.0, np.nan, 3.0]),
    }


def test_columns_come_in_declared_order_and_types_and_nan_becomes_null() -> None:
    frame = tables.build("channels", channel_columns())
    assert frame.schema == tables.SCHEMAS["channels"].schema
    assert frame["value"].to_list() == [1.0, None, 3.0]
    assert frame["time"].cast(pl.Int64).to_list()[0] == START_NS


def test_instants_of_another_zone_are_turned_to_utc() -> None:
    columns = channel_columns()
    noon = datetime(2024, 6, 10, 12, tzinfo=UTC)
    columns["time"] = pl.Series(
        [noon + timedelta(seconds=k) for k in range(3)]
    ).dt.convert_time_zone("Asia/Shanghai")
    assert tables.build("channels", columns)["time"][0] == noon


@pytest.mark.parametrize(
    ("change", "code", "word"),
    [
        ({"vlaue": [1.0, 2.0, 3.0]}, "table.unknown_column", "vlaue"),
        ({"t_s": [0.0, 0.1]}, "table.length", "differ in length"),
        ({"t_s": [0.0, None, 0.2]}, "table.null", "row 1"),
        ({"t_s": ["a", "b", "c"]}, "table.type", "t_s"),
        ({"time": [1718000000.2] * 3}, "table.type", "time"),
    ],
)
def test_a_column_that_is_not_as_declared_is_refused_by_name(
    change: dict[str, tables.Values], code: str, word: str
) -> None:
    with pytest.raises(InvalidValueError, match=word) as caught:
        tables.build("channels", {**channel_columns(), **change})
    assert caught.value.code == code


def test_a_misspelt_column_is_answered_with_the_nearest() -> None:
    with pytest.raises(InvalidValueError) as caught:
        tables.build("channels", {**channel_columns(), "vlaue": None})
    assert caught.value.hint == "did you mean 'value'?"


def test_a_column_left_out_is_an_error_and_none_says_all_missing() -> None:
    columns = channel_columns()
    columns["value"] = None
    assert tables.build("channels", columns)["value"].null_count() == 3
    del columns["value"]
    with pytest.raises(InvalidValueError, match="lacks value"):
        tables.build("channels", columns)


def test_a_negative_count_and_an_unknown_status_do_not_fit() -> None:
    names = tables.SCHEMAS["rejected"].names
    row = dict.fromkeys(names) | {"time": [0], "t_s": [0.0], "reason": ["cable"], "count": [-1]}
    with pytest.raises(InvalidValueError, match="count"):
        tables.build("rejected", row)
    contour = dict.fromkeys(tables.SCHEMAS["contour"].names)
    with pytest.raises(InvalidValueError, match="status"):
        tables.build(
            "contour", contour | {"time": [0], "t_s": [0.0], "s_m": [1.0], "status": ["fine"]}
        )


def test_no_declared_float_of_a_table_without_rows_is_lost() -> None:
    for name in tables.SCHEMAS:
        assert tables.build(name, tables.empty(name)).schema == tables.SCHEMAS[name].schema


def test_a_table_survives_the_disk_with_what_it_says_about_itself(tmp_path: Path) -> None:
    frame = tables.build("channels", channel_columns())
    path = tables.write(frame, tmp_path / "channels.parquet", {**METADATA, "method": "paper"})
    assert tables.read(path).equals(frame)
    facts = tables.metadata(path)
    assert facts["lidar_deflect.schema_version"] == str(tables.SCHEMA_VERSION)
    assert facts["lidar_deflect.table"] == "channels"
    assert facts["configuration_hash"] == METADATA["configuration_hash"]
    assert facts["method"] == "paper"
    assert [each.name for each in tmp_path.iterdir()] == ["channels.parquet"]


def test_an_enumerated_status_survives_the_disk(tmp_path: Path) -> None:
    columns = dict.fromkeys(tables.SCHEMAS["contour"].names)
    frame = tables.build(
        "contour", columns | {"time": [0], "t_s": [0.0], "s_m": [84.0], "status": ["missing"]}
    )
    path = tables.write(frame, tmp_path / "contour.parquet", METADATA)
    assert tables.read(path).schema["status"] == pl.Enum(tables.STATUSES)


def test_a_frame_of_another_shape_is_not_written(tmp_path: Path) -> None:
    frame = tables.build("channels", channel_columns())
    with pytest.raises(InvalidValueError, match="lacks unit"):
        tables.write(frame.drop("unit"), tmp_path / "channels.parquet", METADATA)
    with pytest.raises(InvalidValueError, match="not as declared"):
        tables.write(frame.cast({"t_s": pl.Float32}), tmp_path / "channels.parquet", METADATA)
    with pytest.raises(InvalidValueError, match="configuration_hash"):
        tables.write(frame, tmp_path / "channels.parquet", {})
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_leaves_a_named_error_and_no_file(tmp_path: Path) -> None:
    frame = tables.build("channels", channel_columns())
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(OutputError) as caught:
        tables.write(frame, tmp_path / "file" / "channels.parquet", METADATA)
    assert caught.value.exit_code == 7
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


def test_only_tables_of_this_schema_are_read(tmp_path: Path) -> None:
    path = tmp_path / "channels.parquet"
    with pytest.raises(ResultNotFoundError):
        tables.read(path)
    path.write_bytes(b"PAR1 not really")
    with pytest.raises(ResultError, match="cannot be read"):
        tables.read(path)
    frame = tables.build("channels", channel_columns())
    frame.write_parquet(path)
    with pytest.raises(ResultError, match="not a table of this version"):
        tables.read(path)
    frame.write_parquet(
        path,
        metadata={"lidar_deflect.schema_version": "99", "lidar_deflect.table": "channels"},
    )
    with pytest.raises(ResultError) as caught:
        tables.read(path)
    assert caught.value.facts[0] == ("found", "schema 99, table channels")


def test_a_table_of_another_name_is_refused(tmp_path: Path) -> None:
    path = tables.write(tables.empty("steps"), tmp_path / "odd.parquet", METADATA, name="steps")
    with pytest.raises(ResultError, match="holds the table steps, not deflection"):
        tables.read(path, name="deflection")


def test_the_page_of_the_tables_is_current() -> None:
    # .venv/bin/python -c "from lidar_deflect import tables; print(tables.markdown(), end='')"
    assert (ROOT / "docs" / "tables.md").read_text() == tables.markdown()


def test_every_column_has_a_unit_in_its_name_or_says_what_it_is() -> None:
    suffixes = {"m": "_m", "deg": "_deg", "rad": "_rad", "mrad": "_mrad", "mm": "_mm", "s": "_s"}
    suffixes |= {"Hz": "_hz"}
    for table in tables.SCHEMAS.values():
        for column in table.columns:
            assert column.meaning
            assert column.name.endswith(suffixes.get(column.unit, "")), (table.name, column.name)


def test_the_json_schema_says_type_unit_and_null_of_each_column() -> None:
    document = json.loads(json.dumps(tables.json_schema()))
    assert document["schema"] == "lidar-deflect/tables/1"
    rows = document["$defs"]["deflection"]["items"]
    assert rows["properties"]["dx_m"] == {
        "type": ["number", "null"],
        "description": "deflection: position minus the reference, x",
        "x-unit": "m",
    }
    assert rows["properties"]["status"]["enum"] == list(tables.STATUSES)
    assert rows["required"] == list(tables.SCHEMAS["deflection"].names)
