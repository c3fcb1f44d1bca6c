"""Maps a rectangle or line dragged over a view to the left window of the look shown there."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.views import MeasuredView, Pixel, ViewMap
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.resources.looking.measurements.point_finder import PointFinder
from foveacam_server.resources.looking.measurements.schema import PlaceRequest

LEAST_SIDE_PX = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowRegion:
    """A look and pixels of its left window: two ends of a line, or four corners of a rectangle."""

    fixation_id: str
    look: LookDepth
    window_px: tuple[Pixel, ...]


def line_of(
    places: PointFinder, ends: tuple[PlaceRequest, PlaceRequest], *, wide: Intrinsics
) -> WindowRegion:
    """Return the line between two pixels of one view."""
    pixels = tuple((end.x_px, end.y_px) for end in ends)
    return _region(places, ends, pixels, wide=wide)


def rectangle_of(
    places: PointFinder, ends: tuple[PlaceRequest, PlaceRequest], *, wide: Intrinsics
) -> WindowRegion:
    """Return the rectangle between two opposite corners in one view."""
    (x0, x1), (y0, y1) = (sorted(values) for values in zip(*((e.x_px, e.y_px) for e in ends), strict=True))
    if x1 - x0 < LEAST_SIDE_PX or y1 - y0 < LEAST_SIDE_PX:
        raise InvalidInput(
            f"a rectangle of {x1 - x0:g} x {y1 - y0:g} px is too small for a plane",
            asked=f"{x1 - x0:g} x {y1 - y0:g} px",
            remedy="drag a larger rectangle",
        )
    return _region(places, ends, ((x0, y0), (x1, y0), (x1, y1), (x0, y1)), wide=wide)


def mask_of(region: WindowRegion) -> NDArray[np.bool_]:
    """Return (h, w) bool: the window pixels inside a region of four corners."""
    width, height = region.look.size_px
    mask = np.zeros((height, width), dtype=np.uint8)
    corners = np.rint(np.array(region.window_px) * 16).astype(np.int32)
    cv2.fillConvexPoly(mask, corners, (1,), shift=4)
    return mask.astype(np.bool_)


def _region(
    places: PointFinder,
    ends: tuple[PlaceRequest, PlaceRequest],
    pixels: tuple[Pixel, ...],
    *,
    wide: Intrinsics,
) -> WindowRegion:
    first, second = ends
    if first.view != second.view or first.fixation_id != second.fixation_id:
        raise InvalidInput(
            "a plane and a profile are taken in one view of one look",
            asked=f"points in {first.view} and {second.view}",
            remedy="choose both points in one view",
        )
    view = MeasuredView(first.view)
    middle = PlaceRequest(
        view=first.view,
        x_px=sum(x for x, _ in pixels) / len(pixels),
        y_px=sum(y for _, y in pixels) / len(pixels),
        fixation_id=first.fixation_id,
    )
    if view is MeasuredView.WIDE:
        fixation_id, look, z_m = places.covering(middle, wide=wide)
    else:
        for end in ends:
            fixation_id, look = places.look_of(end, wide=wide)
        z_m = look.median_z_m
        if view is MeasuredView.RIGHT:
            z_m = float(places.point(middle, wide=wide).point.point_rig_m[2])
    views = ViewMap(look=look, wide=wide)
    window_px = tuple(views.to_window(view, pixel, z_m=z_m) for pixel in pixels)
    return WindowRegion(fixation_id=fixation_id, look=look, window_px=window_px)
