"""Detection of square markers (dictionary 4X4_50) in a grey image, with corners to hundredths of a pixel.

`marker_model` fits a marker; this module detects markers, refits them at full size, and rates them: which
corners are visible, how sharp they are. Views are in pixels of the sensor, whatever the binning of the image.
"""

from collections.abc import Collection
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning
from foveacam_pipeline.calibrate.sweep.marker_code import CELLS, black_cells
from foveacam_pipeline.calibrate.sweep.marker_model import (
    MarkerFit,
    cell_corners,
    fit_marker,
    outer_corners,
    within,
)
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerView
from foveacam_pipeline.geometry.binning import picture_px, sensor_px

SIDE_M = 0.060
INSIDE_PX = 2.0
"""Minimum distance of a corner from the image's edge; nearer ones may be cut off."""
NEAR_CELLS = 0.45
AGREE_SHARE = 0.2
"""Where the image differs from the model by more than this share of the contrast, a corner is covered."""
SMALLEST_CELL_PX = 2.0
LEAST_CONTRAST = 12.0
"""Grey levels between black and white."""
REDUCTION = 4
"""Sensor pixels along a side of a pixel of the image in which a large marker is detected."""
MIN_DISTANCE_RATE = 0.02
"""Share of a marker's perimeter: with OpenCV's default 0.125 the rim of the white paper often hides its
marker."""


def find_markers(
    gray: NDArray[np.uint8],
    *,
    side_m: float = SIDE_M,
    large: bool = False,
    only: Collection[int] | None = None,
    binning: Binning = 1,
) -> dict[int, MarkerView]:
    """Return the markers of a grey image, (h, w), by id.

    `large`: they fill much of the image, as in a fovea, so they are detected at a quarter of the sensor's
    size. `only`: other ids are not measured. `binning`: of the image.
    """
    step = REDUCTION // binning if large else 1
    reduced = _reduced(gray, step) if large else gray
    detected = _detected(reduced, only)
    small = binning > 1 and not large and only is not None
    if small and not {marker_id for marker_id, _ in detected}.issuperset(only or ()):
        detected = _detected_enlarged(gray, only, times=binning)
    found: dict[int, MarkerView] = {}
    for marker_id, corners in detected:
        view = _measured(gray, reduced, corners, marker_id, step=step, side_m=side_m)
        known = found.get(marker_id)
        if view is not None and (known is None or _extent_px(view) > _extent_px(known)):
            found[marker_id] = view
    return {marker_id: _on_sensor(view, binning) for marker_id, view in found.items()}


def refind_marker(
    gray: NDArray[np.uint8], known: MarkerView, *, side_m: float = SIDE_M, binning: Binning = 1
) -> MarkerView | None:
    """Return a marker that has moved by at most a pixel since another image; None when it is gone."""
    start_px = picture_px(known.corners_px[:4], binning)
    view = _view(gray, known.id, start_px, blur_px=known.blur_px / binning, side_m=side_m)
    return None if view is None else _on_sensor(view, binning)


def _on_sensor(view: MarkerView, binning: Binning) -> MarkerView:
    """Return a view in pixels of a picture in those of the sensor."""
    if binning == 1:
        return view
    return replace(
        view,
        corners_px=sensor_px(view.corners_px, binning),
        sharpness=view.sharpness / binning,
        sigma_px=view.sigma_px * binning,
    )


def mean_view(views: list[MarkerView]) -> MarkerView:
    """Return the mean of views of one marker at rest, for the corners that all of them show."""
    shared = [
        place
        for place in map(tuple, views[0].places_m.tolist())
        if all((view.places_m == place).all(axis=1).any() for view in views[1:])
    ]
    places = np.array(shared).reshape(-1, 2)
    stacked = np.array(
        [[view.corners_px[(view.places_m == place).all(axis=1)][0] for place in places] for view in views]
    )
    return MarkerView(
        id=views[0].id,
        corners_px=stacked.mean(axis=0),
        places_m=places,
        sharpness=float(np.mean([view.sharpness for view in views])),
        complete=all(view.complete for view in views),
        sigma_px=float(np.sqrt(np.mean([view.sigma_px**2 for view in views]) / len(views))),
        white_level=float(np.mean([view.white_level for view in views])),
    )


def middle_px(view: MarkerView) -> NDArray[np.float64]:
    """Return the middle of a marker, (2,) px, by the homography of its corners."""
    return np.asarray(image_of(view, np.zeros((1, 2)))[0])


def image_of(view: MarkerView, places_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (n, 2) px of points on the marker's plane, (n, 2) metres."""
    scale_m = float(np.abs(view.places_m).max())
    matrix, _ = cv2.findHomography(view.places_m / scale_m, view.corners_px)
    rows = np.column_stack([places_m / scale_m, np.ones(len(places_m))]) @ np.asarray(matrix).T
    return np.asarray(rows[:, :2] / rows[:, 2:], dtype=np.float64)


@cache
def _detector() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.minMarkerDistanceRate = MIN_DISTANCE_RATE
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), parameters)


