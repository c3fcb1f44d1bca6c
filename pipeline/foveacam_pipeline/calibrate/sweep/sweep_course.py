"""Course of the base during a sweep: to the gazes of the plan, as far as both eyes can follow.

The base's error at the last gaze corrects the next one, because a pan-tilt is mounted a little crooked.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import PanTiltPose
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.markers import middle_px
from foveacam_pipeline.calibrate.sweep.sweep import SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_pose import EYES, PoseMeter
from foveacam_pipeline.models.intrinsics import Intrinsics

MAX_BASE_ERROR_RAD = math.radians(3.0)
"""Maximum error of a pan-tilt that is used as a correction."""


class SweepCourse:
    """Turns the base with `turn_to` and measures there, with the corrections learnt so far."""

    def __init__(
        self,
        turn_to: Callable[[NDArray[np.float64]], PanTiltPose | None],
        meter: PoseMeter,
        wide: Intrinsics,
        *,
        wide_id: int,
        approach_rad: float,
    ) -> None:
        self._turn_to = turn_to
        self._meter = meter
        self._wide = wide
        self._wide_id = wide_id
        self._approach_rad = approach_rad
        self._here = np.zeros(2)
        self._base_error_rad = np.zeros(2)

    def measure(self, index: int, node_rad: NDArray[np.float64], target: TargetPose) -> SweepPose:
        """Measure a pose of the plan; repeat it less far out when an eye was beyond its volts."""
        for node in self._approach(node_rad):
            self._measure_at(node, 0, node)
        self._here = node_rad
        pose = self._measure_at(self._meter.reachable_gaze(node_rad, target), index, node_rad)
        nearer = self._meter.retreat_gaze(pose, target)
        if nearer is None:
            return pose
        again = self._measure_at(nearer, index, node_rad)
        return again if again.eyes_measured >= pose.eyes_measured else pose

    def _approach(self, there: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Return intermediate gazes on the way to a gaze far from all known ones."""
        far = 1.5 * self._approach_rad
        if all(self._meter.predictions[role].nearest_rad(there) <= far for role in EYES):
            return []
        way = there - self._here
        steps = math.ceil(float(np.linalg.norm(way)) / self._approach_rad)
        return [self._here + way * k / steps for k in range(1, steps)]

    def _measure_at(
        self, gaze_rad: NDArray[np.float64], index: int, node_rad: NDArray[np.float64]
    ) -> SweepPose:
        requested = gaze_rad - self._base_error_rad
        base = self._turn_to(requested)
        pose = self._meter.measure(index, (float(node_rad[0]), float(node_rad[1])), base)
        if self._wide_id in pose.wide:
            error = self._wide.angles_rad(middle_px(pose.wide[self._wide_id])[None])[0] - requested
            if np.abs(error).max() <= MAX_BASE_ERROR_RAD:
                self._base_error_rad = error
        return pose
