"""Extended Kalman filter of position and velocity of a moving point, from directions and depths.

No library is used for six states and two kinds of measurement, 60 lines of linear algebra: filterpy is
unmaintained since 2018, Stone Soup is a whole framework.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ACCELERATION_PSD = 4.0
"""Power spectral density of a target's acceleration, m^2/s^3: walking in a circle of 1 m at 2 m/s."""
FIRST_SPEED_M_PER_S = 2.0
"""Standard deviation of the speed along each axis before it has been measured."""
GATE_SIGMAS = 6.0
"""Validation gate: a measurement with a larger Mahalanobis distance from the prediction is rejected."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PositionEstimate:
    """Position (3,) m and velocity (3,) m/s of a target, rig frame, with their (6, 6) covariance."""

    t_ns: int
    position_rig_m: NDArray[np.float64]
    velocity_rig_m_s: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @property
    def tangents(self) -> NDArray[np.float64]:
        """Direction from the rig's origin, (2,) tangents."""
        return np.asarray(self.position_rig_m[:2] / self.position_rig_m[2], dtype=np.float64)

    @property
    def inverse_z_per_m(self) -> float:
        """1/Z, 1/m."""
        return float(1.0 / self.position_rig_m[2])

    @property
    def distance_m(self) -> float:
        """Distance from the rig's origin, m."""
        return float(np.linalg.norm(self.position_rig_m))

    @property
    def distance_sigma_m(self) -> float:
        """Standard error of the distance, m."""
        way = self.position_rig_m / self.distance_m
        return float(np.sqrt(way @ self.covariance[:3, :3] @ way))

    @property
    def direction_sigma(self) -> float:
        """Standard error of the direction, the larger of both axes, tangents."""
        jacobian = _jacobian(self.position_rig_m)[:2]
        spread = jacobian @ self.covariance[:3, :3] @ jacobian.T
        return float(np.sqrt(np.diag(spread).max()))


class PositionFilter:
    """Kalman filter of one point whose velocity changes at random and fades."""

    def __init__(
        self,
        position_rig_m: NDArray[np.float64],
        *,
        sigma_m: float,
        t_ns: int,
        fading_s: float,
        velocity_rig_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """`sigma_m`: standard error of the position, each axis; that of the velocity is a constant.

        `fading_s`: time constant of the velocity, after which it is unrelated to what it was.
        """
        self._t_ns = t_ns
        self._fading_s = fading_s
        self._state = np.concatenate([position_rig_m, velocity_rig_m_s])
        self._covariance = np.diag([sigma_m**2] * 3 + [FIRST_SPEED_M_PER_S**2] * 3)

    def copy(self) -> "PositionFilter":
        """Return an independent filter with the same state and covariance."""
        other = PositionFilter(self._state[:3], sigma_m=1.0, t_ns=self._t_ns, fading_s=self._fading_s)
        other._state, other._covariance = self._state.copy(), self._covariance.copy()
        return other

    def at(self, t_ns: int) -> PositionEstimate:
        """Return the estimate at a time, before or after the newest measurement."""
        state, covariance = self._moved(t_ns)
        return PositionEstimate(
            t_ns=t_ns, position_rig_m=state[:3], velocity_rig_m_s=state[3:], covariance=covariance
        )

    def see(
        self,
        t_ns: int,
        tangents: NDArray[np.float64],
        *,
        sigma: float,
        inverse_z_per_m: float | None = None,
        inverse_z_sigma_per_m: float = 0.0,
    ) -> bool:
        """Update with a direction, (2,) tangents and their standard error, and with 1/Z if it was measured.

        Return False, unchanged, for a measurement outside the gate. One older than the newest is compared
        with the position extrapolated back to its time.
        """
        state, covariance = self._moved(max(t_ns, self._t_ns))
        back_s = min(0.0, (t_ns - self._t_ns) / 1e9)
        then = state[:3] + back_s * state[3:]
        x, y, z = then
        innovation = tangents - np.array([x, y]) / z
        rows, noise = [0, 1], [sigma**2, sigma**2]
        if inverse_z_per_m is not None:
            innovation = np.append(innovation, inverse_z_per_m - 1.0 / z)
            rows, noise = [0, 1, 2], [*noise, inverse_z_sigma_per_m**2]
        jacobian = np.zeros((len(rows), 6))
        jacobian[:, :3] = _jacobian(then)[rows]
        jacobian[:, 3:] = back_s * jacobian[:, :3]
        spread = jacobian @ covariance @ jacobian.T + np.diag(noise)
        if float(innovation @ np.linalg.solve(spread, innovation)) > GATE_SIGMAS**2:
            return False
        gain = np.linalg.solve(spread, jacobian @ covariance).T
        kept = np.eye(6) - gain @ jacobian
        self._t_ns = max(t_ns, self._t_ns)
        self._state = state + gain @ innovation
        self._covariance = kept @ covariance @ kept.T + gain @ np.diag(noise) @ gain.T
        return True

    def _moved(self, t_ns: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return state and covariance predicted to `t_ns`, with process noise for the interval."""
        dt_s = (t_ns - self._t_ns) / 1e9
        transition, noise = _motion(dt_s, self._fading_s) if dt_s >= 0.0 else _motion_back(dt_s)
        step, spread = np.kron(transition, np.eye(3)), np.kron(noise, np.eye(3))
        return step @ self._state, step @ self._covariance @ step.T + spread


def led_s(dt_s: float, fading_s: float) -> float:
    """Return how long a constant velocity takes for the way of a fading one in `dt_s`.

    Back in time (`dt_s` < 0) no velocity fades: the same time is returned.
    """
    return dt_s if dt_s < 0.0 else fading_s * (1.0 - math.exp(-dt_s / fading_s))


def _motion(dt_s: float, fading_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the transition of position and velocity along one axis, (2, 2), and its noise.

    An integrated Ornstein-Uhlenbeck process: the velocity fades with the time constant `fading_s`.
    """
    kept, twice = math.exp(-dt_s / fading_s), math.exp(-2.0 * dt_s / fading_s)
    moved_s = led_s(dt_s, fading_s)
    speed = fading_s / 2.0 * (1.0 - twice)
    place = fading_s**2 * (dt_s - 2.0 * moved_s + speed)
    both = moved_s**2 / 2.0
    return np.array([[1.0, moved_s], [0.0, kept]]), ACCELERATION_PSD * np.array(
        [[place, both], [both, speed]]
    )


def _motion_back(dt_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the same for a short time back, at constant velocity; its noise adds to the uncertainty too."""
    age_s = -dt_s
    noise = np.array([[age_s**3 / 3.0, age_s**2 / 2.0], [age_s**2 / 2.0, age_s]])
    return np.array([[1.0, dt_s], [0.0, 1.0]]), ACCELERATION_PSD * noise


def _jacobian(position_rig_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivative of (X/Z, Y/Z, 1/Z) by the position, (3, 3)."""
    x, y, z = position_rig_m
    return np.array([[1.0 / z, 0.0, -x / z**2], [0.0, 1.0 / z, -y / z**2], [0.0, 0.0, -1.0 / z**2]])
