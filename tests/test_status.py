"""How good is each row, and what is filled in time?"""

import numpy as np

from lidar_deflect.measurement.states import (
    DEGRADED,
    EXTRAPOLATED,
    INTERPOLATED,
    MISSING,
    OK,
)
from lidar_deflect.measurement.status import (
    Uses,
    extrapolate,
    grade_frames,
    interpolate,
    refuse_stretched,
)

REFERENCE = np.array([100.0, 100.0])
NO_FAILURE = np.array([None], dtype=object)


def uses(*, present=(True, True), lost=(False, False), overhead=(False, False), used=(100, 100)):
    return Uses(
        np.array([present]), np.array([lost]), np.array([overhead]), np.array([used], np.uint32)
    )


def graded(given, failure=NO_FAILURE):
    status, reason = grade_frames(given, failure, REFERENCE)
    return int(status[0]), reason[0]


def test_a_frame_like_the_reference_is_ok():
    assert graded(uses()) == (OK, None)


def test_every_shortcoming_has_its_reason():
    assert graded(uses(used=(40, 40))) == (DEGRADED, "few_points")
    assert graded(uses(used=(0, 150))) == (DEGRADED, "no_points")
    assert graded(uses(present=(False, True), used=(0, 150))) == (DEGRADED, "lost")
    assert graded(uses(lost=(True, False))) == (DEGRADED, "lost")
    assert graded(uses(overhead=(True, False), used=(0, 100))) == (DEGRADED, "overhead")


def test_a_lidar_that_never_saw_the_blade_is_not_missed():
    status, reason = grade_frames(
        uses(present=(False, True), used=(0, 100)), NO_FAILURE, np.array([0.0, 100.0])
    )
    assert (int(status[0]), reason[0]) == (OK, None)


def test_a_refused_frame_is_missing_with_its_reason():
    failure = np.array(["ill_posed"], dtype=object)
    assert graded(uses(), failure) == (MISSING, "ill_posed")
    overhead = uses(overhead=(True, True), used=(0, 0))
    assert graded(overhead, failure) == (MISSING, "overhead")


def test_sections_outside_of_the_scan_lines_are_extrapolated():
    status = np.array([[OK, OK, OK, MISSING]], np.uint8)
    reason = np.full((1, 4), None, dtype=object)
    extrapolate(status, reason, np.array([[80.0, 100.0, 106.0, np.nan]]), np.array([[84, 104.0]]))
    assert status.tolist() == [[EXTRAPOLATED, OK, EXTRAPOLATED, MISSING]]
    assert reason.tolist() == [["before_first_line", None, "beyond_last_line", None]]


def test_a_section_beyond_its_own_arc_length_is_refused():
    position = np.array([[[17.0, 0.0, 82.0], [30.0, 0.0, 115.0]]])
    status = np.array([[OK, OK]], np.uint8)
    reason = np.full((1, 2), None, dtype=object)
    refuse_stretched(status, reason, position, np.array([84.0, 110.0]))
    assert status.tolist() == [[OK, MISSING]]
    assert reason.tolist() == [[None, "stretched"]]
    assert np.isnan(position[0, 1]).all()
    assert not np.isnan(position[0, 0]).any()


def test_overhead_rows_are_filled_between_and_never_beyond():
    time_ns = np.arange(6) * 100_000_000
    position = np.full((6, 1, 3), np.nan)
    position[[1, 4], 0] = [[1.0, 10.0, 100.0], [4.0, 40.0, 400.0]]
    status = np.array([[MISSING], [OK], [MISSING], [MISSING], [OK], [MISSING]], np.uint8)
    reason = np.array(
        [["overhead"], [None], ["overhead"], ["ill_posed"], [None], ["overhead"]], dtype=object
    )
    interpolate(time_ns, position, status, reason)
    assert status.ravel().tolist() == [MISSING, OK, INTERPOLATED, MISSING, OK, MISSING]
    assert position[2, 0].tolist() == [2.0, 20.0, 200.0]
    assert np.isnan(position[[0, 3, 5]]).all()
