"""What is not known of the stops, in units of its standard error; zero is what rail and calibration say."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.rail_stops import EYES, RailStop
from foveacam_pipeline.capture.reference.fovea_views import StopPose
from foveacam_pipeline.capture.reference.values import Floats, RailTrust
from foveacam_pipeline.models.calibration import Calibration

RAIL = 3
"""Its scale, how its axis stands up and forward."""
STOP = 6
"""Along and off the axis (y, z), turned about x, y, z; none for the judged one."""
GAZES = 4
"""(u, v) of the left and of the right eye, at one stop: their mounts wander between scans."""
SIGHT = 2
"""(u, v) of one look of one eye: what a calibrated mirror is off by from direction to direction."""
LOOK_PX = 0.15
"""Its standard error, fovea px (measured on the simulated rig: 0.13)."""
COLUMNS = RAIL + STOP + 2 + SIGHT
Whole = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RailModel:
    """Unknowns in order: the rail's, every stop's, every stop's gazes, every sight's. `sigmas`: (n,)."""

    stops: tuple[RailStop, ...]
    judged: int
    sigmas: Floats

    @classmethod
    def of(
        cls,
        stops: Sequence[RailStop],
        judged: int,
        *,
        sights: int,
        trust: RailTrust,
        calibration: Calibration,
        depth_m: float,
    ) -> "RailModel":
        """Return the model. A gaze's error is the calibration's, felt at `depth_m`."""
        one = [trust.along_m, trust.across_m, trust.across_m, *[trust.turn_rad] * 3]
        gaze = [
            calibration.fovea_f_px * sigma
            for role in EYES
            for sigma in calibration.eye(role).angle_sigma_rad(depth_m)
        ]
        stands = [[0.0] * STOP if number == judged else one for number in range(len(stops))]
        every = [trust.scale, trust.lean_rad, trust.lean_rad, *np.ravel(stands), *(gaze * len(stops))]
        every += [LOOK_PX] * (SIGHT * sights)
        return cls(stops=tuple(stops), judged=judged, sigmas=np.array(every, dtype=np.float64))

    def of_stop(self, stop: int) -> slice:
        """Return where a stop's own unknowns stand."""
        return slice(RAIL + STOP * stop, RAIL + STOP * (stop + 1))

    def of_gazes(self, stop: int) -> slice:
        """Return where the gazes of a stop stand."""
        first = RAIL + STOP * len(self.stops) + GAZES * stop
        return slice(first, first + GAZES)

    @property
    def first_sight(self) -> int:
        """Where the sights' unknowns begin."""
        return RAIL + (STOP + GAZES) * len(self.stops)

    def columns(self, stop: Whole, eye: Whole, sight: Whole) -> Whole:
        """Return (n, COLUMNS): which unknowns n rays depend on."""
        rail = np.broadcast_to(np.arange(RAIL), (len(stop), RAIL))
        own = RAIL + STOP * stop[:, None] + np.arange(STOP)
        gaze = RAIL + STOP * len(self.stops) + GAZES * stop[:, None] + 2 * eye[:, None] + np.arange(2)
        look = self.first_sight + SIGHT * sight[:, None] + np.arange(SIGHT)
        return np.hstack([rail, own, gaze, look])

    def stands(self, unknowns: Floats) -> tuple[StopPose, ...]:
        """Return where the rig stood at every stop."""
        values = unknowns * self.sigmas
        axis = np.array([1.0, values[1], values[2]])
        axis *= (1.0 + values[0]) / np.linalg.norm(axis)
        stands = []
        for number, stop in enumerate(self.stops):
            own = values[self.of_stop(number)]
            turn, _ = cv2.Rodrigues(own[3:])
            stands.append(
                StopPose(
                    place_m=stop.along_m * axis + own[:3],
                    turn=np.asarray(turn, dtype=np.float64),
                    shifts_px=values[self.of_gazes(number)].reshape(2, 2),
                )
            )
        return tuple(stands)

    def place_covariance(self, covariance: Floats, stop: int) -> Floats:
        """Return the (3, 3) covariance of a stop's place, m², from that of the unknowns."""
        slopes = np.zeros((3, len(self.sigmas)))
        slopes[:, :RAIL] = self.stops[stop].along_m * np.eye(3)
        slopes[:, self.of_stop(stop).start : self.of_stop(stop).start + 3] = np.eye(3)
        slopes *= self.sigmas
        return np.asarray(slopes @ covariance @ slopes.T, dtype=np.float64)
