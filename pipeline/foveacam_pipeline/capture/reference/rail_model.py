"""The unknowns of the stops in units of their standard errors; zero is what rail and calibration state."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.rail_stops import EYES, RailStop
from foveacam_pipeline.capture.reference.values import Floats, RailTrust
from foveacam_pipeline.capture.reference.views import StopPose
from foveacam_pipeline.models.calibration import Calibration

RAIL = 3
"""Number of unknowns of the rail: its scale, and the tilt of its axis up and forward."""
STOP = 6
"""Number of unknowns of a stop: along and off the axis (y, z), turn about x, y, z; the judged one: none."""
GAZES = 4
"""Number of gaze unknowns of a stop: (u, v) of the left and right eye, as mounts drift between scans."""
VIEW = 2
"""Number of unknowns of a view: (u, v), the error of a calibrated mirror that varies with direction."""
LOOK_PX = 0.15
"""Standard error of a view's unknowns, fovea px (measured on the simulated rig: 0.13)."""
COLUMNS = RAIL + STOP + 2 + VIEW
Integers = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RailModel:
    """Unknowns in order: the rail's, every stop's, every stop's gazes, every view's. `sigmas`: (n,)."""

    stops: tuple[RailStop, ...]
    judged: int
    sigmas: Floats

    @classmethod
    def of(
        cls,
        stops: Sequence[RailStop],
        judged: int,
        *,
        views: int,
        trust: RailTrust,
        calibration: Calibration,
        depth_m: float,
    ) -> "RailModel":
        """Return the model. A gaze's error is the calibration's at `depth_m`."""
        one = [trust.along_m, trust.across_m, trust.across_m, *[trust.turn_rad] * 3]
        gaze = [
            calibration.fovea_f_px * sigma
            for role in EYES
            for sigma in calibration.eye(role).angle_sigma_rad(depth_m)
        ]
        stop_poses = [[0.0] * STOP if number == judged else one for number in range(len(stops))]
        every = [trust.scale, trust.lean_rad, trust.lean_rad, *np.ravel(stop_poses), *(gaze * len(stops))]
        every += [LOOK_PX] * (VIEW * views)
        return cls(stops=tuple(stops), judged=judged, sigmas=np.array(every, dtype=np.float64))

    def stop_slice(self, stop: int) -> slice:
        """Return the indices of a stop's own unknowns."""
        return slice(RAIL + STOP * stop, RAIL + STOP * (stop + 1))

    def gaze_slice(self, stop: int) -> slice:
        """Return the indices of the gazes of a stop."""
        first = RAIL + STOP * len(self.stops) + GAZES * stop
        return slice(first, first + GAZES)

    @property
    def first_view(self) -> int:
        """Index of the first view's unknowns."""
        return RAIL + (STOP + GAZES) * len(self.stops)

    def columns(self, stop: Integers, eye: Integers, view: Integers) -> Integers:
        """Return (n, COLUMNS): the unknowns on which n rays depend."""
        rail = np.broadcast_to(np.arange(RAIL), (len(stop), RAIL))
        own = RAIL + STOP * stop[:, None] + np.arange(STOP)
        gaze = RAIL + STOP * len(self.stops) + GAZES * stop[:, None] + 2 * eye[:, None] + np.arange(2)
        look = self.first_view + VIEW * view[:, None] + np.arange(VIEW)
        return np.hstack([rail, own, gaze, look])

    def stop_poses(self, unknowns: Floats) -> tuple[StopPose, ...]:
        """Return the pose of the rig at every stop."""
        values = unknowns * self.sigmas
        axis = np.array([1.0, values[1], values[2]])
        axis *= (1.0 + values[0]) / np.linalg.norm(axis)
        stop_poses = []
        for number, stop in enumerate(self.stops):
            own = values[self.stop_slice(number)]
            turn, _ = cv2.Rodrigues(own[3:])
            stop_poses.append(
                StopPose(
                    position_m=stop.along_m * axis + own[:3],
                    turn=np.asarray(turn, dtype=np.float64),
                    shifts_px=values[self.gaze_slice(number)].reshape(2, 2),
                )
            )
        return tuple(stop_poses)

    def position_covariance(self, covariance: Floats, stop: int) -> Floats:
        """Return the (3, 3) covariance of a stop's position, m², from that of the unknowns."""
        slopes = np.zeros((3, len(self.sigmas)))
        slopes[:, :RAIL] = self.stops[stop].along_m * np.eye(3)
        slopes[:, self.stop_slice(stop).start : self.stop_slice(stop).start + 3] = np.eye(3)
        slopes *= self.sigmas
        return np.asarray(slopes @ covariance @ slopes.T, dtype=np.float64)
