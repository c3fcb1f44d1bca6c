"""Suggest good targets in a wide image to a first-time user.

Each is textured, stands out by its colour, lies inside one thing and in reach of both eyes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.geometry.binning import enlarge
from foveacam_pipeline.matching.correlation import best_outside, score_map
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.reach import outline_margin_px, reach_outline_px

STEP_PX = 12
"""Spacing of the candidates in the wide image."""
PATCH_PX = 41
"""Side of the patch about a candidate that must have texture throughout."""
COLOUR_WEIGHTS = (0.3, 1.0, 1.0)
"""Weights of lightness and the two colour axes of CIELAB in a patch's salience."""
REACH_MARGIN_PX = 30.0
NEAR_M = 2.5
"""Depth at which both eyes must reach a suggestion, as at infinity: its distance is not known yet."""
APART_PX = 260.0
EDGE_COST = 0.5
"""Weight of the colour difference between a patch and its surroundings, which is subtracted."""
LEAST_SLOPE = 1.5
"""Root mean square gradient along x that every quarter of a patch must have, grey levels per px."""
ALIKE_REACH_PX = 160
"""Range to either side in which nothing may look like a patch: half of what the eyes search."""
ALIKE_SCORE = 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Suggestion:
    """A good target: wide px, and its salience from 0 to 1, relative to the best of the image."""

    x_px: float
    y_px: float
    score: float


def suggest_targets(
    image: NDArray[np.uint8], calibration: Calibration, *, count: int = 3
) -> tuple[Suggestion, ...]:
    """Return at most `count` good targets in a wide image, (h, w, 3) RGB and binned or not, best first."""
    image = enlarge(image, binning=calibration.wide.binning_of(image.shape))
    gray = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
    points = _candidates(gray.shape, calibration)
    if len(points) == 0:
        return ()
    textured = points[_texture(gray, points) >= LEAST_SLOPE]
    if len(textured) == 0:
        return ()
    scores = _salience(image, textured)
    best = max(float(scores.max()), 1e-9)
    chosen: list[Suggestion] = []
    for index in _spread(textured, scores, apart_px=APART_PX):
        if _unlike_its_row(gray, textured[index]):
            x_px, y_px = (float(value) for value in textured[index])
            chosen.append(Suggestion(x_px=x_px, y_px=y_px, score=max(0.0, float(scores[index] / best))))
        if len(chosen) == count:
            break
    return tuple(chosen)


def _candidates(shape: tuple[int, ...], calibration: Calibration) -> NDArray[np.intp]:
    """Return (n, 2) px of a grid over what both eyes reach, both at infinity and at `NEAR_M`."""
    height, width = shape[:2]
    edge = 2 * PATCH_PX
    x, y = np.meshgrid(np.arange(edge, width - edge, STEP_PX), np.arange(edge, height - edge, STEP_PX))
    points = np.column_stack([x.ravel(), y.ravel()])
    inside = np.ones(len(points), dtype=np.bool_)
    for role in (Role.LEFT, Role.RIGHT):
        for distance_m in (math.inf, NEAR_M):
            outline_px = reach_outline_px(calibration, role, distance_m=distance_m)
            inside &= outline_margin_px(outline_px, points.astype(np.float64)) >= REACH_MARGIN_PX
    return points[inside]


def _texture(gray: NDArray[np.uint8], points: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return (n,) the root mean square gradient along x of the weakest quarter of each patch."""
    slope = cv2.Sobel(cv2.GaussianBlur(gray, (0, 0), 1.0), cv2.CV_32F, 1, 0, scale=1.0 / 8.0)
    quarter = PATCH_PX // 2
    energy = cv2.blur(slope * slope, (quarter, quarter))
    half = quarter // 2
    corners = [energy[points[:, 1] + dy, points[:, 0] + dx] for dx in (-half, half) for dy in (-half, half)]
    return np.asarray(np.sqrt(np.min(corners, axis=0)), dtype=np.float64)


def _salience(image: NDArray[np.uint8], points: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return (n,) each patch's difference in colour from the image, less that from its neighbours.

    A patch beside another colour lies at an edge, and what is beside an edge may be hidden from one eye.
    """
    lab = cv2.cvtColor(image, cv2.COLOR_RGB2LAB).astype(np.float32)
    mean = cv2.blur(lab, (PATCH_PX, PATCH_PX))
    x, y = points[:, 0], points[:, 1]
    here = mean[y, x]
    steps_px = ((PATCH_PX, 0), (-PATCH_PX, 0), (0, PATCH_PX), (0, -PATCH_PX))
    beside = [mean[y + dy, x + dx] for dx, dy in steps_px]
    edge = np.max([np.linalg.norm(here - other, axis=1) for other in beside], axis=0)
    apart = (here - np.median(lab.reshape(-1, 3), axis=0)) * np.array(COLOUR_WEIGHTS)
    return np.asarray(np.linalg.norm(apart, axis=1) - EDGE_COST * edge, dtype=np.float64)


def _spread(points: NDArray[np.intp], scores: NDArray[np.float64], *, apart_px: float) -> Iterator[int]:
    """Yield candidates, best first, each at least `apart_px` from all before it."""
    free = np.ones(len(points), dtype=np.bool_)
    while free.any():
        best = int(np.argmax(np.where(free, scores, -np.inf)))
        yield best
        free &= np.linalg.norm(points - points[best], axis=1) >= apart_px


def _unlike_its_row(gray: NDArray[np.uint8], point: NDArray[np.intp]) -> bool:
    """Return whether nothing beside a patch looks like it, so that the eyes cannot confuse them."""
    x, y = (int(value) for value in point)
    half = PATCH_PX // 2
    left = max(0, x - ALIKE_REACH_PX - half)
    row = gray[y - half : y + half + 1, left : x + ALIKE_REACH_PX + half + 1]
    patch = gray[y - half : y + half + 1, x - half : x + half + 1]
    here = x - half - left
    return best_outside(score_map(row, patch), (here, 0), guard_px=(half, 0)) < ALIKE_SCORE
