"""The estimator of Sec. 4.1, the same for both pairs: correlation, sub-pixel refinement, triangulation.

The target's centre is found in the left picture by a template of an earlier left picture, its disparity by
matching left and right. Both searches are `matching.search.find_point`. `disparity_bound_px` is the
Cramér-Rao bound of that disparity, from noise and texture of repeated frames of one view.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, InvalidInput, Sighting
from foveacam_pipeline.geometry.angles import angles_from_tan, tan_from_angles
from foveacam_pipeline.geometry.plane_window import PinholeWindow
from foveacam_pipeline.geometry.triangulate import depth_from_disparity_m, points_from_plane
from foveacam_pipeline.matching.picture import doubled
from foveacam_pipeline.matching.point import PositionPrior
from foveacam_pipeline.matching.search import FoundPoint, SearchReach, find_point
from foveacam_pipeline.matching.windows import MatchWindow
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import rectify, to_uint8

WINDOW_HALF_M, WINDOW_SIGMA_M = 0.018, 0.0075
"""The window on the target: it lies within the chest, so that no background is in it."""
LEAST_HALF_PX, LEAST_SIGMA_PX = 3, 1.2
SEARCH_M = 1.0
"""Disparities are searched for depths this far before and behind the standoff."""
ROWS_PX = 3
"""Rows searched up and down for the right picture."""
CLICK_REACH_M = 0.02
"""The centre is searched this far from the click, beside the template's own size in px."""
LEAST_REACH_PX = 4
PRIOR = PositionPrior(slopes=2)

Picture = NDArray[np.float32]
LEAST_FRAMES = 2
SHIFT, SLOPES = 0, (2, 3)
"""Indices of the shift and of both slopes among the unknowns."""


class PixelPlane(Protocol):
    """Relation between the pixels of a picture and the virtual pinhole plane (Sec. 3.2)."""

    def plane_from_pixels(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) plane coordinates, px, of (n, 2) pixels."""
        ...

    def pixels_from_plane(self, plane_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) pixels of (n, 2) plane coordinates, px."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class LensPlane:
    """The plane of a camera with lens distortion, whose pictures are used as they are."""

    lens: Intrinsics

    def plane_from_pixels(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) plane coordinates, px, of (n, 2) raw pixels."""
        return self.lens.fx_px * tan_from_angles(self.lens.angles_rad(pixels))

    def pixels_from_plane(self, plane_px: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) raw pixels of (n, 2) plane coordinates, px."""
        return self.lens.pixels(angles_from_tan(plane_px / self.lens.fx_px))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairView:
    """Two pictures (h, w) float32 whose rows match, half a baseline to each side of the rig's origin."""

    left: Picture
    right: Picture
    left_plane: PixelPlane
    right_plane: PixelPlane
    f_px: float
    baseline_m: float

    def left_pixel(self, point_rig_m: tuple[float, float, float]) -> tuple[float, float]:
        """Return the (x, y) left pixel at which the calibration expects a point of the rig frame."""
        x_m, y_m, z_m = point_rig_m
        plane = self.f_px * np.array([[(x_m + self.baseline_m / 2.0) / z_m, y_m / z_m]])
        x_px, y_px = self.left_plane.pixels_from_plane(plane)[0].tolist()
        return x_px, y_px


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TargetTemplate:
    """The left picture in which the target was marked, and the whole pixel (x, y) of the mark."""

    picture: Picture
    at_px: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalisedTarget:
    """A target as a pair localises it: its point in the rig frame, its disparity, the weaker correlation."""

    point_rig_m: tuple[float, float, float]
    disparity_px: float
    score: float


def wide_view(left: Frame, right: Frame, calibration: Calibration) -> PairView:
    """Return the pair of two wide frames, as they are, taken half a baseline to the left and to the right."""
    plane = LensPlane(lens=calibration.wide)
    return PairView(
        left=gray(to_uint8(left)).astype(np.float32),
        right=gray(to_uint8(right)).astype(np.float32),
        left_plane=plane,
        right_plane=plane,
        f_px=calibration.wide.fx_px,
        baseline_m=calibration.baseline_m,
    )


def fovea_view(sighting: Sighting, calibration: Calibration) -> PairView:
    """Return the rectified pair of a look of both foveae, at full resolution."""
    pair = rectify(sighting, calibration, scale=1.0)
    height, width = pair.left.shape[:2]
    left, right = (
        PinholeWindow(u0_px=u0_px, v0_px=pair.v0_px, width=width, height=height, f_px=pair.f_px)
        for u0_px in (pair.u0_left_px, pair.u0_right_px)
    )
    return PairView(
        left=gray(pair.left).astype(np.float32),
        right=gray(pair.right).astype(np.float32),
        left_plane=left,
        right_plane=right,
        f_px=pair.f_px,
        baseline_m=pair.baseline_m,
    )


def window_at(f_px: float, standoff_m: float) -> MatchWindow:
    """Return the window that covers the target at a standoff."""
    px_a_metre = f_px / standoff_m
    return MatchWindow(
        half_px=max(LEAST_HALF_PX, round(WINDOW_HALF_M * px_a_metre)),
        weight_sigma_px=max(LEAST_SIGMA_PX, WINDOW_SIGMA_M * px_a_metre),
    )


def mark_target(view: PairView, point_rig_m: tuple[float, float, float]) -> TargetTemplate:
    """Mark the target in the left picture where the calibration expects a point of the rig frame."""
    x_px, y_px = view.left_pixel(point_rig_m)
    return TargetTemplate(picture=view.left, at_px=(round(x_px), round(y_px)))


