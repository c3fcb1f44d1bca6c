"""Finds the point in the rig frame at a pixel of a view: selects the look and its pixel."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from foveacam_hardware.contract import OutOfRange, StereoVolts
from foveacam_pipeline.measure.look import LookDepth
from foveacam_pipeline.measure.point import (
    MeasuredPoint,
    beside_edge,
    lone_point,
    nearest_known,
    point_at,
)
from foveacam_pipeline.measure.views import (
    WINDOWS,
    MeasuredView,
    Pixel,
    ViewMap,
    nearest_known_right,
    wide_pixel,
)
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.foundation.errors import NotFound, StaleView
from foveacam_server.resources.looking.measurements.looks import DepthOfPixels, LookReader
from foveacam_server.resources.looking.measurements.schema import PlaceRequest

REACH_PX = 6.0
"""Radius within which a pixel without depth takes its nearest neighbour's, window px (0.02 degrees)."""
SAME_GAZE_V = 0.05
"""Tolerance, in volts, within which the mirrors still show a look: about 1.5 fovea px."""
SAME_SURFACE = 0.03
"""Relative tolerance between a look's depth and the wide pixel's, for the look to be measured there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedPoint:
    """A measured point with its look and pixel; `used_px`: the pixel of the view that was measured."""

    request: PlaceRequest
    point: MeasuredPoint
    used_px: Pixel
    snapped_px: float
    at_edge: bool
    fixation_id: str
    look: LookDepth | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownViews:
    """The mirrors' volts now, and the time of a view's newest picture (None: none yet)."""

    volts: Callable[[], StereoVolts | None]
    picture_t_ns: Callable[[str], int | None]


class PointFinder:
    """Finds the points that pixels show."""

    def __init__(self, looks: LookReader, patches: DepthOfPixels, shown: ShownViews) -> None:
        self._looks = looks
        self._patches = patches
        self._shown = shown

    def point(self, place: PlaceRequest, *, wide: Intrinsics) -> PlacedPoint:
        """Return the point at a pixel; raise OutOfRange, NotFound or StaleView with a remedy."""
        if MeasuredView(place.view) is MeasuredView.WIDE:
            return self._wide_point(place, wide)
        fixation_id, look = self.look_of(place, wide=wide)
        view, pixel = MeasuredView(place.view), (place.x_px, place.y_px)
        views = ViewMap(look=look, wide=wide)
        if view is MeasuredView.RIGHT:
            found = nearest_known_right(look, views.to_right_window(pixel), reach_px=REACH_PX)
        else:
            found = nearest_known(look, *views.to_window(view, pixel, z_m=math.nan), reach_px=REACH_PX)
        if found is None:
            raise _no_texture(place)
        used_px = views.from_window(view, found, z_m=float(look.z_m[found[1], found[0]]))
        return _placed(place, look, found, used_px=used_px, fixation_id=fixation_id)

    def look_of(self, place: PlaceRequest, *, wide: Intrinsics) -> tuple[str, LookDepth]:
        """Return the look that a fovea's or window view shows; raise OutOfRange for a pixel outside."""
        fixation_id = place.fixation_id or self._looks.newest_id()
        look = self._looks.get(fixation_id)
        view = MeasuredView(place.view)
        asked_look = place.fixation_id is not None and view in WINDOWS  # its picture is kept
        if not asked_look and not same_gaze(look.volts, self._shown.volts()):
            t_ns = self._shown.picture_t_ns(place.view)
            if view not in WINDOWS or (t_ns is not None and t_ns != look.t_ns):
                raise StaleView(
                    f"the foveae have turned away since fixation {fixation_id}, or no depth is kept yet",
                    asked=f"a point in the view {place.view}",
                    found="mirrors that stand elsewhere",
                    remedy="look at its target again, or measure in the wide view",
                )
        _check_inside(place, ViewMap(look=look, wide=wide).size_px(view))
        return fixation_id, look

    def covering(self, place: PlaceRequest, *, wide: Intrinsics) -> tuple[str, LookDepth, float]:
        """Return the look that covers a wide pixel, and the depth there, m."""
        reading = self._patches.at(place.x_px, place.y_px, wide=wide)
        return reading.fixation_id, self._looks.get(reading.fixation_id), reading.point_rig_m[2]

    def _wide_point(self, place: PlaceRequest, wide: Intrinsics) -> PlacedPoint:
        pixel = (place.x_px, place.y_px)
        reading = self._patches.at(*pixel, wide=wide)
        z_m = reading.point_rig_m[2]
        look = self._looks.find(reading.fixation_id)
        if look is not None:
            views = ViewMap(look=look, wide=wide)
            found = nearest_known(
                look, *views.to_window(MeasuredView.WIDE, pixel, z_m=z_m), reach_px=REACH_PX
            )
            if found is not None and abs(float(look.z_m[found[1], found[0]]) / z_m - 1.0) < SAME_SURFACE:
                used_px = views.from_window(MeasuredView.WIDE, found, z_m=float(look.z_m[found[1], found[0]]))
                return _placed(place, look, found, used_px=used_px, fixation_id=reading.fixation_id)
        sigma_z_m = reading.distance_sigma_m * z_m / reading.distance_m
        point = lone_point(reading.point_rig_m, sigma_z_m=sigma_z_m)
        return PlacedPoint(
            request=place,
            point=point,
            used_px=wide_pixel(wide, reading.point_rig_m),
            snapped_px=0.0,
            at_edge=False,
            fixation_id=reading.fixation_id,
            look=None,
        )


