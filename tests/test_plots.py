from dataclasses import dataclass, field
from typing import Any

import numpy as np
import plotly.graph_objects as go
import polars as pl
import pytest

import folders
from lidar_deflect import tables
from lidar_deflect.errors import InvalidValueError
from lidar_deflect.plots import Plots, style


@dataclass
class Result:
    """What figures need of a result, and no more."""

    deflection: pl.DataFrame
    steps: pl.DataFrame
    health: pl.DataFrame = field(default_factory=folders.health)
    comparison: pl.DataFrame | None = None
    contour: pl.DataFrame | None = None
    outline: pl.DataFrame | None = None
    points: pl.DataFrame | None = None
    config: dict[str, Any] | None = None
    calibration: dict[str, Any] | None = None


def result(frame: pl.DataFrame | None = None, **more: Any) -> Result:
    frame = folders.deflection() if frame is None else frame
    return Result(frame, folders.step_table(frame), **more)


def trace(figure: go.Figure, name: str) -> Any:
    return next(each for each in figure.data if each.name == name)


def test_a_time_series_has_the_three_components_of_its_section_with_gaps() -> None:
    figure = Plots(result()).time_series("S84")
    lines = [each for each in figure.data if each.mode == "lines"]
    assert [each.name for each in lines] == ["x", "y", "z"]
    x = np.array(lines[0].y, dtype=float)
    assert x[-1] == pytest.approx(3.28)
    assert np.isnan(x).sum() == 5  # the frames of the overhead stretch that were not filled
    assert not lines[0].connectgaps
    assert [axis.title.text for axis in (figure.layout.yaxis, figure.layout.yaxis3)] == [
        "dx (m)",
        "dz (m)",
    ]
    assert figure.layout.xaxis3.title.text == "time (s)"


def test_the_tip_is_the_outermost_section_unless_one_is_called_so() -> None:
    only = result(folders.deflection(folders.SHAPE))
    assert Plots(only).time_series("tip").layout.meta["section"] == "S100"
    assert Plots(only).time_series().layout.meta["section"] == "S100"
    assert Plots(only).time_series(84.0).layout.meta["section"] == "S84"
    with pytest.raises(InvalidValueError, match="no section 'S48'") as caught:
        Plots(only).time_series("S48")
    assert caught.value.hint == "did you mean 'S84'?"


def test_statuses_are_marked_and_missing_stretches_tinted() -> None:
    figure = Plots(result()).time_series("S84")
    marks = trace(figure, "interpolated")
    assert set(marks.text) == {"overhead"}
    assert len(marks.x) == 6
    assert trace(figure, "missing").showlegend is None
    # three holds on three panels, and one missing stretch on three panels
    assert len(figure.layout.shapes) == 3 * 3 + 3
    assert [each.text for each in figure.layout.annotations] == ["0 %", "40 %", "100 %"]


def test_the_band_of_uncertainty_is_drawn_where_there_is_one() -> None:
    frame = folders.deflection(u_m=0.01, overhead_s=None)
    figure = Plots(result(frame)).time_series("S84")
    bands = [each for each in figure.data if each.fill == "toself"]
    assert len(bands) == 3
    width = np.ptp(np.array(bands[0].y, dtype=float)[[0, -1]])
    assert width == pytest.approx(2 * 1.96 * 0.01)
    assert not [e for e in Plots(result()).time_series().data if e.fill == "toself"]


def test_positions_are_drawn_on_demand() -> None:
    figure = Plots(result()).time_series("S84", quantity="position")
    assert np.nanmax(np.array(trace(figure, "z").y, dtype=float)) == pytest.approx(84.0)
    assert figure.layout.yaxis.title.text == "x (m)"


def test_long_series_are_thinned() -> None:
    frame = folders.deflection(folders.TIP)
    many = pl.concat([frame.with_columns(pl.col("t_s") + 20.0 * k) for k in range(100)])
    figure = Plots(Result(many, folders.step_table(frame))).time_series()
    assert 500 < len(figure.data[0].x) <= 6000


