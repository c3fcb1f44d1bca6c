"""Depth at a wide pixel, looked up in the newest depth maps projected into the wide image."""

import io
import math
import threading
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.geometry.angles import angles_from_rays, ray
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.depth import points_rig_m
from foveacam_pipeline.stereo.values import DepthMap, RectifiedPair
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_server.foundation.errors import NotLookedAt

MAX_PATCHES = 32
"""Number of depth maps held in memory; older ones are dropped."""
REACH_PX = 1.5
"""Radius within which a pixel without depth takes its nearest neighbour's (0.03 degrees)."""
COARSE_REACH_PX = 5.0
"""The same in depths that were matched at the resolution of the wide view, which have none beside edges."""
DOUBTED_SHARE = 0.1
"""A standard error above this share of the depth: the look may have shown what lies behind the point. An
older look that is sure is believed then."""
STEP_PX = 2
"""Stride at which a half-size depth map is sampled; leaves some 10 points a wide pixel."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthPatch:
    """One depth map in wide pixels: cell (row, column) is the wide pixel (x0 + column, y0 + row).

    `z_m`, `sigma_m`: (h, w) float32, metres along +z of the rig frame; NaN where unknown.
    """

    fixation_id: str
    created_utc: str
    x0: int
    y0: int
    z_m: NDArray[np.float32]
    sigma_m: NDArray[np.float32]
    reach_px: float = REACH_PX

    def at(self, x_px: float, y_px: float) -> tuple[float, float] | None:
        """Return (z, sigma) m of the nearest known cell within `reach_px`; None where there is none."""
        x, y, reach = x_px - self.x0, y_px - self.y0, self.reach_px
        left, top = max(0, math.ceil(x - reach)), max(0, math.ceil(y - reach))
        bottom, right = max(0, math.floor(y + reach) + 1), max(0, math.floor(x + reach) + 1)
        near = self.z_m[top:bottom, left:right]
        rows, columns = np.nonzero(np.isfinite(near))
        if len(rows) == 0:
            return None
        distance_px = np.hypot(columns + left - x, rows + top - y)
        nearest = int(np.argmin(distance_px))
        if distance_px[nearest] > reach:
            return None
        row, column = int(rows[nearest]) + top, int(columns[nearest]) + left
        return float(self.z_m[row, column]), float(self.sigma_m[row, column])

    def covers(self, x_px: float, y_px: float) -> bool:
        """Return whether the pixel is inside the map, whether or not it has a depth."""
        height, width = self.z_m.shape
        return bool(0 <= x_px - self.x0 <= width - 1 and 0 <= y_px - self.y0 <= height - 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthReading:
    """Depth at one wide pixel, from the newest map that covers it."""

    fixation_id: str
    created_utc: str
    point_rig_m: tuple[float, float, float]
    distance_m: float
    distance_sigma_m: float


def project_patch(
    pair: RectifiedPair, depth: DepthMap, *, wide: Intrinsics, fixation_id: str, created_utc: str
) -> DepthPatch | None:
    """Return the depth map projected into the wide image; None when no pixel has a depth.

    Where several points fall into one wide pixel, it gets the point of median depth.
    """
    points_m, sigma_m = _points(pair, depth)
    if len(points_m) == 0:
        return None
    pixels = wide.pixels(angles_from_rays(points_m))
    grid = _grid(pixels, points_m[:, 2], sigma_m, size_px=(wide.width, wide.height))
    return None if grid is None else DepthPatch(fixation_id=fixation_id, created_utc=created_utc, **grid)


def samples_patch(
    samples: DepthSamples, *, wide: Intrinsics, fixation_id: str, created_utc: str
) -> DepthPatch | None:
    """Return depths in directions of the wide view as a patch; None when there are none inside it."""
    if len(samples) == 0:
        return None
    z_m = 1.0 / samples.inverse_z_per_m
    pixels = wide.pixels(np.arctan(samples.tangents))
    grid = _grid(pixels, z_m, samples.sigma_per_m * z_m**2, size_px=(wide.width, wide.height))
    if grid is None:
        return None
    return DepthPatch(fixation_id=fixation_id, created_utc=created_utc, reach_px=COARSE_REACH_PX, **grid)


class _Grid(TypedDict):
    """The fields of a patch that hold depth."""

    x0: int
    y0: int
    z_m: NDArray[np.float32]
    sigma_m: NDArray[np.float32]


def _grid(
    pixels: NDArray[np.float64],
    z_m: NDArray[np.float64],
    sigma_m: NDArray[np.float64],
    *,
    size_px: tuple[int, int],
) -> _Grid | None:
    """Return the patch that holds depths (n,) at wide pixels (n, 2); None when none lies inside the image."""
    cells = np.rint(pixels).astype(np.int64)
    inside = (cells >= 0).all(axis=1) & (cells < size_px).all(axis=1)
    if not inside.any():
        return None
    cells, z_m, sigma_m = cells[inside], z_m[inside], sigma_m[inside]
    low, high = cells.min(axis=0), cells.max(axis=0)
    width, height = (high - low + 1).tolist()
    index = (cells[:, 1] - low[1]) * width + (cells[:, 0] - low[0])
    middle = _median_members(index, z_m)
    z_grid = np.full(width * height, np.nan, dtype=np.float32)
    sigma_grid = np.full(width * height, np.nan, dtype=np.float32)
    z_grid[index[middle]] = z_m[middle]
    sigma_grid[index[middle]] = sigma_m[middle]
    return {
        "x0": int(low[0]),
        "y0": int(low[1]),
        "z_m": z_grid.reshape(height, width),
        "sigma_m": sigma_grid.reshape(height, width),
    }


def point_patch(
    point_rig_m: tuple[float, float, float],
    *,
    sigma_z_m: float,
    wide: Intrinsics,
    fixation_id: str,
    created_utc: str,
) -> DepthPatch:
    """Return a patch of one wide pixel: the point on which the foveae verged."""
    x_px, y_px = wide.pixels(angles_from_rays([point_rig_m]))[0].tolist()
    return DepthPatch(
        fixation_id=fixation_id,
        created_utc=created_utc,
        x0=round(x_px),
        y0=round(y_px),
        z_m=np.array([[point_rig_m[2]]], dtype=np.float32),
        sigma_m=np.array([[sigma_z_m]], dtype=np.float32),
    )


def save_patch(patch: DepthPatch, path: Path) -> None:
    """Write the patch as an npz file."""
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            format="foveacam-depth-patch",
            version=1,
            fixation_id=patch.fixation_id,
            created_utc=patch.created_utc,
            corner=np.array([patch.x0, patch.y0]),
            z_m=patch.z_m,
            sigma_m=patch.sigma_m,
        )


def load_patch(path: Path) -> DepthPatch:
    """Read a patch that `save_patch` wrote; raise `OSError`, or `ValueError` for any other content."""
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
            return DepthPatch(
                fixation_id=str(file["fixation_id"]),
                created_utc=str(file["created_utc"]),
                x0=int(file["corner"][0]),
                y0=int(file["corner"][1]),
                z_m=file["z_m"].astype(np.float32),
                sigma_m=file["sigma_m"].astype(np.float32),
            )
    except (zipfile.BadZipFile, EOFError, LookupError, TypeError, AttributeError) as error:
        raise ValueError(f"it is not a depth patch ({error})") from error


class DepthPatches:
    """The newest patches, searched newest first; safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._patches: list[DepthPatch] = []
        """Oldest first."""

    def add(self, patch: DepthPatch) -> None:
        """Add a patch as the newest."""
        with self._lock:
            self._keep([*self._patches, patch])

    def add_coarse(self, patch: DepthPatch) -> None:
        """Add a patch that counts only where its fixation has no better depth, as its own point."""
        with self._lock:
            own = [index for index, held in enumerate(self._patches) if held.fixation_id == patch.fixation_id]
            at = own[0] if own else len(self._patches)
            self._keep([*self._patches[:at], patch, *self._patches[at:]])

    def forget(self, fixation_id: str) -> None:
        """Drop the patches of one fixation."""
        with self._lock:
            self._keep([patch for patch in self._patches if patch.fixation_id != fixation_id])

    def _keep(self, patches: list[DepthPatch]) -> None:
        self._patches = patches[-MAX_PATCHES:]

    def covering(self, x_px: float, y_px: float) -> bool:
        """Return whether any held depth map covers the pixel."""
        with self._lock:
            return any(patch.covers(x_px, y_px) for patch in self._patches)

    def at(self, x_px: float, y_px: float, *, wide: Intrinsics) -> DepthReading:
        """Return the depth at a wide pixel; raise `OutOfRange`, or `NotLookedAt` if none is known there."""
        wide.check_pixel(x_px, y_px)
        with self._lock:
            newest_first = list(reversed(self._patches))
        if (best := _best(newest_first, x_px, y_px)) is not None:
            patch, found = best
            return _reading(patch, found, pixel=(x_px, y_px), wide=wide)
        if self.covering(x_px, y_px):
            raise NotLookedAt(  # a fixation of the pixel itself has further ways to its distance
                f"no depth is known at wide pixel ({x_px:g}, {y_px:g}): the looks there match no texture",
                asked=f"depth at ({x_px:g}, {y_px:g})",
                found="no texture there",
                remedy="fixate it: POST /api/v1/fixations; or try a pixel beside it",
            )
        raise NotLookedAt(
            f"no fovea has looked there yet: wide pixel ({x_px:g}, {y_px:g})",
            asked=f"depth at ({x_px:g}, {y_px:g})",
            found="no depth map covers it",
            remedy="fixate it first: POST /api/v1/fixations",
        )