def _detected(gray: NDArray[np.uint8], only: Collection[int] | None) -> list[tuple[int, NDArray[np.float64]]]:
    """Return the ids and outer corners, (4, 2) px, of the markers of an image; None: of all ids."""
    corners, ids, _ = _detector().detectMarkers(gray)
    if len(corners) == 0:
        return []
    return [
        (int(marker_id), np.asarray(quad, dtype=np.float64).reshape(4, 2))
        for marker_id, quad in zip(np.asarray(ids).ravel(), corners, strict=True)
        if only is None or int(marker_id) in only
    ]


def _detected_enlarged(
    gray: NDArray[np.uint8], only: Collection[int] | None, *, times: Binning
) -> list[tuple[int, NDArray[np.float64]]]:
    """Return markers like `_detected`, and those that OpenCV finds only in an enlarged image."""
    # cells 3 px wide: OpenCV finds a marker in most pictures by cubic interpolation, in few by linear
    enlarged = cv2.resize(gray, None, fx=times, fy=times, interpolation=cv2.INTER_CUBIC)
    found = _detected(np.asarray(enlarged, dtype=np.uint8), only)
    return [(marker_id, picture_px(corners, times)) for marker_id, corners in found]


def _reduced(gray: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    height, width = gray.shape[0] // step, gray.shape[1] // step
    whole = gray[: height * step, : width * step]
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _measured(
    gray: NDArray[np.uint8],
    reduced: NDArray[np.uint8],
    corners: NDArray[np.float64],
    marker_id: int,
    *,
    step: int,
    side_m: float,
) -> MarkerView | None:
    if step == 1:
        return _view(gray, marker_id, corners, blur_px=1.0, side_m=side_m)
    coarse = _fitted(reduced, corners, marker_id, blur_px=0.6)
    if coarse is None:
        return None
    full = coarse.pixels_of(outer_corners()) * step + (step - 1) / 2.0
    return _view(gray, marker_id, full, blur_px=max(coarse.blur_px * step, 1.0), side_m=side_m)


def _fitted(
    gray: NDArray[np.uint8], corners_px: NDArray[np.float64], marker_id: int, *, blur_px: float
) -> MarkerFit | None:
    sides = np.linalg.norm(corners_px - np.roll(corners_px, 1, axis=0), axis=1)
    if sides.min() < SMALLEST_CELL_PX * CELLS:
        return None
    try:
        fit = fit_marker(gray, corners_px, _black(marker_id), blur_px=blur_px)
    except ValueError:
        return None
    return fit if fit.contrast >= LEAST_CONTRAST else None


def _view(
    gray: NDArray[np.uint8],
    marker_id: int,
    corners_px: NDArray[np.float64],
    *,
    blur_px: float,
    side_m: float,
) -> MarkerView | None:
    fit = _fitted(gray, corners_px, marker_id, blur_px=blur_px)
    if fit is None:
        return None
    cells = np.vstack([outer_corners(), cell_corners(_black(marker_id))])
    corners = fit.pixels_of(cells)
    seen = _inside(corners, gray.shape) & _uncovered(fit, cells)
    if int(seen.sum()) < 4:
        return None
    return MarkerView(
        id=marker_id,
        corners_px=corners[seen],
        places_m=cells[seen] * (side_m / CELLS),
        sharpness=1.0 / fit.blur_px,
        complete=bool(seen.all()),
        sigma_px=fit.sigma_px,
        white_level=fit.white,
    )


def _inside(corners_px: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    last = np.array([shape[1], shape[0]]) - 1.0 - INSIDE_PX
    return np.asarray(((corners_px >= INSIDE_PX) & (corners_px <= last)).all(axis=1))


def _uncovered(fit: MarkerFit, cells: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the (n,) mask of corners about which the image agrees with the model."""
    rows = np.column_stack([fit.pixels_px, np.ones(len(fit.pixels_px))]) @ fit.cells_from_px.T
    at = rows[:, :2] / rows[:, 2:]
    limit = AGREE_SHARE * fit.contrast + 3.0 * fit.noise
    good = [
        bool(near.any()) and float(np.sqrt(np.mean(fit.misfit[near] ** 2))) <= limit
        for near in (within(at - cell, NEAR_CELLS) for cell in cells)
    ]
    return np.array(good)


def _extent_px(view: MarkerView) -> float:
    return float(np.ptp(view.corners_px, axis=0).max())


@cache
def _black(marker_id: int) -> NDArray[np.float64]:
    return black_cells(marker_id)
