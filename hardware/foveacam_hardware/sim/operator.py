"""Somebody who turns the simulated rig by hand: is told a bearing, and a while later the rig points there."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, PanTiltPose
from foveacam_hardware.operator_config import OperatorConfig
from foveacam_hardware.sim.pan_tilt import NS_PER_S, TurningHistory, TurnSegment

RAMP_S = 0.3
"""To get going, and to stop."""
REACTION_S = 0.2
MOST_SIGMAS = 2.0


class Operator:
    """Turns by hand what no motor turns; `hands` holds where that has brought the rig."""

    def __init__(self, hands: TurningHistory, clock: Clock, config: OperatorConfig, *, seed: int) -> None:
        self._hands = hands
        self._clock = clock
        self._config = config
        self._rng = np.random.default_rng([seed, 0x0BE7])

    def told(self, wanted: PanTiltPose | None) -> None:
        """Take note of a bearing that is wanted; None: let go of the rig, wherever it is."""
        now_ns = self._clock.now_ns()
        if wanted is None:
            self._rest(now_ns + round(REACTION_S * NS_PER_S))
            return
        begin_ns = now_ns + round(self._config.delay_s * NS_PER_S)
        self._rest(begin_ns)  # whatever was being done
        missed = np.clip(self._rng.standard_normal(2), -MOST_SIGMAS, MOST_SIGMAS) * self._config.error_deg
        goal = np.rad2deg([wanted.pan_rad, wanted.tilt_rad]) + missed
        self._turn(begin_ns, goal - np.array(self._hands.bearing_deg(begin_ns)))

    def _turn(self, t_ns: int, way_deg: NDArray[np.float64]) -> None:
        """Turn by (pan, tilt), degrees: get going, keep the pace, stop."""
        length_deg = float(np.linalg.norm(way_deg))
        if length_deg == 0.0:
            return
        speed_deg_s = min(self._config.speed_deg_s, length_deg / RAMP_S)
        steady_s = length_deg / speed_deg_s - RAMP_S
        pull_deg_s2 = speed_deg_s / RAMP_S
        pan, tilt = (way_deg / length_deg).tolist()
        for pull, spent_s in ((pull_deg_s2, RAMP_S), (0.0, steady_s), (-pull_deg_s2, RAMP_S)):
            speed = math.hypot(*self._hands.speed_deg_s(t_ns))
            turning = TurnSegment(
                t_ns=t_ns,
                place_deg=self._hands.bearing_deg(t_ns),
                speed_deg_s=(pan * speed, tilt * speed),
                acceleration_deg_s2=(pan * pull, tilt * pull),
            )
            self._hands.turn(turning)
            t_ns += round(spent_s * NS_PER_S)
        self._rest(t_ns)

    def _rest(self, t_ns: int) -> None:
        self._hands.turn(TurnSegment(t_ns=t_ns, place_deg=self._hands.bearing_deg(t_ns)))
