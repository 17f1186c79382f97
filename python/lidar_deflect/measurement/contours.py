"""Steps 5 to 10 over a whole capture, in two passes of blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lidar_deflect import _native
from lidar_deflect.errors import MeasurementError
from lidar_deflect.measurement.status import Uses

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from lidar_deflect.measurement.inputs import Inputs
    from lidar_deflect.measurement.plan import Plan

    Floats = NDArray[np.float64]

BLOCK_FRAMES = 32
"""Frames that are worked on between two looks at Ctrl-C."""

SAMPLE_S = 5.0
"""Points are kept of one frame in so many seconds, to look at."""

SAMPLE_POINTS = 500
"""Points of one lidar that are kept of such a frame."""


def contours_of(inputs: Inputs, plan: Plan) -> ContourRun:
    """Run steps 5 to 10 on every frame, in two passes: (10) needs the distances of the whole test.

    The first pass keeps its frames as far as memory allows, so that a test of minutes is read once;
    it was made already where the tripods were watched in the same reading.

    Raises
    ------
    MeasurementError
        If no frame shows the blade at all.
    """
    frames = frame_plan(inputs, plan)
    survey = inputs.survey or _native.DistancePass(frames)
    while survey.advance(BLOCK_FRAMES, inputs.threads, inputs.listener("survey")):
        pass
    run = _native.ContourPass(
        frames,
        _native.FrameParams(**_parameters(inputs, plan, survey.ranges_m())),
        survey,
        sample_every=max(1, round(SAMPLE_S * inputs.rate_hz)),
        sample_points=SAMPLE_POINTS,
    )
    while run.advance(BLOCK_FRAMES, inputs.threads, inputs.listener("measure")):
        pass
    contours = ContourRun(run)
    if not contours.uses.used.any():
        raise MeasurementError(
            "no point of the blade in any frame",
            code="measurement.no_blade",
            facts=[("box_m", f"{plan.box_m.tolist()}"), ("frames", f"{len(contours.time_ns)}")],
            hint="set box_m of [paper] around the blade's whole way",
        )
    return contours


def frame_plan(inputs: Inputs, plan: Plan) -> _native.FramePlan:
    """Return what both passes need to make frames out of a capture."""
    return _native.FramePlan(
        inputs.capture.native,
        lidars=inputs.capture.numbers(inputs.lidars),
        poses=inputs.poses,
        cut_azimuth_deg=plan.cuts_deg(inputs.lidars),
        box_m=np.ascontiguousarray(plan.box_m),
        first_ns=inputs.first_ns,
        period_ns=inputs.period_ns,
        start_ns=inputs.start_ns,
        stop_ns=inputs.stop_ns,
        moves=inputs.native_moves,
    )


def _parameters(inputs: Inputs, plan: Plan, distances_m: Floats) -> Mapping[str, Any]:
    """Everything of ``[paper]`` that steps 6 to 10 use."""
    given = inputs.config.paper
    return {
        "distances_m": None if given.continuous else distances_m,
        "intervals": given.intervals,
        "alpha_deg": plan.alpha_deg,
        "mu": given.mu,
        "beta_m": given.beta_m,
        "min_points": given.min_points,
        "strict": given.strict,
        "leading_edge": plan.leading_edge,
        "contour_radius_m": given.contour_radius_m,
        "contour_min_points": given.contour_min_points,
        "line_degree": given.line_degree,
        "line_distance_m": given.line_distance_m,
        "degree_yoz": given.degrees.yoz,
        "degree_xoz": given.degrees.xoz,
        "tip_max_u_m": given.tip_max_u_m,
        "overhead_m": given.overhead_m if plan.edge_on_above else None,
    }


class ContourRun:
    """Contour curves of every frame, and what follows from them.

    Attributes
    ----------
    time_ns
        Frames, shape (t,), nanoseconds since 1970 UTC.
    uses
        What became of each lidar's points.
    seen_z_m
        First and last scan line on the blade, shape (t, 2); NaN without contours.
    """

    def __init__(self, run: _native.ContourPass) -> None:
        self._run = run
        self.time_ns: NDArray[np.int64] = run.time_ns()
        self.uses = Uses(*run.uses())
        self.seen_z_m: Floats = run.seen_z_m()

    def __repr__(self) -> str:
        return f"ContourRun({len(self.time_ns)} frames)"

    def failures(self, plane: str) -> NDArray[np.object_]:
        """Name what kept each frame from a tip, shape (t,), None where nothing did."""
        return np.array(self._run.failures(plane), dtype=object)

    def tip_z_m(self, plane: str) -> Floats:
        """Place of the tip along the span, shape (t,); NaN where there is none."""
        return self._run.tip_z_m(plane)

    def arc_to_tip(self, plane: str, z_m: Floats) -> Floats:
        """Arc length (15) from places along the span to the tip, shape (t, len(z_m))."""
        return self._run.arc_to_tip_m(plane, np.ascontiguousarray(z_m, dtype=np.float64))

    def sections(self, plane: str, to_tip_m: Floats) -> Floats:
        """Points so far before the tip along the mid-chord line, shape (t, len(to_tip_m), 3)."""
        return self._run.sections_m(plane, np.ascontiguousarray(to_tip_m, dtype=np.float64))

    def points_at(self, z_m: Floats) -> Floats:
        """Points of the mid-chord line at places along the span, shape (t, len(z_m), 3)."""
        return self._run.points_at_m(np.ascontiguousarray(z_m, dtype=np.float64))

    def chord_at(self, z_m: Floats) -> Floats:
        """Leading minus trailing edge at places along the span, shape (t, len(z_m), 3)."""
        return self._run.chords_at_m(np.ascontiguousarray(z_m, dtype=np.float64))

    def middle_z_m(self) -> float:
        """Middle of the visible part, median over the test."""
        return float(np.nanmedian(self.seen_z_m.mean(axis=1)))

    def points(self, lidars: Sequence[str]) -> Mapping[str, Any]:
        """Columns of the table `points`: some blade points of some frames."""
        time_ns, lidar, ring, xyz_m = self._run.sampled_points()
        return {
            "time": time_ns,
            "lidar": [lidars[index] for index in lidar],
            "ring": ring,
            **{f"{axis}_m": xyz_m[:, i].astype(np.float64) for i, axis in enumerate("xyz")},
        }

    def rejected(self) -> Mapping[str, Any]:
        """Columns of the table `rejected`: samples of those frames that did not agree (step 8)."""
        time_ns, reason, count, xyz_m = self._run.rejected()
        return {
            "time": time_ns,
            "reason": reason,
            "count": count,
            **{f"{axis}_m": xyz_m[:, i] for i, axis in enumerate("xyz")},
        }