def _best(
    newest_first: Sequence[DepthPatch], x_px: float, y_px: float
) -> tuple[DepthPatch, tuple[float, float]] | None:
    """Return the depth at a pixel by the newest look that is sure of it, else by the newest look.

    Of several patches of one look the one with the smallest error counts.
    """
    looks: dict[str, tuple[DepthPatch, tuple[float, float]]] = {}
    for patch in newest_first:
        found = patch.at(x_px, y_px)
        if found is None:
            continue
        held = looks.get(patch.fixation_id)
        if held is None or found[1] < held[1][1]:
            looks[patch.fixation_id] = (patch, found)
    sure = (each for each in looks.values() if each[1][1] <= DOUBTED_SHARE * each[1][0])
    return next(sure, next(iter(looks.values()), None))


def _reading(
    patch: DepthPatch, found: tuple[float, float], *, pixel: tuple[float, float], wide: Intrinsics
) -> DepthReading:
    z_m, sigma_z_m = found
    ax_rad, ay_rad = wide.angles_rad([pixel])[0].tolist()
    direction = ray(ax_rad, ay_rad)
    point_m = direction * (z_m / direction[2])
    distance_m = float(np.linalg.norm(point_m))
    return DepthReading(
        fixation_id=patch.fixation_id,
        created_utc=patch.created_utc,
        point_rig_m=(float(point_m[0]), float(point_m[1]), float(point_m[2])),
        distance_m=distance_m,
        distance_sigma_m=sigma_z_m * distance_m / z_m,
    )


def _points(pair: RectifiedPair, depth: DepthMap) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    z_m = depth.z_m[::STEP_PX, ::STEP_PX]
    sigma_m = np.hypot(depth.sigma_m, depth.pose_sigma_m)[::STEP_PX, ::STEP_PX].astype(np.float64)
    rows, columns = np.nonzero(np.isfinite(z_m) & np.isfinite(sigma_m) & (z_m > 0.0))
    known_m = z_m[rows, columns]
    points_m = points_rig_m(pair, columns * STEP_PX, rows * STEP_PX, known_m)
    return points_m.astype(np.float64), sigma_m[rows, columns]


def _median_members(index: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return, for each group of equal `index`, the position of the group's median in `values`."""
    order = np.lexsort((values, index))
    starts = np.flatnonzero(np.r_[True, np.diff(index[order]) > 0])
    ends = np.r_[starts[1:], len(order)]
    middle: NDArray[np.int64] = order[(starts + ends - 1) // 2]
    return middle
