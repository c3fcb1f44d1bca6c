"""Controller of one axis: parallel PID whose output increments the command, which is thus the integral."""

from foveacam_pipeline.continuous_loop.settings import Gains

LONGEST_STEP = 10.0
"""Upper limit of the loop time between two looks, so that a pause makes no large integral step."""
DERIVATIVE_TIME = 2.0
"""Time constant of the derivative's low-pass, loop time."""


def loop_time(elapsed_s: float, sensitivity: float) -> float:
    """Convert the time between two looks to loop time: ms times sensitivity, at most `LONGEST_STEP`."""
    return min(LONGEST_STEP, 1000.0 * elapsed_s * sensitivity)


class Pid:
    """Returns increments of a command from its measured error; the derivative acts on the measurement.

    The command is the integral, therefore it can be set from outside at any time without a jump (bumpless).
    """

    def __init__(self) -> None:
        self._before_rad: float | None = None
        self._slope = 0.0

    def reset(self) -> None:
        """Forget the last measurement, so that the next one has no derivative."""
        self._before_rad, self._slope = None, 0.0

    def change_rad(self, error_rad: float, measured_rad: float, *, dt: float, gains: Gains) -> float:
        """Return the increment of the command, rad.

        `measured_rad`: the controlled variable, for the derivative; `dt`: loop time since the last look.
        """
        if self._before_rad is not None and dt > 0.0:
            share = dt / (dt + DERIVATIVE_TIME)
            self._slope += share * ((measured_rad - self._before_rad) / dt - self._slope)
        self._before_rad = measured_rad
        return (gains.kp + gains.ki * dt) * error_rad - gains.kd * self._slope
