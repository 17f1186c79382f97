"""Is the drawing's geometry read as written, and an error in it told by line and column?"""

from pathlib import Path

import numpy as np
import pytest

from lidar_deflect.config import Blade
from lidar_deflect.errors import ConfigError
from lidar_deflect.geometry import read_contours, read_geometry, read_stations
from scenes import SCENES

HEADER = "s_m,chord_m,twist_deg,rel_thickness,prebend_m,axis_fraction,gj_nm2"
ROWS = (
    "0,4.8,14.0,1.0,0.0,0.5,7e10",
    "50,4.0,6.0,0.4,0.1,0.4,1e9",
    "100,1.0,-1.0,0.2,2.0,0.35,1e6",
)


def blade_csv(folder: Path, *rows: str, header: str = HEADER) -> Path:
    path = folder / "blade.csv"
    path.write_text("# a drawing\n" + "\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_stations_are_read_with_angles_in_radians(tmp_path: Path) -> None:
    stations = read_stations(blade_csv(tmp_path, *ROWS), 100.0)
    np.testing.assert_array_equal(stations.s_m, [0, 50, 100])
    np.testing.assert_allclose(stations.twist_rad, np.radians([14, 6, -1]))
    np.testing.assert_array_equal(stations.gj_nm2, [7e10, 1e9, 1e6])
    assert stations.ei_edge_nm2 is None


@pytest.mark.parametrize(
    ("rows", "line", "column", "words"),
    [
        ((ROWS[0], ROWS[2].replace("1.0,", "one,", 1)), 4, "chord_m", "not a number"),
        ((ROWS[0], "50,4.0", ROWS[2]), 4, "twist_deg", "not a number"),
        ((ROWS[0], ROWS[2], ROWS[1]), 5, "s_m", "must rise"),
        ((ROWS[0], ROWS[1].replace("4.0", "0"), ROWS[2]), 4, "chord_m", "positive"),
        ((ROWS[0], ROWS[1].replace("0.4,", "nan,"), ROWS[2]), 4, "rel_thickness", "range"),
        ((ROWS[0], ROWS[1]), 4, "s_m", "not the tip"),
        (ROWS[1:], 3, "s_m", "not the root"),
        (ROWS[:1], 1, "s_m", "too few rows"),
    ],
)
def test_an_error_in_the_stations_is_told_by_line_and_column(
    tmp_path: Path, rows: tuple[str, ...], line: int, column: str, words: str
) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        read_stations(blade_csv(tmp_path, *rows), 100.0)
    facts = dict(caught.value.facts)
    assert (facts["line"], facts["column"]) == (str(line), column)


def test_a_missing_column_is_named(tmp_path: Path) -> None:
    path = blade_csv(tmp_path, *ROWS, header=HEADER.replace("twist_deg", "twist"))
    with pytest.raises(ConfigError, match="twist_deg: this column is missing"):
        read_stations(path, 100.0)


def contours_csv(folder: Path, points: list[tuple[float, float, float]]) -> Path:
    path = folder / "contours.csv"
    lines = ["s_m,x_c,y_c", *(f"{s},{x},{y}" for s, x, y in points)]
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


DIAMOND = [(0.0, 0.0), (0.5, 0.2), (1.0, 0.0), (0.5, -0.1)]


def test_contours_are_read_per_station(tmp_path: Path) -> None:
    path = contours_csv(tmp_path, [(s, x, y) for s in (0, 100) for x, y in DIAMOND])
    contours = read_contours(path)
    assert contours.x_c.shape == (2, 4)
    np.testing.assert_array_equal(contours.y_c[1], [0, 0.2, 0, -0.1])


def test_contours_of_unequal_length_are_refused(tmp_path: Path) -> None:
    points = [(s, x, y) for s in (0, 100) for x, y in DIAMOND]
    with pytest.raises(ConfigError, match="another number of points"):
        read_contours(contours_csv(tmp_path, points[:-1]))
    with pytest.raises(ConfigError, match="leading edge"):
        read_contours(contours_csv(tmp_path, [(s, x + 0.1, y) for s, x, y in points]))


@pytest.mark.parametrize("scene", ["edge", "flap"])
def test_the_geometry_of_the_reference_scenes_is_accepted(scene: str) -> None:
    folder = SCENES / scene
    if not folder.is_dir():
        pytest.skip(f"{folder} is not on this machine")
    blade = Blade(length_m=110.0, geometry=folder / "blade.csv", contours=folder / "contours.csv")
    geometry = read_geometry(blade)
    assert geometry is not None
    assert geometry.contours is not None
    assert geometry.stations.s_m[-1] == pytest.approx(110.0, abs=1.0)
    assert geometry.stations.ei_edge_nm2 is not None