def same_gaze(a: StereoVolts, b: StereoVolts | None) -> bool:
    """Return whether both mirrors have the same volts within `SAME_GAZE_V`; False while `b` is unknown."""
    if b is None:
        return False
    pairs = ((a.left.x_v, b.left.x_v), (a.left.y_v, b.left.y_v), (a.right.x_v, b.right.x_v))
    return all(abs(one - other) <= SAME_GAZE_V for one, other in (*pairs, (a.right.y_v, b.right.y_v)))


def _placed(
    place: PlaceRequest, look: LookDepth, found: tuple[int, int], *, used_px: Pixel, fixation_id: str
) -> PlacedPoint:
    asked_px = (place.x_px, place.y_px)
    own_px = 1.0 / look.scale if place.view in (MeasuredView.LEFT, MeasuredView.RIGHT) else 1.0
    moved_px = math.dist(used_px, asked_px)
    return PlacedPoint(
        request=place,
        point=point_at(look, *found, look_id=fixation_id),
        used_px=used_px,
        snapped_px=moved_px if moved_px > own_px else 0.0,  # smaller: only rounding to the nearest pixel
        at_edge=beside_edge(look, *found),
        fixation_id=fixation_id,
        look=look,
    )


def _check_inside(place: PlaceRequest, size_px: tuple[int, int]) -> None:
    width, height = size_px
    if -0.5 <= place.x_px <= width - 0.5 and -0.5 <= place.y_px <= height - 0.5:
        return
    beside = (
        " (the scale stands there)"
        if MeasuredView(place.view) is MeasuredView.DEPTH and place.x_px > width - 0.5
        else ""
    )
    raise OutOfRange(
        f"pixel ({place.x_px:g}, {place.y_px:g}) is outside the view {place.view}{beside}: x from -0.5 to "
        f"{width - 0.5:g}, y from -0.5 to {height - 0.5:g} px",
        asked=f"({place.x_px:g}, {place.y_px:g})",
        found=f"a picture of {width} x {height} px",
        remedy="choose a pixel inside",
    )


def _no_texture(place: PlaceRequest) -> NotFound:
    return NotFound(
        f"there is no depth at ({place.x_px:g}, {place.y_px:g}) of the view {place.view} nor close by: no "
        "texture there, or only one fovea sees it",
        asked=f"a point at ({place.x_px:g}, {place.y_px:g})",
        found="no texture there, or hidden from one fovea",
        remedy="choose a pixel on texture that both foveae see",
    )
