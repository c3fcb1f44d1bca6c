"""Pictures of a check: row differences over the field, foveae in the wide view, anaglyphs."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role, Sighting
from foveacam_pipeline.calibrate.fit.check import CheckResult
from foveacam_pipeline.calibrate.fit.fit_pictures import png
from foveacam_pipeline.calibrate.fit.fovea_in_wide import footprint_window, fovea_in_wide
from foveacam_pipeline.diagrams import new_figure
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.pictures import anaglyph
from foveacam_pipeline.stereo.rectify import rectify, to_uint8

_DPI = 110
_ZOOM = 4.0
_TILE = 64
_LEAST_SPAN_PX = 0.5
_PART_PX = 300.0


def check_pictures(result: CheckResult, calibration: Calibration) -> dict[str, Callable[[], bytes]]:
    """Return the function that draws each picture of a check, by the name of its file."""
    return {
        "epipolar": lambda: epipolar_picture(result, calibration),
        "overlay": lambda: overlay_picture(result, calibration),
        "anaglyph_before": lambda: anaglyph_picture(_farthest_look(result), calibration, rectified=False),
        "anaglyph_after": lambda: anaglyph_picture(_farthest_look(result), calibration, rectified=True),
    }


def epipolar_picture(result: CheckResult, calibration: Calibration) -> bytes:
    """Return a PNG of the row differences of the rectified eyes over the field, fovea px."""
    figure = new_figure((11.0, 5.2), dpi=_DPI)
    field, within = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    rows = np.array([match.rows_px for match in result.rows])
    gazes = np.rad2deg([match.gaze_rad for match in result.rows]).reshape(-1, 2)
    offsets = np.array([match.offset_px for match in result.rows]).reshape(-1, 2)
    span = max(_LEAST_SPAN_PX, float(np.abs(rows).max(initial=0.0)))
    inside = np.rad2deg(offsets / calibration.fovea_f_px)
    look = {
        "c": rows,
        "cmap": "coolwarm",
        "vmin": -span,
        "vmax": span,
        "edgecolors": "0.3",
        "linewidths": 0.5,
    }
    shown = field.scatter(*(gazes + inside).T, s=48, **look)
    for role, colour in ((Role.LEFT, "#2471a3"), (Role.RIGHT, "#d35400")):
        hull = np.rad2deg(calibration.eye(role).mirror.hull_rad)
        field.plot(
            *np.vstack([hull, hull[:1]]).T, "-", color=colour, linewidth=0.9, label=f"{role} eye reaches"
        )
    field.set(xlabel="ax, deg (right)", ylabel="ay, deg (down)", title="where in the field of regard")
    field.legend(fontsize=8, loc="lower center")
    corners = np.sign(np.rint(offsets / _PART_PX))
    for corner in np.unique(corners, axis=0):
        here = (corners == corner).all(axis=1)
        words = f"{rows[here].mean():+.2f} ± {rows[here].std():.2f}"
        middle = np.median(offsets[here], axis=0)
        within.annotate(
            words, (middle[0], middle[1]), (0, 9), textcoords="offset points", ha="center", fontsize=8
        )
    within.scatter(*offsets.T, s=48, **look)
    within.margins(0.25)
    within.set(
        xlabel="fovea px right of the gaze",
        ylabel="fovea px below",
        title="where in the images (mean ± scatter)",
    )
    for axes in (field, within):
        axes.title.set_fontsize(10)
        axes.set_aspect("equal")
        axes.invert_yaxis()
        axes.grid(visible=True, alpha=0.25)
    figure.colorbar(shown, ax=within, label="left eye lower than right, fovea px", shrink=0.85)
    figure.suptitle(_caption(result), fontsize=10)
    return png(figure)


def overlay_picture(result: CheckResult, calibration: Calibration) -> bytes:
    """Return a PNG of all foveae drawn into the wide view, and of one of them in tiles with it, enlarged."""
    sighting = _farthest_look(result)
    figure = new_figure((13.0, 5.6), dpi=_DPI)
    whole, near = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    whole.imshow(result.mosaic)
    whole.set_title("foveae laid into the wide view by the fitted models", fontsize=10)
    near.imshow(tile_picture(sighting, calibration, Role.LEFT), cmap="gray", vmin=0, vmax=255)
    near.set_title("the farthest one: tiles of the wide view and of the left fovea", fontsize=10)
    for axes in (whole, near):
        axes.set_axis_off()
    return png(figure)


def tile_picture(sighting: Sighting, calibration: Calibration, role: Role) -> NDArray[np.uint8]:
    """Return a fovea in the wide view, enlarged, in alternating tiles whose edges show offsets."""
    window = footprint_window(calibration, role, sighting, zoom=_ZOOM)
    shown, seen = fovea_in_wide(sighting, calibration, role, window)
    wide = gray(to_uint8(sighting.wide))
    places = window.pixels.reshape(window.height, window.width, 2)
    x, y = (np.clip(np.rint(places[..., k]).astype(int), 0, wide.shape[1 - k] - 1) for k in (0, 1))
    around = wide[y, x]
    row, column = np.indices(shown.shape) // _TILE
    own = seen & ((row + column) % 2 == 0)
    return np.asarray(np.where(own, shown, around), dtype=np.uint8)


def anaglyph_picture(sighting: Sighting, calibration: Calibration, *, rectified: bool) -> bytes:
    """Return a PNG of both foveae in red and cyan, as read out or as rectified (Fig. 3)."""
    if rectified:
        picture = anaglyph(rectify(sighting, calibration))
    else:
        left, right = gray(to_uint8(sighting.left)), gray(to_uint8(sighting.right))
        picture = np.stack([left, right, right], axis=2)[::2, ::2]
    _, encoded = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    return encoded.tobytes()


def _farthest_look(result: CheckResult) -> Sighting:
    if result.farthest is None:
        raise InvalidInput("check: no look was kept to draw; check the calibration again")
    return result.farthest


def _caption(result: CheckResult) -> str:
    if result.epipolar_rms_px is None:
        return f"no row could be compared at {result.poses} poses"
    return (
        f"rows at {result.poses} poses outside the sweep: {result.epipolar_rms_px:.2f} px rms, 95 % below "
        f"{result.epipolar_p95_px:.2f} px ({len(result.rows)} places)"
    )