def test_thinning_keeps_every_peak_and_every_gap() -> None:
    frame = folders.deflection(folders.TIP, overhead_s=None)
    many = pl.concat([frame.with_columns(pl.col("t_s") + 20.0 * k) for k in range(100)])
    peak = many.with_row_index().with_columns(
        dx_m=pl.when(pl.col("index") == 12_345).then(99.0).otherwise(pl.col("dx_m")),
        dz_m=pl.when(pl.col("index") == 7_654).then(None).otherwise(pl.col("dz_m")),
    )
    thin = style.thinned(peak, ["dx_m", "dy_m", "dz_m"], 600)
    assert thin.height < 800
    assert thin["dx_m"].max() == 99.0
    assert thin["dz_m"].null_count() == 1
    assert thin["t_s"].is_sorted()


def compared(*rows: tuple[str, str, str, float, float]) -> pl.DataFrame:
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["comparison"].names)
    columns |= {"time": [folders.EPOCH_NS] * len(rows), "t_s": [0.0] * len(rows)}
    columns |= {"step": ["100 %"] * len(rows), "s_m": [84.0] * len(rows)}
    names = ("section", "source", "quantity", "measured_m", "reference_m")
    columns |= dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))
    measured, reference = (np.array(columns[name]) for name in names[3:])
    columns |= {"error_percent": 100.0 * (measured - reference) / reference}
    return tables.build("comparison", columns)


def test_errors_are_drawn_by_method_as_in_the_papers_figure_20() -> None:
    frame = compared(
        ("S84", "W84", "total", 3.318, 3.094), ("S84", "prediction", "total", 3.318, 3.273)
    )
    figure = Plots(result(comparison=frame)).comparison()
    assert {bar.name: round(bar.y[0], 2) for bar in figure.data} == {
        "wire against prediction": -5.47,
        "lidar against prediction": 1.37,
    }
    assert figure.layout.yaxis.title.text == "error (%)"


def test_without_a_trusted_reference_lidar_is_drawn_against_each_source() -> None:
    frame = compared(("S84", "W84", "wire", 3.1, 3.0), ("S84", "W84", "total", 3.3, 3.0))
    figure = Plots(result(comparison=frame)).comparison()
    assert [bar.name for bar in figure.data] == [
        "lidar against W84, wire",
        "lidar against W84, total",
    ]


def test_load_deflection_has_path_line_and_holds_per_section() -> None:
    figure = Plots(result(folders.deflection(u_m=0.01))).load_deflection()
    # path and line above, path and holds below, holds above
    assert len(figure.data) == 5 * 3
    assert list(figure.data[-1].x) == pytest.approx([0.0, 40.0, 100.0])
    assert figure.data[-1].error_y.array[0] == pytest.approx(0.0196)
    # the invented blade is linear: its holds lie on the line
    assert np.max(np.abs(np.array(figure.data[-2].y, dtype=float))) < 0.3


def test_shapes_are_drawn_from_the_blade_line_where_there_is_one() -> None:
    own = result()
    figure = Plots(own).deflected_shapes()
    assert [each.name for each in figure.data[::4]] == ["0 %", "40 %", "100 %"]
    assert len(figure.data[0].x) == 3  # sections alone
    times = own.steps["time"].unique().sort()
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["contour"].names)
    columns |= {
        "time": times.repeat_by(50).explode(),
        "t_s": own.steps["t_s"].unique().sort().repeat_by(50).explode(),
    }
    columns |= {"s_m": np.tile(np.linspace(60.0, 110.0, 50), 3), "status": ["ok"] * 150}
    columns |= {f"{axis}_m": np.zeros(150) for axis in "xyz"}
    own.contour = tables.build("contour", columns)
    assert len(Plots(own).deflected_shapes().data[0].x) == 50


