"""Is the optimum of the network adjustment the one that scipy finds of the same sum of squares?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from lidar_deflect import _native

if TYPE_CHECKING:
    from numpy.typing import NDArray

CHANNELS = 8
PRIORS = (0.02, 3.5e-4, 1e-4)
POSITION_U_M, MOUNTING_U_RAD, CONTROL_U_M, BEND_U_M, SLANT_U_M = 0.005, 0.17, 0.005, 0.02, 0.0015
POSITION_M = np.array([3.0, -5.8, 95.0])
TRUE = Rotation.from_euler("xyz", [0.02, -0.03, 1.6]).as_matrix()
SURFACES = (
    {"origin_m": [0.0, -7.0, 95.0], "normal": [0.0, 1.0, 0.0], "half_m": [25.0, 25.0]},
    {"origin_m": [-15.0, 0.0, 95.0], "normal": [1.0, 0.0, 0.0], "half_m": [25.0, 12.0]},
)
KINDS = ("control", "position", "mounting", "gravity", "distance", "target", "sight")


def axes(surface: dict[str, Any]) -> NDArray[np.float64]:
    """Rows: along, across, normal."""
    normal = np.array(surface["normal"])
    along = np.array([0.0, 0.0, 1.0]) - normal * normal[2]
    along /= np.linalg.norm(along)
    return np.array([along, np.cross(normal, along), normal])


class Yard:
    """Rays of one lidar on ground and wall, control points, and the same sum of squares again."""

    def __init__(self) -> None:
        random = np.random.default_rng(4)
        azimuth, ring = np.meshgrid(np.arange(0.0, 360.0, 1.0), np.arange(CHANNELS))
        elevation = np.radians(-14.0 + 4.0 * ring)
        turn = np.radians(azimuth)
        rays = [np.cos(elevation) * np.cos(turn), np.cos(elevation) * np.sin(turn)]
        direction = np.stack([*rays, np.sin(elevation)], axis=-1).reshape(-1, 3)
        range_m, on = self._ranges(direction)
        offsets = random.normal(0.0, 0.007, CHANNELS)
        seen = (range_m < 22.0) & (on >= 0)
        self.direction, self.ring = direction[seen], ring.ravel()[seen].astype(np.uint16)
        noise = random.uniform(-0.005, 0.005, int(seen.sum()))  # no tails, so all weights are full
        self.range_m = range_m[seen] + noise - offsets[self.ring]
        self.cell = (azimuth.ravel()[seen] * 10).astype(np.uint32)
        places = random.uniform(-12.0, 12.0, (2, 12, 2))
        self.control: list[tuple[int, list[float], float]] = []
        for number, surface in enumerate(SURFACES):
            frame, origin = axes(surface), np.array(surface["origin_m"])
            for u, v in places[number] * [1.0, (1.0, 0.3)[number]]:
                point = origin + u * frame[0] + v * frame[1]
                point += random.normal(0.0, CONTROL_U_M, 3)
                self.control.append((number, point.tolist(), CONTROL_U_M))

    @staticmethod
    def _ranges(direction: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        world = direction @ TRUE.T
        ranges = []
        for surface in SURFACES:
            normal, origin = np.array(surface["normal"]), np.array(surface["origin_m"])
            with np.errstate(divide="ignore"):
                reach = normal @ (origin - POSITION_M) / (world @ normal)
            ranges.append(np.where(reach > 0.5, reach, np.inf))
        both = np.array(ranges)
        return both.min(axis=0), np.where(np.isfinite(both.min(axis=0)), both.argmin(axis=0), -1)

    def adjusted(self) -> dict[str, Any]:
        hold = _native.StaticHold.of_rays(
            self.direction,
            self.range_m,
            np.full(len(self.range_m), 0.003),
            self.ring,
            self.cell,
            np.zeros(len(self.range_m), dtype=np.float32),
            cells=3600,
        )
        start = (Rotation.from_rotvec([0.004, 0.006, -0.005]).as_matrix() @ TRUE).tolist()
        known: dict[str, Any] = {kind: [] for kind in KINDS} | {
            "control": self.control,
            "position": [(0, POSITION_M.tolist(), [0.0, 0.0, 0.0], POSITION_U_M)],
            "mounting": [(0, start, MOUNTING_U_RAD)],
        }
        self.nominal = np.array(start)
        lidar = {"rotation": start, "position_m": POSITION_M.tolist(), "channels": CHANNELS}
        return _native.adjust_network([hold], [lidar], SURFACES, [], known, priors=PRIORS)

    def residuals(
        self, x: NDArray[np.float64], raw: dict[str, Any], rotation: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Rows over their sigmas at a state: pose, elevation, scale, offsets, shapes, slant."""
        turned = Rotation.from_rotvec(x[:3]).as_matrix() @ rotation
        position, (elevation, scale) = x[3:6], x[6:8]
        offsets = x[8 : 8 + CHANNELS]
        bends, slant = x[8 + CHANNELS : -1].reshape(-1, 6), x[-1]
        beam, sigma = raw["met_beam"], raw["residuals"][:, 1]
        order = np.lexsort((self.cell, self.ring))[beam]
        level = np.linalg.norm(self.direction[order, :2], axis=1)
        up = np.c_[-self.direction[order, 2:] * self.direction[order, :2] / level[:, None], level]
        ray = self.direction[order] * np.cos(elevation) + up * np.sin(elevation)
        measured = self.range_m[order] * (1.0 + scale) + offsets[self.ring[order]]
        measured += slant * self._slants(raw)
        meets = self._meets(ray @ turned.T, position, bends, raw["met_surface"], measured)
        rows = [(measured - meets) / sigma]
        for (number, point, _), judged in zip(self.control, raw["control"], strict=True):
            rows.append([self._above(np.array([point]), number, bends[number])[0] / judged[0][1]])
        rows.append((POSITION_M - position) / POSITION_U_M)
        rows.append(Rotation.from_matrix(turned @ self.nominal.T).as_rotvec() / MOUNTING_U_RAD)
        rows.append([elevation / PRIORS[1], scale / PRIORS[2]])
        alike = np.eye(CHANNELS) - np.full((CHANNELS, CHANNELS), 1.0 / (CHANNELS + 1))
        rows.append(np.linalg.cholesky(alike).T @ offsets / raw["offset_u_m"])
        rows.append(bends[:, 3:].ravel() / BEND_U_M)
        rows.append([slant / SLANT_U_M])
        return np.concatenate(rows)

    def _slants(self, raw: dict[str, Any]) -> NDArray[np.float64]:
        """1 / cos(incidence) - 1 where each ray ended."""
        ray = raw["met_xyz_m"] - raw["lidars"][0]["position_m"]
        ray /= np.linalg.norm(ray, axis=1)[:, None]
        cosine = np.empty(len(ray))
        for number, surface in enumerate(SURFACES):
            mine = raw["met_surface"] == number
            frame, c = axes(surface), raw["surfaces"][number]["coefficients_m"]
            u, v, _ = frame @ (raw["met_xyz_m"][mine] - np.array(surface["origin_m"])).T
            (a, b), x, y = surface["half_m"], u / surface["half_m"][0], v / surface["half_m"][1]
            slopes = [(c[1] + 2 * c[3] * x + c[4] * y) / a, (c[2] + c[4] * x + 2 * c[5] * y) / b]
            gradient = frame[2] - np.array(slopes).T @ frame[:2]
            along = (gradient * ray[mine]).sum(axis=1) / np.linalg.norm(gradient, axis=1)
            cosine[mine] = np.abs(along)
        return 1.0 / cosine - 1.0

    def _above(
        self, points: NDArray[np.float64], number: int, bend: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        surface = SURFACES[number]
        u, v, h = axes(surface) @ (points - np.array(surface["origin_m"])).T
        x, y = u / surface["half_m"][0], v / surface["half_m"][1]
        return np.asarray(h - bend @ np.array([np.ones_like(x), x, y, x * x, x * y, y * y]))

    def _meets(
        self,
        world: NDArray[np.float64],
        position: NDArray[np.float64],
        bends: NDArray[np.float64],
        surface: NDArray[np.uint32],
        near: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        reach = near.copy()
        for number in range(len(SURFACES)):
            mine = surface == number
            closing = world[mine] @ np.array(SURFACES[number]["normal"])
            for _ in range(8):
                points = position + world[mine] * reach[mine, None]
                reach[mine] -= self._above(points, number, bends[number]) / closing
        return reach


def test_the_optimum_and_its_covariance_are_those_of_scipy() -> None:
    yard = Yard()
    raw = yard.adjusted()
    assert raw["converged"]
    assert not any(surface.get("nodes") for surface in raw["surfaces"])  # smooth: no grid
    assert np.isfinite(raw["residuals"]).all()  # nothing was refused
    lidar = raw["lidars"][0]
    ours = np.concatenate(
        [
            [0.0, 0.0, 0.0],
            lidar["position_m"],
            [lidar["elevation_rad"], lidar["scale"]],
            lidar["offsets_m"],
            *(surface["coefficients_m"] for surface in raw["surfaces"]),
            [lidar["slant_m"]],
        ]
    )
    arguments = (raw, np.array(lidar["rotation"]))
    sigma = np.sqrt(np.diag(raw["covariance"]))
    rays = len(raw["met_beam"])
    assert np.abs(yard.residuals(ours, *arguments)[:rays]).max() < 2.5  # no weight is reduced
    found = least_squares(yard.residuals, ours, args=arguments, x_scale=sigma, method="lm")
    # The adjustment ends when no pose moves by more than 0.02 of its sigma.
    assert np.abs((found.x - ours) / sigma).max() < 0.05
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    assert np.allclose(np.sqrt(np.diag(covariance)), sigma, rtol=0.02)
