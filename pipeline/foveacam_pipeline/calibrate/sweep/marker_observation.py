"""Observation of one eye's marker in a look: the gaze of the eye, and the reasons to refuse the observation.

Where the marker is missing, the gaze is estimated by matching the fovea, reduced to the scale of the wide
view, in the wide view.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Frame, Role
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px
from foveacam_pipeline.matching.correlation import best_outside, largest, score_map
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

MIN_SCORE = 0.55
"""Minimum correlation of a match in the wide view."""
MIN_SCORE_LEAD = 0.05
"""Minimum lead of that correlation over any other position."""
GUARD_PX = 9
FULL_LEVEL = 251.0
"""White above this level is clipped by its noise."""
WIDE_REDUCTION = 2
"""Sensor pixels along a side of a pixel of the images that are matched."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeObservation:
    """Observation of one eye in one look.

    `view`: of its own marker. `others`: the target's other markers, searched for when its own is missing.
    `size`: of the sensor, px. `volts_v`: (2,) in force. `image`: (h, w) or (h, w, 3) uint8, of `binning`.
    """

    role: Role
    t_ns: int
    size: tuple[int, int]
    volts_v: NDArray[np.float64]
    view: MarkerView | None
    others: dict[int, MarkerView]
    image: NDArray[np.uint8]
    binning: Binning = 1

    @property
    def offset_px(self) -> NDArray[np.float64]:
        """(2,) from the image's centre to the marker's middle; raise ValueError without a view."""
        if self.view is None:
            raise ValueError("an observation without its marker has no offset")
        return middle_px(self.view) - centre_px(self.size)


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerLimits:
    """Limits of a usable observation of a marker."""

    blur_fovea_px: float = 4.0
    blur_wide_px: float = 2.0
    stale_ms: float = 100.0


