"""The compiled core; private. Its public face are the modules of this package."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BeamAdjustment",
    "BeamBlade",
    "BeamFeed",
    "BeamSeen",
    "CaptureScan",
    "CellPass",
    "ContourCurves",
    "ContourPass",
    "DistancePass",
    "FrameParams",
    "FramePlan",
    "PointIterator",
    "Simulation",
    "StaticHold",
    "Sweep",
    "SweepIterator",
    "WatchedPass",
    "__version__",
    "adjust_network",
    "arc_length",
    "cell_heights",
    "cell_positions",
    "check_captures",
    "curve_distances",
    "curve_points",
    "cut_capture",
    "dbscan",
    "dbscan_radii",
    "echo_cells",
    "fit_line",
    "fit_plane",
    "fit_polynomial",
    "hold_echoes",
    "huber_weighted",
    "line_clusters",
    "line_extremes",
    "median_size",
    "pass_through",
    "points_near_box",
    "points_nearest_to",
    "polynomial_powers",
    "polynomial_slopes",
    "polynomial_values",
    "polynomial_variances",
    "pose_design",
    "radii_at",
    "radii_of",
    "reference_blades",
    "right_edges",
    "rotation_about_up",
    "rotation_onto",
    "scan_capture",
    "scan_quickly",
    "sensor_id",
    "sensor_models",
    "sensor_table",
    "simulated_sensors",
    "walk_arc",
    "yaw_from_wall",
]

__version__: str

def check_captures(paths: Sequence[Path]) -> None: ...
def cut_capture(
    scan: CaptureScan,
    out: Path,
    *,
    lidars: Sequence[int],
    start_ns: int | None = None,
    stop_ns: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> int: ...
def scan_capture(
    paths: Sequence[Path],
    *,
    sensors: Sequence[tuple[str, str]],
    units: Sequence[tuple[str | None, str, bytes, bool]],
    progress: Callable[[int, int], None] | None = None,
) -> CaptureScan: ...
def scan_quickly(
    paths: Sequence[Path],
    *,
    sensors: Sequence[tuple[str, str]],
    units: Sequence[tuple[str | None, str, bytes, bool]],
    head_s: float,
) -> tuple[CaptureScan, list[tuple[str, int]]]: ...
def sensor_id(name: str) -> str | None: ...
def sensor_models() -> list[tuple[str, str]]: ...
def sensor_table() -> list[list[str]]: ...

@final
class CaptureScan:
    @property
    def lidars(self) -> list[str]: ...
    @property
    def first_time_ns(self) -> int | None: ...
    @property
    def last_time_ns(self) -> int | None: ...
    def describe(self) -> dict[str, Any]: ...
    def health(self) -> dict[str, Any]: ...

def hold_echoes(
    scan: CaptureScan,
    *,
    lidars: Sequence[int],
    start_ns: int,
    stop_ns: int,
    with_intensity: bool = True,
    threads: int | None = None,
) -> list[
    tuple[NDArray[np.float32], NDArray[np.uint16], NDArray[np.float32], NDArray[np.float32]]
]: ...
def echo_cells(
    ring: NDArray[np.uint16], azimuth_deg: NDArray[np.float32], grid: tuple[float, int, int]
) -> NDArray[np.uint32]: ...
def cell_positions(
    cells: NDArray[np.uint32], xyz: NDArray[np.float32], size: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]: ...
def cell_heights(
    cells: NDArray[np.uint32],
    xyz: NDArray[np.float32],
    plane: NDArray[np.int64],
    height_m: NDArray[np.float64],
    gate_m: NDArray[np.float64],
    along: NDArray[np.float64],
    beneath_m: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]: ...

@final
class CellPass:
    def __new__(
        cls,
        scan: CaptureScan,
        *,
        lidars: Sequence[int],
        every: Sequence[int],
        watched: Sequence[NDArray[np.bool_]],
        grid: tuple[float, int, int],
        start_ns: int,
        stop_ns: int,
        window_ns: int,
    ) -> CellPass: ...
    def advance(
        self,
        threads: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> list[tuple[int, NDArray[np.uint32], NDArray[np.float32], int, int]] | None: ...

def pose_design(
    ray_m: NDArray[np.float64], normal: NDArray[np.float64], sigma_m: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def median_size(values: NDArray[np.float64]) -> float: ...
def huber_weighted(
    design: NDArray[np.float64], left: NDArray[np.float64], limit: float, square: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...

@final
class PointIterator(Iterator[dict[str, NDArray[Any]]]):
    def __new__(
        cls,
        scan: CaptureScan,
        *,
        lidars: Sequence[int],
        block_points: int,
        start_ns: int | None = None,
        stop_ns: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> PointIterator: ...
    def __iter__(self) -> PointIterator: ...
    def __next__(self) -> dict[str, NDArray[Any]]: ...
    @property
    def merged(self) -> int: ...
    @property
    def drops(self) -> list[tuple[str, int]]: ...

@final
class Sweep:
    @property
    def lidar(self) -> str: ...
    @property
    def index(self) -> int: ...
    @property
    def start_ns(self) -> int: ...
    @property
    def end_ns(self) -> int: ...
    @property
    def coverage(self) -> float: ...
    @property
    def packets(self) -> int: ...
    @property
    def lost(self) -> int: ...
    @property
    def xyz(self) -> NDArray[np.float32]: ...
    @property
    def time_ns(self) -> NDArray[np.int64]: ...
    @property
    def ring(self) -> NDArray[np.uint16]: ...
    @property
    def range_m(self) -> NDArray[np.float32]: ...
    @property
    def azimuth_deg(self) -> NDArray[np.float32]: ...
    @property
    def intensity(self) -> NDArray[np.uint16]: ...
    @property
    def return_index(self) -> NDArray[np.uint8]: ...
    @property
    def return_kind(self) -> NDArray[np.uint8]: ...
    @property
    def packet(self) -> NDArray[np.uint32]: ...
    @property
    def block(self) -> NDArray[np.uint16]: ...
    def __len__(self) -> int: ...

@final
class SweepIterator(Iterator[Sweep]):
    def __new__(
        cls,
        scan: CaptureScan,
        *,
        lidars: Sequence[int],
        names: Sequence[str],
        cut_rad: Sequence[float],
        every: Sequence[int],
        start_ns: int | None = None,
        stop_ns: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> SweepIterator: ...
    def __iter__(self) -> SweepIterator: ...
    def __next__(self) -> Sweep: ...
    @property
    def merged(self) -> int: ...

def reference_blades() -> list[str]: ...
def simulated_sensors() -> list[str]: ...

@final
class Simulation:
    """A simulated test under way; writes its capture as it goes."""

    def __new__(cls, scene: Mapping[str, Any]) -> Simulation: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def done_s(self) -> float: ...
    def create(self, path: str | PathLike[str]) -> None: ...
    def advance(self, *, threads: int | None) -> bool: ...
    def packets(self) -> list[tuple[int, int]]: ...
    def poses(self) -> list[list[list[float]]]: ...
    def last_poses(self) -> list[list[list[float]]]: ...
    def range_offsets_m(self) -> list[list[float]]: ...
    def units(self) -> list[tuple[str, list[tuple[str, bytes]]]]: ...
    def truth(
        self, sections_m: Sequence[float], times_s: NDArray[np.float64], *, threads: int | None
    ) -> NDArray[np.float64]: ...
    def load(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def ground_m(self, places: Sequence[tuple[float, float]]) -> list[float]: ...
    def wall_m(self, places: Sequence[tuple[float, float]]) -> list[float]: ...
    def nominal(self) -> dict[str, NDArray[np.float64]]: ...
    def contours(self) -> NDArray[np.float64]: ...

def rotation_onto(
    from_direction: NDArray[np.float64], to_direction: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def rotation_about_up(yaw_rad: float) -> NDArray[np.float64]: ...
def yaw_from_wall(
    levelled: NDArray[np.float32],
    *,
    normal: NDArray[np.float64],
    distance_m: float,
    yaw_range_rad: float,
    min_height_m: float,
) -> tuple[float, float, int]: ...
def points_near_box(
    xyz: NDArray[np.float32], pose: NDArray[np.float64], box_m: NDArray[np.float64]
) -> NDArray[np.float32]: ...
def points_nearest_to(
    xyz: NDArray[np.float32], direction: NDArray[np.float64]
) -> NDArray[np.int64]: ...

@final
class FramePlan:
    def __new__(
        cls,
        scan: CaptureScan,
        *,
        lidars: Sequence[int],
        poses: NDArray[np.float64],
        cut_azimuth_deg: Sequence[float],
        box_m: NDArray[np.float64],
        first_ns: int,
        period_ns: int,
        start_ns: int,
        stop_ns: int,
        moves: Sequence[tuple[int, int, int, list[list[float]]]] = ...,
    ) -> FramePlan: ...

@final
class FrameParams:
    def __new__(
        cls,
        *,
        distances_m: NDArray[np.float64] | None,
        intervals: int,
        alpha_deg: float,
        mu: float,
        beta_m: float,
        min_points: int,
        strict: bool,
        leading_edge: NDArray[np.float64],
        contour_radius_m: float,
        contour_min_points: int,
        line_degree: int,
        line_distance_m: float,
        degree_yoz: int,
        degree_xoz: int,
        tip_max_u_m: float,
        overhead_m: float | None,
    ) -> FrameParams: ...

@final
class DistancePass:
    def __new__(cls, plan: FramePlan) -> DistancePass: ...
    def advance(
        self,
        count: int,
        threads: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> bool: ...
    def ranges_m(self) -> NDArray[np.float64]: ...

@final
class WatchedPass:
    def __new__(
        cls,
        plan: FramePlan,
        *,
        lidars: Sequence[int],
        every: Sequence[int],
        watched: Sequence[NDArray[np.bool_]],
        grid: tuple[float, int, int],
        window_ns: int,
    ) -> WatchedPass: ...
    def advance(
        self,
        threads: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> list[tuple[int, NDArray[np.uint32], NDArray[np.float32], int, int]] | None: ...
    def survey(self) -> DistancePass | None: ...

@final
class ContourPass:
    def __new__(
        cls,
        plan: FramePlan,
        params: FrameParams,
        first_pass: DistancePass,
        *,
        sample_every: int,
        sample_points: int,
    ) -> ContourPass: ...
    def advance(
        self,
        count: int,
        threads: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> bool: ...
    def time_ns(self) -> NDArray[np.int64]: ...
    def uses(
        self,
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_], NDArray[np.uint32]]: ...
    def failures(self, plane: str) -> list[str | None]: ...
    def seen_z_m(self) -> NDArray[np.float64]: ...
    def tip_z_m(self, plane: str) -> NDArray[np.float64]: ...
    def arc_to_tip_m(self, plane: str, z_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def sections_m(self, plane: str, to_tip_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def points_at_m(self, z_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def chords_at_m(self, z_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def sampled_points(
        self,
    ) -> tuple[NDArray[np.int64], NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float32]]: ...
    def rejected(
        self,
    ) -> tuple[NDArray[np.int64], list[str], NDArray[np.uint32], NDArray[np.float64]]: ...

_Cloud = NDArray[np.float32] | NDArray[np.float64]
_Vector = tuple[float, float, float]
_RadiusModel = tuple[float, float, float, int]
_Polynomial = tuple[list[float], float, float]
_Curve = tuple[int, tuple[_Polynomial, _Polynomial]]
_ContourCluster = tuple[
    int, int, list[float], tuple[_Polynomial, _Polynomial], bool, int, float, bool
]

def dbscan(
    xyz: _Cloud, radius_m: float, min_points: int, strict: bool, threads: int | None
) -> NDArray[np.int32]: ...
def dbscan_radii(
    xyz: _Cloud,
    radii_m: NDArray[np.float64],
    min_points: int,
    strict: bool,
    threads: int | None,
) -> NDArray[np.int32]: ...
def radii_at(raw: _RadiusModel, distances_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
def radii_of(raw: _RadiusModel, xyz: _Cloud, origin_m: _Vector) -> NDArray[np.float64]: ...
def right_edges(
    min_m: float, max_m: float, count: int, distances_m: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def line_clusters(
    samples_m: NDArray[np.float64],
    labels: NDArray[np.int32],
    axis: int,
    degrees: tuple[int, int],
    reach_m: float,
) -> tuple[list[_ContourCluster], int, NDArray[np.bool_], int]: ...
def fit_plane(
    xyz: _Cloud, towards_m: _Vector, threads: int | None
) -> tuple[tuple[list[float], float, list[float]], NDArray[np.float64], float, int]: ...
def fit_line(
    xyz: _Cloud, along: _Vector, threads: int | None
) -> tuple[tuple[list[float], list[float]], NDArray[np.float64], float, int]: ...
def fit_polynomial(
    abscissas: NDArray[np.float64], ordinates: NDArray[np.float64], degree: int
) -> tuple[_Polynomial, NDArray[np.float64], float, int]: ...
def polynomial_values(polynomial: _Polynomial, t: NDArray[np.float64]) -> NDArray[np.float64]: ...
def polynomial_slopes(polynomial: _Polynomial, t: NDArray[np.float64]) -> NDArray[np.float64]: ...
def polynomial_variances(
    polynomial: _Polynomial, covariance: NDArray[np.float64], t: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def polynomial_powers(polynomial: _Polynomial) -> NDArray[np.float64]: ...
def arc_length(raw: _Curve, from_m: float, to_m: float, tolerance_m: float) -> float: ...
def walk_arc(raw: _Curve, from_m: float, length_m: float, tolerance_m: float) -> float: ...
def curve_points(raw: _Curve, t_m: NDArray[np.float64]) -> NDArray[np.float64]: ...
def curve_distances(raw: _Curve, xyz: NDArray[np.float64]) -> NDArray[np.float64]: ...
def pass_through(xyz: NDArray[np.float32], box_m: NDArray[np.float64]) -> NDArray[np.bool_]: ...
def line_extremes(
    xyz: NDArray[np.float32], ring: NDArray[np.uint16], leading_edge: NDArray[np.float64]
) -> tuple[NDArray[np.uint16], NDArray[np.float64], NDArray[np.float64]]: ...

@final
class ContourCurves:
    def __new__(
        cls,
        leading_m: NDArray[np.float64],
        trailing_m: NDArray[np.float64],
        *,
        degree_yoz: int,
        degree_xoz: int,
    ) -> ContourCurves: ...
    def at(
        self, z_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
    def tip(self, plane: str, max_u_m: float) -> tuple[float, float]: ...
    def length_m(self, from_z_m: float, to_z_m: float) -> float: ...
    def before_m(self, tip_z_m: float, length_m: float) -> list[float]: ...

@final
class BeamBlade:
    def __new__(
        cls,
        stations: NDArray[np.float64],
        outline_s_m: Sequence[float],
        outlines: NDArray[np.float64],
        *,
        leading_edge: NDArray[np.float64],
        suction_side: NDArray[np.float64],
        saddles_s_m: Sequence[float],
    ) -> BeamBlade: ...
    def forces_for(
        self,
        direction: NDArray[np.float64],
        s_m: Sequence[float],
        deflection_m: Sequence[float],
    ) -> NDArray[np.float64] | None: ...

@final
class BeamSeen:
    def __len__(self) -> int: ...

@final
class BeamFeed:
    def __new__(
        cls,
        scan: CaptureScan,
        *,
        lidars: Sequence[int],
        poses: NDArray[np.float64],
        cut_azimuth_deg: Sequence[float],
        box_m: NDArray[np.float64],
        windows_ns: Sequence[tuple[int, int]],
        moves: Sequence[tuple[int, int, int, list[list[float]]]] = ...,
        threads: int | None = None,
    ) -> BeamFeed: ...
    def take(
        self, count: int, progress: Callable[[int, int], None] | None = None
    ) -> list[BeamSeen]: ...

@final
class BeamAdjustment:
    def __new__(
        cls,
        blade: BeamBlade,
        seen: Sequence[BeamSeen],
        *,
        spans_ns: Sequence[tuple[int, int]],
        forces_n: NDArray[np.float64],
        full_n: NDArray[np.float64],
        poses: NDArray[np.float64],
        channels: Sequence[int],
        clock_s: Sequence[float],
        rig_prior: NDArray[np.float64],
        rig_covariance: NDArray[np.float64],
        from_m: float,
        trust: Sequence[float],
        shape_trust: Sequence[float],
        noise_m: float,
        surface_m: float,
        edge_rad: float,
        echoes: int,
        threads: int | None = None,
    ) -> BeamAdjustment: ...
    def step(self, echo_m: float, edge_m: float, stage: str) -> dict[str, Any]: ...
    def told(self) -> list[dict[str, Any]]: ...
    def sections(
        self, s_m: Sequence[float], echo_m: float, edge_m: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def states(
        self, hold: int, times_ns: Sequence[int], each: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    @staticmethod
    def load_knots(span_ns: tuple[int, int]) -> list[int]: ...
    def follow(
        self,
        seen: Sequence[BeamSeen],
        spans_ns: Sequence[tuple[int, int]],
        loads: Sequence[Sequence[float]],
        times_ns: Sequence[Sequence[int]],
        hold_loads: Sequence[float],
        gates: Sequence[tuple[float, float]],
        sway_m: Sequence[float],
    ) -> list[tuple[NDArray[np.float64], NDArray[np.float64], dict[str, Any]] | None]: ...
    def set_clocks(
        self, offset_s: Sequence[float], deviation_s: Sequence[float], tied: bool
    ) -> None: ...
    def values(self) -> NDArray[np.float64]: ...
    def budget(
        self, s_m: Sequence[float], echo_m: float, edge_m: float
    ) -> tuple[list[str], NDArray[np.float64]]: ...
    def posterior(self, echo_m: float, edge_m: float) -> tuple[list[str], NDArray[np.float64]]: ...
    def outlines(
        self, s_m: Sequence[float], echo_m: float, edge_m: float
    ) -> NDArray[np.float64]: ...
    def strains(
        self, echo_m: float, edge_m: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def loose_edges(self) -> list[tuple[int, int, int, float]]: ...
    def layout(self) -> dict[str, int]: ...

@final
class StaticHold:
    """What one lidar sees while nothing moves: mean rays per channel and azimuth cell."""

    @staticmethod
    def add_up(
        xyz: NDArray[np.float32],
        ring: NDArray[np.uint16],
        azimuth_deg: NDArray[np.float32],
        intensity: NDArray[np.float32] | None,
        *,
        step_deg: float,
        min_count: int,
    ) -> StaticHold: ...
    @staticmethod
    def of_rays(
        direction: NDArray[np.float64],
        range_m: NDArray[np.float64],
        sigma_m: NDArray[np.float64],
        ring: NDArray[np.uint16],
        cell: NDArray[np.uint32],
        intensity: NDArray[np.float32],
        *,
        cells: int,
    ) -> StaticHold: ...
    def beams(self) -> dict[str, NDArray[Any]]: ...
    @property
    def cells(self) -> int: ...
    @property
    def dropped(self) -> tuple[int, int]: ...
    def ground(
        self, up_in_sensor: NDArray[np.float64]
    ) -> tuple[tuple[float, float, float], float] | None: ...
    def turn_to_targets(
        self,
        levelled: Sequence[Sequence[float]],
        targets: Sequence[tuple[Sequence[float], float]],
        range_rad: float,
    ) -> tuple[float, int] | None: ...
    def stand(
        self,
        surfaces: Sequence[Mapping[str, Any]],
        targets: Sequence[tuple[Sequence[float], float | None]],
        position_m: Sequence[float] | None,
    ) -> tuple[list[list[float]], list[float], bool] | None: ...
    def sheet(
        self, expected_m: Sequence[float], up: Sequence[float], size_m: float, within_m: float
    ) -> tuple[tuple[Any, ...], int] | None: ...
    def __len__(self) -> int: ...

def adjust_network(
    holds: Sequence[StaticHold],
    lidars: Sequence[Mapping[str, Any]],
    surfaces: Sequence[Mapping[str, Any]],
    targets: Sequence[tuple[Sequence[float], float | None]],
    known: Mapping[str, Any],
    *,
    priors: Sequence[float],
) -> dict[str, Any]: ...
