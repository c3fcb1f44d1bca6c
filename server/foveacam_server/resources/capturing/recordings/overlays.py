"""Overlays of a recording's wide picture: boxes of targets, and the point where the gazes cross."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.session import APP, SESSION, read_wide_lens
from foveacam_pipeline.capture.recording.values import FramePose, nearest_index
from foveacam_pipeline.geometry.angles import angles_from_rays, angles_from_tan
from foveacam_server.resources.capturing.recordings.schema import RecordedBox

BOX_AGE_NS = 250_000_000
"""Largest time between a box and the wide frame with which it is shown: targets are tracked in turn."""


def wide_boxes(recording: Recording, t_ns: int) -> list[RecordedBox]:
    """Return the boxes of the targets near the wide frame that is nearest to a time, px of that frame."""
    wide = recording.stream_of_role(Role.WIDE)
    if wide is None or len(wide) == 0:
        return []
    frame_ns = int(wide.t_ns[nearest_index(wide.t_ns, t_ns)])
    found = []
    for box in recording.boxes(frame_ns, within_ns=BOX_AGE_NS):
        if box.bbox_px is None:
            continue
        x, y, width, height = box.bbox_px
        if not _is_ours(recording):  # the authors' boxes are in the undistorted picture
            moved = distorted_px(recording, np.array([[x + width / 2.0, y + height / 2.0]]))[0]
            x, y = float(moved[0]) - width / 2.0, float(moved[1]) - height / 2.0
        found.append(
            RecordedBox(
                slot=box.slot,
                x_px=round(x, 2),
                y_px=round(y, 2),
                width_px=round(width, 2),
                height_px=round(height, 2),
                late_ms=round((box.t_ns - frame_ns) / 1e6, 3),
            )
        )
    return found


def wide_pixel(recording: Recording, point_m: NDArray[np.float64]) -> tuple[float, float] | None:
    """Return the raw wide px of a point (3,) m, rig frame; None where the lens is unknown."""
    lens = recording.wide_lens
    if lens is None:
        return None
    (found,) = lens.pixels(angles_from_rays(point_m[None, :]))
    if not np.isfinite(found).all():
        return None
    return round(float(found[0]), 2), round(float(found[1]), 2)


def distorted_px(recording: Recording, undistorted_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return undistorted wide px (n, 2) in the raw picture; unchanged where the lens is unknown."""
    lens = recording.wide_lens
    if lens is None:
        return undistorted_px
    centre, focal = np.array([lens.cx_px, lens.cy_px]), np.array([lens.fx_px, lens.fy_px])
    return lens.pixels(angles_from_tan((undistorted_px - centre) / focal))


def crossing_of_angles(recording: Recording, left: FramePose, right: FramePose) -> NDArray[np.float64] | None:
    """Return where gazes of recorded angles cross, (3,) m; None without them or if they do not.

    The eyes are at half the baseline on either side (Sec. 3.2).
    """
    recorded = read_wide_lens(recording.metadata)
    baseline_m = None if recorded is None else recorded[1]
    if baseline_m is None or left.angles_rad is None or right.angles_rad is None:
        return None
    slope_left, slope_right = math.tan(left.angles_rad[0]), math.tan(right.angles_rad[0])
    if slope_left - slope_right <= 0.0:
        return None
    z_m = baseline_m / (slope_left - slope_right)
    slope_y = (math.tan(left.angles_rad[1]) + math.tan(right.angles_rad[1])) / 2.0
    return np.array([z_m * (slope_left + slope_right) / 2.0, z_m * slope_y, z_m])


def _is_ours(recording: Recording) -> bool:
    return recording.metadata.get(SESSION, {}).get("app") == APP
