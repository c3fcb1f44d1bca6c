"""Observations for Fig. 8: move the rig to positions, verge on the target, judge whether it is resolved.

The decision uses the frames and the rig's own measured distance alone. The target's labels are chequered and
turned by 45°: their rows (`pair_m`: one light and one dark row) look the same from every side.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Head, InvalidInput, OutOfRange, Role, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8
from foveacam_pipeline.study.visibility.toy_scene import STAND_HALF_M, AgentPose
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import DirectionTarget, Fixation, FixationState
from foveacam_pipeline.workers.progress import ProgressSteps, ProgressWatcher

WAVELENGTH_M = 550e-9
"""Green, where a camera's silicon and daylight meet."""
APERTURE_M = 0.100 / 21.5
"""The fovea's pupil: a lens of 100 mm at about f/21.5 (Table 2)."""
RAYLEIGH = 1.22
"""The first zero of Airy's disc, in wavelengths over apertures."""
HEADING_STEP_RAD = math.radians(10.0)
"""The base turns the rig by whole steps of this size; the mirrors cover the rest."""
REST_NS = 300_000_000
"""Wait after a move, until the wide camera has a new frame."""
WINDOW_PAIRS = 7.0
"""Width of the averaging window (two box filters) for the rows' contrast, in pairs of rows."""
AROUND_M = 0.06
"""A label is searched within this distance of the point that the rig verged on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckeredLabel:
    """A chequered label: `pair_m` is the height of a light and a dark row, the feature S_t of Eq. 6."""

    pair_m: float = 1e-3
    light: float = 0.92
    dark: float = 0.06

    @property
    def row_contrast(self) -> float:
        """Contrast of the rows before any lens: first harmonic of a chequer along its diagonal, 8/pi²."""
        return 8.0 / math.pi**2 * (self.light - self.dark) / (self.light + self.dark)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceObservation:
    """The result at one position; distances are to the middle of the target's stand."""

    pose: AgentPose
    state: str
    distance_m: float | None
    contrast: float
    """Contrast of a label's rows in the poorer eye; 0 where the rig did not verge."""
    resolved: bool
    success: bool
    """Resolved, and from farther away than D_min by the rig's own distance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """A rig that can be moved; `set_pose` returns when the rig is at the pose."""

    head: Head
    calibration: Calibration
    clock: Clock
    set_pose: Callable[[AgentPose], None]


def rayleigh_rad(*, wavelength_m: float = WAVELENGTH_M, aperture_m: float = APERTURE_M) -> float:
    """Return the angle at which a lens resolves two points, rad (Rayleigh's criterion)."""
    return RAYLEIGH * wavelength_m / aperture_m


def rayleigh_transfer() -> float:
    """Return the contrast that an ideal lens keeps of lines a Rayleigh angle apart: 8.9 %."""
    share = 1.0 / RAYLEIGH  # of the frequency beyond which a round lens passes nothing
    return 2.0 / math.pi * (math.acos(share) - share * math.sqrt(1.0 - share**2))


def least_contrast(label: CheckeredLabel) -> float:
    """Return the least contrast at which the rows count as resolved."""
    return rayleigh_transfer() * label.row_contrast


def pose_facing(x_m: float, y_m: float, target_m: tuple[float, float]) -> AgentPose:
    """Return the pose whose heading, in whole steps, is nearest to the target's bearing."""
    bearing_rad = math.atan2(target_m[0] - x_m, target_m[1] - y_m)
    return AgentPose(x_m=x_m, y_m=y_m, heading_rad=HEADING_STEP_RAD * round(bearing_rad / HEADING_STEP_RAD))


def observe(
    observer: Observer,
    poses: Sequence[AgentPose],
    *,
    target_m: tuple[float, float],
    d_min_m: float,
    label: CheckeredLabel,
    watch: ProgressWatcher,
) -> tuple[PlaceObservation, ...]:
    """Observe the target from each pose in turn. Raise Cancelled when the watcher asks."""
    steps = ProgressSteps(watch, len(poses), ended="the positions were not all visited; run it again")
    found = []
    for pose in poses:
        found.append(_observed(observer, pose, target_m=target_m, d_min_m=d_min_m, label=label))
        steps.step("Fig. 8: observing")
    return tuple(found)


def row_contrast(sighting: Sighting, role: Role, calibration: Calibration, *, pair_px: float) -> float:
    """Return the largest contrast of rows `pair_px` apart (fovea px, upright) near the frame's middle.

    The frame is multiplied by a wave of that period along the vertical of the virtual plane and averaged
    over a window of `WINDOW_PAIRS` periods: twice the amplitude, over the mean, is the rows' contrast.
    """
    image = gray(to_uint8(sighting.left if role is Role.LEFT else sighting.right)).astype(np.float32)
    height, width = image.shape
    half = round(AROUND_M * pair_px / CheckeredLabel().pair_m)
    rows = slice(max(0, height // 2 - half), min(height, height // 2 + half))
    columns = slice(max(0, width // 2 - half), min(width, width // 2 + half))
    H = plane_from_raw(calibration, role, sighting.volts, depth_m=math.inf)
    y, x = np.mgrid[rows, columns].astype(np.float64)
    down_px = (H[1, 0] * x + H[1, 1] * y + H[1, 2]) / (H[2, 0] * x + H[2, 1] * y + H[2, 2])
    return _wave_contrast(image[rows, columns], 2.0 * np.pi * down_px / pair_px, pair_px=pair_px)


def _wave_contrast(image: NDArray[np.float32], phase_rad: NDArray[np.float64], *, pair_px: float) -> float:
    window = max(3, round(WINDOW_PAIRS * pair_px))
    level = _averaged(image, window)
    even, odd = ((image - level) * wave(phase_rad).astype(np.float32) for wave in (np.cos, np.sin))
    contrast = 2.0 * np.hypot(_averaged(even, window), _averaged(odd, window)) / np.maximum(level, 1.0)
    return float(contrast.max())


def _averaged(image: NDArray[np.float32], window: int) -> NDArray[np.float32]:
    once = cv2.blur(image, (window, window))
    return np.asarray(cv2.blur(once, (window, window)), dtype=np.float32)


def fixate_target(observer: Observer, pose: AgentPose, *, target_m: tuple[float, float]) -> Fixation | None:
    """Move to a pose, aim at the target's position on the plan, and verge; None where it is out of view.

    Raise InvalidInput for a pose that does not face the target.
    """
    bearing_rad = math.atan2(target_m[0] - pose.x_m, target_m[1] - pose.y_m)
    aside_rad = math.remainder(bearing_rad - pose.heading_rad, 2.0 * math.pi)
    if abs(aside_rad) > HEADING_STEP_RAD:
        raise InvalidInput(
            f"the pose at ({pose.x_m:g}, {pose.y_m:g}) m looks {math.degrees(aside_rad):.0f}° past the "
            "target; turn it towards the target"
        )
    observer.set_pose(pose)
    observer.clock.sleep_until_ns(observer.clock.now_ns() + REST_NS)
    target = DirectionTarget(ax_rad=aside_rad, ay_rad=0.0)
    try:
        return fixate(observer.head, observer.calibration, target, clock=observer.clock)
    except OutOfRange:
        return None


def _observed(
    observer: Observer,
    pose: AgentPose,
    *,
    target_m: tuple[float, float],
    d_min_m: float,
    label: CheckeredLabel,
) -> PlaceObservation:
    fixation = fixate_target(observer, pose, target_m=target_m)
    if fixation is None:
        return _not_observed(pose, FixationState.OUT_OF_RANGE)
    if fixation.point_rig_m is None:
        return _not_observed(pose, fixation.state)
    contrast = _poorer_contrast(fixation, observer.calibration, label)
    distance_m = math.hypot(fixation.point_rig_m[0], fixation.point_rig_m[2]) + STAND_HALF_M
    resolved = contrast >= least_contrast(label)
    return PlaceObservation(
        pose=pose,
        state=fixation.state.value,
        distance_m=distance_m,
        contrast=contrast,
        resolved=resolved,
        success=resolved and distance_m > d_min_m,
    )


def _poorer_contrast(fixation: Fixation, calibration: Calibration, label: CheckeredLabel) -> float:
    if fixation.point_rig_m is None or fixation.sighting is None:
        return 0.0
    pair_px = label.pair_m * calibration.fovea_f_px / fixation.point_rig_m[2]
    sighting = fixation.sighting
    return min(row_contrast(sighting, role, calibration, pair_px=pair_px) for role in (Role.LEFT, Role.RIGHT))


def _not_observed(pose: AgentPose, state: FixationState) -> PlaceObservation:
    return PlaceObservation(
        pose=pose, state=state.value, distance_m=None, contrast=0.0, resolved=False, success=False
    )
