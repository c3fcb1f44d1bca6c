"""When a sweep that goes on measuring one eye only is given up."""

from foveacam_hardware.contract import FoveaError, InvalidInput, OutOfRange, Role
from foveacam_pipeline.calibrate.sweep.centring import BEYOND
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_checks import EYES
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings


class SingleEyeLimit:
    """Ends a sweep that measures one eye only, with the reason.

    An eye that was never measured is given up soon; one that was, or is only beyond its volts, after two rows
    of poses: it may be the rim of the field that is out of its reach.
    """

    def __init__(self, sweep: Sweep, settings: SweepSettings) -> None:
        self._accepted = {role: len(sweep.accepted(role)) for role in EYES}
        self._refused = dict.fromkeys(EYES, 0)
        self._few = settings.give_up_after
        self._many = max(settings.give_up_after, 2 * sweep.header.plan.columns)

    def check(self, pose: SweepPose) -> None:
        """Raise InvalidInput or OutOfRange when an eye was refused too often."""
        for role in EYES:
            reason = pose.refusal(role)
            if reason is None:
                self._accepted[role] += 1
                self._refused[role] = 0
                continue
            self._refused[role] += 1
            at_the_rim = reason.startswith(BEYOND)
            if self._refused[role] >= (self._many if self._accepted[role] or at_the_rim else self._few):
                raise _end_error(role, self._refused[role], reason)


def _end_error(role: Role, times: int, reason: str) -> FoveaError:
    message = (
        f"sweep ended: the {role} eye was refused at {times} poses in a row, the last time because {reason}"
    )
    return OutOfRange(message) if reason.startswith(BEYOND) else InvalidInput(message)