def test_rotations_that_a_method_did_not_write_are_those_of_its_line() -> None:
    import beam_folders
    from lidar_deflect.plots import spans

    frame = beam_folders.deflection()
    steps = folders.step_table(frame)
    line = beam_folders.contour(frame)
    bare = line.with_columns(rx_rad=pl.lit(None, pl.Float64), ry_rad=pl.lit(None, pl.Float64))
    found = spans.sloped(bare, steps).sort("time", "s_m")
    true = line.sort("time", "s_m")["ry_rad"].to_numpy()
    # the line bends by 0.11 rad at most; differences of stations 2 m apart are good to 0.5 mrad
    assert np.max(np.abs(found["ry_rad"].to_numpy() - true)) < 1.5e-3
    assert spans.sloped(line, steps) is line


def test_health_shows_loss_in_percent_of_what_was_due() -> None:
    figure = Plots(result()).health()
    lost = trace(figure, "L2")
    assert max(lost.y) == pytest.approx(100.0 * 75 / 754)
    assert figure.layout.yaxis2.title.text == "points (1/s)"


def test_the_plan_shows_lidars_and_anchors_where_they_are_known() -> None:
    config = {
        "lidars": [{"id": "L1", "position_m": [3.0, -6.8, 86.0]}, {"id": "L2"}],
        "wires": [{"name": "W84", "anchor_m": [42.0, -7.1, 84.0]}],
    }
    figure = Plots(result(config=config)).plan()
    assert (list(trace(figure, "lidar").x), list(trace(figure, "lidar").y)) == ([86.0], [3.0])
    assert list(trace(figure, "wire anchor").text) == ["W84"]


def registered() -> dict[str, Any]:
    """Two lidars, the first four times as sure along z as along x, and what their rays left."""
    covariance = np.diag([1e-8] * 3 + [16e-6, 1e-6, 1e-6]).tolist()
    lidars = [
        {"id": name, "world_from_sensor": pose_at(3.0, -6.8, z_m), "covariance": covariance}
        for name, z_m in (("L1", 86.0), ("L2", 94.0))
    ]
    cells = {
        "surface": "ground",
        "across": "x_m",
        "lidar": ["L1", "L1", "L2"],
        "z_m": [86.25, 88.75, 93.75],
        "across_m": [1.25, 1.25, -3.75],
        "mean_mm": [0.4, -0.2, 6.0],
        "rays": [120, 80, 10],
    }
    return {"lidars": lidars, "evidence": {"cells": [cells]}}


def pose_at(x_m: float, y_m: float, z_m: float) -> list[list[float]]:
    return [[1.0, 0, 0, x_m], [0, 1.0, 0, y_m], [0, 0, 1.0, z_m], [0, 0, 0, 1.0]]


def test_ellipses_of_the_lidars_are_enlarged_by_what_the_legend_says() -> None:
    figure = Plots(result(calibration=registered())).plan()
    drawn = [t for t in figure.data if t.legendgroup == "ellipse"]
    assert len(drawn) == 2
    times = int(drawn[0].name.split(", ")[1].split()[0])
    # Semi-axes of 95 %: 2.448 standard deviations, 1 mm along z and 4 mm along x.
    assert np.ptp(drawn[0].x) == pytest.approx(2 * 2.448e-3 * times, rel=1e-3)
    assert np.ptp(drawn[0].y) == pytest.approx(2 * 4 * 2.448e-3 * times, rel=1e-3)


def test_residuals_of_the_yard_stand_where_their_rays_ended() -> None:
    plots = Plots(result(calibration=registered()))
    drawn = [each for each in plots.yard_residuals().data if len(each.x)]
    found = {(each.name, *each.x): list(each.y) for each in drawn}
    assert found == {("-1 to 1 mm", 86.25, 88.75): [1.25, 1.25], ("above 3 mm", 93.75): [-3.75]}
    assert list(trace(plots.lidar_shares(), "ground").y) == [200, 10]


DRAWN = (
    "time_series",
    "wires",
    "channels",
    "load_deflection",
    "creep",
    "deflected_shapes",
    "rotation",
    "plan",
    "pose_uncertainty",
    "yard_residuals",
    "lidar_shares",
    "drift",
    "residuals",
    "residual_map",
    "section_cut",
    "comparison",
    "health",
    "cycles",
)


