"""Thermal drift of the eyes' mounts: a slow function of time, so that a calibration ages."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role

PERIODS_S = (1380.0, 421.0)  # deduced: a room's heating cycle, and the electronics' own
SHARES = (0.7, 0.3)


class ThermalMountDrift:
    """Turn of each eye's mount about the rig's x and y; zero when the world begins."""

    def __init__(self, *, seed: int, amplitude_rad: float = float(np.deg2rad(0.002))) -> None:
        self.amplitude_rad = amplitude_rad
        phases = np.random.default_rng([seed, 0xD21F]).uniform(0.0, 2.0 * np.pi, (2, 2, len(PERIODS_S)))
        self._phases = {Role.LEFT: phases[0], Role.RIGHT: phases[1]}

    def turn_rad(self, role: Role, t_s: float) -> NDArray[np.float64]:
        """Return the turn (2,) about x and y, radians, `t_s` after the beginning."""
        phases = self._phases[role]
        swing = np.sin(2.0 * np.pi * t_s / np.array(PERIODS_S) + phases) - np.sin(phases)
        return np.asarray(self.amplitude_rad * (swing @ np.array(SHARES)), dtype=np.float64)
