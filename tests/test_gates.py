"""Are the gates of a run judged whatever its length?"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import polars as pl

from lidar_deflect.provenance import _lost_percent


def test_losses_are_added_up_over_many_minutes() -> None:
    seconds = 600  # of two lidars: polars adds up more than a thousand rows in another way
    start = datetime(2026, 12, 1, tzinfo=UTC)
    rows = [(start + timedelta(seconds=k), lidar) for k in range(seconds) for lidar in ("L1", "L2")]
    schema = {"time": pl.Datetime("ns", "UTC"), "lidar": pl.String}
    health = pl.DataFrame(rows, schema=schema, orient="row")
    health = health.with_columns(lost=pl.lit(1), packets=pl.lit(3), comment=pl.lit("ok"))
    assert _lost_percent(health) == {"L1": 25.0, "L2": 25.0}  # one of four is lost