@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize(
    "frame",
    [
        folders.deflection(folders.TIP, load=False),
        folders.deflection(folders.TIP, overhead_s=(0.0, 19.0)),
        folders.deflection(folders.TIP).head(1),
    ],
    ids=["no load", "nearly nothing measured", "one state"],
)
def test_every_figure_is_drawn_for_poor_results(name: str, frame: pl.DataFrame) -> None:
    poor = Result(frame, folders.step_table(frame), tables.empty("health"))
    figure = getattr(Plots(poor), name)()
    assert figure.to_json()
    for axis in [*figure.select_xaxes(), *figure.select_yaxes()]:
        assert axis.visible is False or axis.title.text is not None or axis.matches is not None


@pytest.mark.parametrize("name", DRAWN)
def test_hostile_names_stay_text(name: str) -> None:
    bad = "<script>alert(1)</script>"
    frame = folders.deflection({bad: (84.0, 3.0, 0.1, 0.0)})
    own = result(
        frame, comparison=compared((bad, bad, "total", 1.0, 2.0)), health=folders.health([bad])
    )
    own.config = {"lidars": [{"id": bad, "position_m": [0, 0, 0]}]}
    assert "<script" not in getattr(Plots(own), name)().to_json()


def test_the_palette_keeps_its_distance_and_changes_dash_when_it_starts_again() -> None:
    assert len({(style.colour(k), style.dash(k)) for k in range(16)}) == 16
    assert style.translucent("#0072B2", 0.5) == "rgba(0,114,178,0.5)"
    assert style.stretches([True, True, False, True]) == [(0, 1), (3, 3)]


def surface_of(step: str = "100 %") -> tuple[Result, pl.DataFrame]:
    import beam_folders

    own = result(beam_folders.deflection())
    own.outline = beam_folders.outline(own.steps)
    row = own.steps.filter(pl.col("step") == step, pl.col("section") == "S100").row(0, named=True)
    columns: dict[str, tables.Values] = dict.fromkeys(tables.SCHEMAS["points"].names)
    columns |= {"time": [row["from"]] * 4, "t_s": [row["t_s"]] * 4, "lidar": ["L1"] * 4}
    columns |= {"ring": [3] * 4, "s_m": [100.0, 100.1, 99.9, 103.0], "residual_m": [0.002] * 4}
    columns |= {"x_m": row["x_m"] + np.array([0.5, 0.0, -0.5, 0.0])}
    columns |= {"y_m": [row["y_m"] - 0.2] * 4, "z_m": [row["z_m"]] * 4, "chord": [-0.5] * 4}
    own.points = tables.build("points", columns)
    return own, own.outline


def test_a_section_cut_shows_outline_band_and_the_points_near_it() -> None:
    own, outline = surface_of()
    figure = Plots(own).section_cut("S100", "100 %")
    surface = trace(figure, "surface")
    assert len(surface.x) == 40 + 1  # closed
    assert np.ptp(surface.x) == pytest.approx(2.0, abs=0.01)
    assert np.ptp(surface.y) == pytest.approx(0.4, abs=0.01)
    band = trace(figure, "95 % band")
    # 1.96 * 3 mm outside on both ends of the chord.
    assert np.ptp(band.x) == pytest.approx(2.0 + 2 * 1.96 * 0.003, abs=1e-3)
    assert len(trace(figure, "L1").x) == 3  # the fourth lies 3 m further out
    assert figure.layout.yaxis.scaleanchor == "x"
    assert outline.height == 40 * 3 * own.steps["step"].n_unique()


def test_a_residual_map_has_the_mean_of_every_patch_with_enough_points() -> None:
    own, _ = surface_of()
    (suction, pressure) = Plots(own).residual_map().data
    assert len(suction.z) == 0
    assert list(pressure.z) == pytest.approx([2.0])
    assert pressure.y[0] == pytest.approx(0.5, abs=0.05)


def test_rotations_have_bands_where_their_uncertainty_is_known() -> None:
    import beam_folders

    own = result(beam_folders.deflection())
    own.contour = beam_folders.contour(own.deflection)
    bands = [each for each in Plots(own).rotation().data if each.fill == "toself"]
    assert len(bands) == 3 * own.steps["step"].n_unique()
