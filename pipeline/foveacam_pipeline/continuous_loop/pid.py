"""The controller of one axis: parallel PID whose integral is the command itself."""

from foveacam_pipeline.continuous_loop.settings import Gains

LONGEST_STEP = 10.0
"""A longer pause between two looks counts as so much loop time."""
DERIVATIVE_TIME = 2.0
"""Time constant of the low-pass before the derivative, loop time."""


def loop_time(elapsed_s: float, sensitivity: float) -> float:
    """Return loop time of the time between two looks."""
    return min(LONGEST_STEP, 1000.0 * elapsed_s * sensitivity)


class Pid:
    """Changes a command by what a measured error asks for; the derivative acts on the measurement.

    As the integral is the command, another may set the command at any time without a jump afterwards.
    """

    def __init__(self) -> None:
        self._before_rad: float | None = None
        self._slope = 0.0

    def reset(self) -> None:
        """Forget the last measurement: the next one makes no derivative."""
        self._before_rad, self._slope = None, 0.0

    def change_rad(self, error_rad: float, measured_rad: float, *, dt: float, gains: Gains) -> float:
        """Return by how much the command is to change, rad.

        `measured_rad`: what the command has brought about, as seen; `dt`: loop time since the last look.
        """
        if self._before_rad is not None and dt > 0.0:
            share = dt / (dt + DERIVATIVE_TIME)
            self._slope += share * ((measured_rad - self._before_rad) / dt - self._slope)
        self._before_rad = measured_rad
        return (gains.kp + gains.ki * dt) * error_rad - gains.kd * self._slope