def centre_px(size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the centre of an image of (width, height)."""
    return np.array([(size[0] - 1) / 2.0, (size[1] - 1) / 2.0])


def observe_eye(frame: Frame, layout: MarkerLayout) -> EyeObservation:
    """Return the observation of an eye's marker in its frame."""
    image = to_uint8(frame)
    shades, own = gray(image), layout.id_of(frame.role)
    found = find_markers(shades, side_m=layout.side_m, large=True, only=(own,), binning=frame.binning)
    view, others = found.get(own), {}
    if view is None:
        others = find_markers(
            shades, side_m=layout.side_m, large=True, only=layout.ids, binning=frame.binning
        )
    volts = frame.volts
    return EyeObservation(
        role=frame.role,
        t_ns=frame.t_ns,
        size=(frame.binning * image.shape[1], frame.binning * image.shape[0]),
        volts_v=np.zeros(2) if volts is None else np.array([volts.x_v, volts.y_v]),
        view=view,
        others=others,
        image=image,
        binning=frame.binning,
    )


def gaze_on_target(
    view: MarkerView, size: tuple[int, int], target: TargetPose, role: Role
) -> NDArray[np.float64]:
    """Return the point of the target, (3,) metres in the rig frame, that the image centre sees."""
    scale_m = float(np.abs(view.places_m).max())
    matrix, _ = cv2.findHomography(view.corners_px, view.places_m / scale_m)
    x, y, w = (np.asarray(matrix) @ np.append(centre_px(size), 1.0)).tolist()
    return np.asarray(target.points_rig_m(scale_m * np.array([[x / w, y / w]]), role)[0])


def direction_rad(point_rig_m: NDArray[np.float64], eye_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (ax, ay) of a point from an eye, (2,) rad."""
    ray = point_rig_m - eye_rig_m
    return np.asarray(np.arctan(ray[:2] / ray[2]), dtype=np.float64)


def turn_between(view: MarkerView, other: MarkerView) -> float:
    """Return the rotation of a marker in one image against another, rad, clockwise > 0."""
    one, two = (v.corners_px[1] + v.corners_px[2] - v.corners_px[0] - v.corners_px[3] for v in (view, other))
    return math.atan2(one[1], one[0]) - math.atan2(two[1], two[0])


def gaze_from_wide(
    observation: EyeObservation,
    wide_gray: NDArray[np.uint8],
    wide: Intrinsics,
    target: TargetPose,
    *,
    zoom: float,
    turn_rad: float = 0.0,
) -> NDArray[np.float64] | None:
    """Return the point of the target's plane at which an eye looks, (3,) m, rig frame, to two wide pixels.

    `turn_rad`: rotation of the eye's image against the wide one. Return None when the match is not clear.
    """
    share = wide.binning_of(wide_gray.shape) / WIDE_REDUCTION
    whole = cv2.resize(wide_gray, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
    patch = _shrunk(gray(observation.image), observation.binning / (WIDE_REDUCTION * zoom), turn_rad)
    scores = score_map(np.asarray(whole, dtype=np.uint8), patch)
    x, y = largest(scores)
    best = float(scores[y, x])
    second = best_outside(scores, (x, y), guard_px=(GUARD_PX, GUARD_PX))
    if best < MIN_SCORE or best - second < MIN_SCORE_LEAD:
        return None
    half = (np.array([patch.shape[1], patch.shape[0]]) - 1.0) / 2.0
    pixel = (np.array([float(x), float(y)]) + half) * WIDE_REDUCTION + (WIDE_REDUCTION - 1) / 2.0
    ray = np.append(np.tan(wide.angles_rad(pixel[None])[0]), 1.0)
    normal = target.rotation[:, 2]
    return np.asarray(ray * float(target.middle_m @ normal) / float(ray @ normal))


def _shrunk(image: NDArray[np.uint8], scale: float, turn_rad: float) -> NDArray[np.uint8]:
    """Return the middle of an image, reduced and rotated upright, (h, w)."""
    height, width = image.shape[0] * scale, image.shape[1] * scale
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    across, down = math.cos(turn_rad), abs(math.sin(turn_rad))
    size = (int(width * across - height * down), int(height * across - width * down))
    middle = ((small.shape[1] - 1) / 2.0, (small.shape[0] - 1) / 2.0)
    turn = np.asarray(cv2.getRotationMatrix2D(middle, math.degrees(turn_rad), 1.0), dtype=np.float64)
    turn[:, 2] += np.array([size[0] - small.shape[1], size[1] - small.shape[0]]) / 2.0
    return np.asarray(cv2.warpAffine(small, turn, size, flags=cv2.INTER_LINEAR), dtype=np.uint8)


def rejection_reason(observation: EyeObservation, limits: MarkerLimits, *, asked_ns: int) -> str | None:
    """Return why an observation is unusable, as text for the operator; None when it is usable."""
    old_ms = (asked_ns - observation.t_ns) / 1e6
    if old_ms > limits.stale_ms:
        return f"stale: exposed {old_ms:.0f} ms before the look; check the camera's trigger and link"
    if observation.view is None:
        seen = (
            f" (it sees marker {', '.join(map(str, sorted(observation.others)))})"
            if observation.others
            else ""
        )
        return f"its marker is not in the view{seen}"
    return view_rejection_reason(observation.view, most_px=limits.blur_fovea_px)


def view_rejection_reason(view: MarkerView, *, most_px: float) -> str | None:
    """Return why the view of a marker is unusable, as text for the operator; None when it is usable."""
    if view.blur_px > most_px:
        return (
            f"blurred: the edges of marker {view.id} spread by {view.blur_px:.1f} px (sigma), at most "
            f"{most_px:g}; focus, and keep rig and target at rest"
        )
    if view.white_level > FULL_LEVEL:
        return (
            f"over-exposed: the white around marker {view.id} is at {view.white_level:.0f} of 255, moving "
            "its edges; expose for a shorter time"
        )
    if not view.complete:
        return f"marker {view.id} is partly seen: {len(view.corners_px)} of its corners; uncover it"
    return None
