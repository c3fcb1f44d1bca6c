"""Computes how a measurement is drawn: pixels in each view, and lines and labels in the 3D pane."""

from collections.abc import Sequence
from typing import get_args

from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.views import MeasuredView, Pixel, ViewMap, wide_pixel
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.resources.looking.measurements.schema import (
    GazeDocument,
    MeasurementDocument,
    Pair,
    Triple,
    ViewName,
)
from foveacam_web.scene_values import MeasurementDrawing, metres_text

VIEWS: tuple[ViewName, ...] = get_args(ViewName)
LONGEST_NAME = 24
"""Length to which a name is cut in the 3D pane, characters."""


def drawn_in_views(
    points_rig_m: Sequence[Triple], *, look: LookDepth | None, wide: Intrinsics
) -> dict[ViewName, list[Pair]]:
    """Return the pixels of points in each view; without a look, in the wide view only."""
    drawn: dict[ViewName, list[Pair]] = {"wide": [_short(wide_pixel(wide, point)) for point in points_rig_m]}
    if look is None:
        return drawn
    views = ViewMap(look=look, wide=wide)
    window_px = [_window_px(look, point) for point in points_rig_m]
    for view in VIEWS[1:]:
        drawn[view] = [
            _short(views.from_window(MeasuredView(view), at, z_m=point[2]))
            for at, point in zip(window_px, points_rig_m, strict=True)
        ]
    return drawn


def gaze_of(look: LookDepth) -> GazeDocument:
    """Return the volts of both mirrors during a look."""
    left, right = look.volts.left, look.volts.right
    return GazeDocument(
        left_v=(round(left.x_v, 4), round(left.y_v, 4)), right_v=(round(right.x_v, 4), round(right.y_v, 4))
    )


def scene_drawing(document: MeasurementDocument) -> MeasurementDrawing | None:
    """Return the 3D pane's drawing of a measurement; None for a plane without an outline."""
    points = [point.point_rig_m for point in document.points if point.point_rig_m is not None]
    if document.plane is not None:
        points = document.plane.corners_rig_m
    if document.profile is not None:
        points = [document.profile.start_rig_m, document.profile.end_rig_m]
    if not points:
        return None
    return MeasurementDrawing(
        label=value_text(document), points_rig_m=tuple(points), closed=document.plane is not None
    )


def value_text(document: MeasurementDocument) -> str:
    """Return name, value and standard error as one line."""
    name = document.label
    name = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
    if document.length is not None:
        return f"{name}  {metres_text(document.length.length_m, document.length.length_sigma_m)}"
    if document.plane is not None:
        plane = document.plane
        return f"{name}  pan {plane.pan_deg:.1f}°, tilt {plane.tilt_deg:.1f}° ± {plane.normal_sigma_deg:.1f}°"
    if document.profile is not None:
        return f"{name}  {document.profile.samples[-1].along_m:.3f} m"
    return f"{name}  {metres_text(document.points[0].distance_m, document.points[0].distance_sigma_m)}"


def _window_px(look: LookDepth, point_rig_m: Triple) -> Pixel:
    x_m, y_m, z_m = point_rig_m
    scale_px = look.f_px / z_m
    return scale_px * (x_m + look.baseline_m / 2.0) - look.u0_left_px, scale_px * y_m - look.v0_px


def _short(pixel: Pixel) -> Pair:
    return round(pixel[0], 2), round(pixel[1], 2)
