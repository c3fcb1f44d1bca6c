"""Deviation of the simulated mirrors from their static law: scatter from move to move, and hysteresis.

A deviation passes the same filter and resonance as the drive, so a mirror never jumps, and stays constant
while the mirror rests. Without a disturbance in the rig file there is none.
"""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.low_pass import DriveHistory
from foveacam_hardware.simulated_faults import MirrorDisturbance

LIGHT_PER_TILT = np.array([2.0, np.sqrt(2.0)])
"""Deflection of the line of sight by a tilt about x and y, in the middle of the field (mirror at 45°)."""


class RestDeviation:
    """Deviations of both mirrors' rest tilts; not thread safe (the world's lock guards it).

    Arrays are (2, 2) float64: left and right mirror, x and y, mechanical tilts, rad.
    """

    def __init__(
        self,
        disturbance: MirrorDisturbance,
        *,
        drive: DriveHistory,
        rest_rad: NDArray[np.float64],
        seed: int,
    ) -> None:
        self._scatter_rad = np.deg2rad(disturbance.scatter_rms_deg) / LIGHT_PER_TILT
        self._play_rad = np.deg2rad(disturbance.hysteresis_deg) / LIGHT_PER_TILT
        self._drive = drive
        self._rngs = [np.random.default_rng([seed, eye, 0xD15C]) for eye in (1, 2)]
        self._rest_rad = rest_rad
        self._followed_rad = rest_rad
        """Rest tilts that follow the law's by play: they move only when it is more than the play ahead."""
        self._drawn_rad = np.zeros((2, 2))
        self._deviation_rad = np.zeros((2, 2))

    def move(self, t_ns: int, rest_rad: NDArray[np.float64], *, dead: NDArray[np.bool_]) -> None:
        """Move the mirrors at `t_ns` to rest tilts of the static law; a mirror at rest keeps its deviation.

        `dead`: (2, 2) axes that do not move.
        """
        moved = (rest_rad != self._rest_rad).any(axis=1)
        if not moved.any():
            return
        for eye in np.flatnonzero(moved):
            self._drawn_rad[eye] = self._scatter_rad * self._rngs[eye].standard_normal(2)
        self._rest_rad = rest_rad
        self._followed_rad = np.clip(self._followed_rad, rest_rad - self._play_rad, rest_rad + self._play_rad)
        deviation_rad = self._followed_rad - rest_rad + self._drawn_rad
        self._deviation_rad = np.where(dead, self._deviation_rad, deviation_rad)
        self._drive.set_inputs(t_ns, self._deviation_rad.ravel())

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Set the cut-off of the drive's filters from `t_ns` on."""
        self._drive.set_low_pass(t_ns, cutoff_hz)

    def tilt_rad(self, t_ns: int) -> NDArray[np.float64]:
        """Return the deviations at `t_ns`: (4,), left x and y, then right."""
        return self._drive.output_v(t_ns)
