"""Which steps bring a blade to its place, and how the time between holds is cut."""

from dataclasses import replace

import numpy as np

from lidar_deflect.measurement.beam.expected import Expected
from lidar_deflect.measurement.beam.following import CHUNK, few
from lidar_deflect.measurement.beam.schedule import DRAWN, LAST, Schedule
from lidar_deflect.measurement.beam.stretches import LOAD_SHARE, Stretch, stretches_of

SECOND = 1_000_000_000


def ramp() -> Expected:
    """Half a load in the tenth second, none before, and no change behind it."""
    return Expected(
        time_ns=np.array([0, 9, 10, 20]) * SECOND,
        share=np.array([0.0, 0.0, 0.5, 0.5]),
        holds=(),
        s_m=np.array([100.0]),
        deflection_m=np.array([6.0]),
        direction=np.array([1.0, 0.0, 0.0]),
        source="channel",
    )


def names(schedule: Schedule, moved_m: float) -> list[str]:
    """What may change in the stages that a blade goes through that always moves so far."""
    stage, gone = 0, []
    while stage < len(schedule.first):
        gone.append(schedule.at(stage)[2])
        stage = schedule.after(stage, moved_m)
    return gone


def test_a_blade_at_rest_is_asked_once_for_each_kind_and_at_last_with_the_last_gates() -> None:
    assert names(DRAWN, 0.0) == ["loads", "blade", "all", "all"]
    assert DRAWN.at(len(DRAWN.first) - 1)[:2] == LAST


def test_a_blade_that_moves_leaves_no_stage_out() -> None:
    assert names(DRAWN, 10.0) == [step[2] for step in DRAWN.first]


def test_a_schedule_that_skips_nothing_goes_from_stage_to_stage() -> None:
    steady = replace(DRAWN, skips=False)
    assert [steady.after(stage, 0.0) for stage in range(3)] == [1, 2, 3]


def test_every_moment_outside_of_the_holds_lies_in_one_stretch_of_little_change() -> None:
    times_ns = np.arange(0, 20 * SECOND, SECOND // 10)
    hold_ns = (2 * SECOND, 5 * SECOND)
    stretches = stretches_of(ramp(), [hold_ns], times_ns)
    moments = np.concatenate([stretch.moments for stretch in stretches])
    outside = (times_ns < hold_ns[0]) | (times_ns > hold_ns[1])
    np.testing.assert_array_equal(moments, np.flatnonzero(outside))
    for stretch in stretches:
        assert np.ptp(stretch.load) <= LOAD_SHARE + 1e-9
        assert np.all(np.diff(stretch.moments) == 1)
        first_ns, last_ns = times_ns[stretch.moments[[0, -1]]]
        assert stretch.span_ns[0] < first_ns <= last_ns < stretch.span_ns[1]


def test_without_moments_there_is_no_stretch() -> None:
    times_ns = np.arange(0, SECOND, SECOND // 10)
    assert stretches_of(ramp(), [(0, SECOND)], times_ns) == ()


def test_few_stretches_are_read_with_the_holds_and_many_chunk_by_chunk() -> None:
    one = Stretch(np.arange(3), (0, SECOND), np.zeros(3))
    assert few([one] * CHUNK) == [(0, SECOND)] * CHUNK
    assert few([one] * (CHUNK + 1)) == []