def localise(
    view: PairView, template: TargetTemplate, clicked_px: tuple[float, float], *, standoff_m: float
) -> LocalisedTarget | None:
    """Return the target near a clicked left pixel; None where a match fails.

    `standoff_m`: roughly how far away it is, for the size of the window and the search.
    """
    window = window_at(view.f_px, standoff_m)
    centre = _centre(view, template, clicked_px, window, standoff_m)
    if centre is None:
        return None
    (x_px, y_px), centre_score = centre
    at_px = round(x_px), round(y_px)
    found = find_point(
        view.left, view.right, at_px, reach=_reach(view, at_px, standoff_m), window=window, prior=PRIOR
    )
    if found is None:
        return None
    ends = np.array([at_px, (at_px[0] + found.x_px, at_px[1] + found.y_px)], dtype=np.float64)
    disparity_px = float(
        view.left_plane.plane_from_pixels(ends[:1])[0, 0] - view.right_plane.plane_from_pixels(ends[1:])[0, 0]
    )
    z_m = depth_from_disparity_m(np.array([disparity_px]), f_px=view.f_px, baseline_m=view.baseline_m)
    if not math.isfinite(z_m[0]):
        return None
    plane = view.left_plane.plane_from_pixels(np.array([[x_px, y_px]]))
    x_m, y_m, depth_m = points_from_plane(plane, z_m, f_px=view.f_px, baseline_m=view.baseline_m)[0].tolist()
    return LocalisedTarget(
        point_rig_m=(x_m, y_m, depth_m), disparity_px=disparity_px, score=min(centre_score, found.score)
    )


def _centre(
    view: PairView,
    template: TargetTemplate,
    clicked_px: tuple[float, float],
    window: MatchWindow,
    standoff_m: float,
) -> tuple[tuple[float, float], float] | None:
    """Return the (x, y) left pixel of the target's centre and its correlation."""
    reach_px = max(LEAST_REACH_PX, math.ceil(CLICK_REACH_M * view.f_px / standoff_m))
    across, down = (round(place - mark) for place, mark in zip(clicked_px, template.at_px, strict=True))
    found: FoundPoint | None = find_point(
        template.picture,
        view.left,
        template.at_px,
        reach=SearchReach(low_px=across - reach_px, high_px=across + reach_px, rows_px=reach_px + abs(down)),
        window=window,
        prior=PRIOR,
    )
    if found is None:
        return None
    return (template.at_px[0] + found.x_px, template.at_px[1] + found.y_px), found.score


def _reach(view: PairView, at_px: tuple[int, int], standoff_m: float) -> SearchReach:
    """Return where the right picture may show a left pixel, at depths about the standoff."""
    plane = view.left_plane.plane_from_pixels(np.array([at_px], dtype=np.float64))
    shifts_px = [
        float(view.right_plane.pixels_from_plane(plane - [[disparity_px, 0.0]])[0, 0]) - at_px[0]
        for disparity_px in (
            view.f_px * view.baseline_m / (standoff_m - SEARCH_M),
            view.f_px * view.baseline_m / (standoff_m + SEARCH_M),
        )
    ]
    return SearchReach(
        low_px=math.floor(min(shifts_px)) - 1, high_px=math.ceil(max(shifts_px)) + 1, rows_px=ROWS_PX
    )


def disparity_bound_px(frames: NDArray[np.float64]) -> float:
    """Return the least standard error of the disparity between two pictures of a texture, px.

    `frames`: (k, h, w) repeated windows about the target, k at least 2, with the noise of one picture each;
    infinite where they have no texture across the rows.
    """
    if frames.ndim != 3 or len(frames) < LEAST_FRAMES or min(frames.shape[1:]) < 3:
        raise InvalidInput(
            f"frames of shape {frames.shape}: give {LEAST_FRAMES} or more windows of "
            "one view, at least 3 px wide"
        )
    variance = 2.0 * float(frames.var(axis=0, ddof=1).mean())  # both pictures have the noise
    information = _products(frames)
    for slope in SLOPES:
        information[slope, slope] += variance / PRIOR.slope_sigma**2
    try:
        share = float(np.linalg.inv(information)[SHIFT, SHIFT])
    except np.linalg.LinAlgError:
        return math.inf
    return math.sqrt(variance * share) if share > 0.0 else math.inf


def _products(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (6, 6) products of the derivatives of the brightness by the unknowns, free of noise.

    Products are taken between different frames, whose noises are independent.
    """
    first, second = frames[::2].mean(axis=0), frames[1::2].mean(axis=0)
    product = _derivatives(first) @ _derivatives(second).T
    return np.asarray((product + product.T) / 2.0, dtype=np.float64)


def _derivatives(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (6, n): the derivative of each pixel by each unknown.

    Differences are taken half a pixel to either side, as whole pixels miss the finest texture.
    """
    double = doubled(image.astype(np.float32)).astype(np.float64)
    across = double[2:-2:2, 3:-1:2] - double[2:-2:2, 1:-3:2]
    down = double[3:-1:2, 2:-2:2] - double[1:-3:2, 2:-2:2]
    level = image[1:-1, 1:-1]
    y, x = np.mgrid[: level.shape[0], : level.shape[1]].astype(np.float64)
    x -= x.mean()
    y -= y.mean()
    rows = (across, down, across * x, across * y, level - level.mean(), np.ones_like(level))
    return np.array([row.ravel() for row in rows])
