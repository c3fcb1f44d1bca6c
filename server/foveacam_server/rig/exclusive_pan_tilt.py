"""The pan-tilt for a job that has the rig exclusively, through the hardware thread."""

from collections.abc import Callable

from foveacam_hardware.contract import (
    Cancelled,
    DeviceInfo,
    PanTilt,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
)
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.refusals import no_pan_tilt
from foveacam_server.rig.status import PanTiltStatus


class ExclusivePanTilt:
    """Implements `PanTilt` for one job; the hardware thread connects and closes the device."""

    def __init__(
        self, hardware: HardwareThread, status: PanTiltStatus, *, cancelled: Callable[[], bool]
    ) -> None:
        self._hardware = hardware
        self._cancelled = cancelled
        self.info: DeviceInfo = status.info
        self.limits: PanTiltLimits = status.limits
        self.moves_itself: bool = status.moves_itself

    @property
    def state(self) -> PanTiltState:
        """Connection, motion and pose, read from the device."""
        self._check()
        return answer_of(
            self._hardware.submit(lambda rig: _pan_tilt_of(rig).state), asked="the pan-tilt's place"
        )

    def connect(self) -> None:
        """Do nothing: the hardware thread owns the connection."""

    def close(self) -> None:
        """Do nothing: the hardware thread owns the connection."""

    def home(self) -> None:
        """Start homing: search the reference switches."""
        self._check()
        begun = self._hardware.submit(lambda rig: begin_homing(rig, halted=lambda: self._hardware.halted))
        answer_of(begun, asked="a homing")

    def confirm_zero(self) -> None:
        """Take the present position as the zero, on the operator's confirmation."""
        self._check()
        answer_of(self._hardware.submit(lambda rig: _pan_tilt_of(rig).confirm_zero()), asked="a zero")

    def move_to(self, pose: PanTiltPose) -> None:
        """Start a move."""
        self._check()
        begun = self._hardware.submit(lambda rig: begin_move(rig, pose, halted=lambda: self._hardware.halted))
        answer_of(begun, asked="a turn of the rig")

    def hold(self) -> None:
        """Stop moving now, bypassing the queue; allowed to a cancelled job, too."""
        self._hardware.hold_pan_tilt()

    def _check(self) -> None:
        if self._cancelled():
            self.hold()
            raise Cancelled("the job was cancelled while it turned the rig")


def exclusive_pan_tilt(hardware: HardwareThread, *, cancelled: Callable[[], bool]) -> PanTilt | None:
    """Return the pan-tilt for a job that has the rig; None when the rig has none."""
    status = hardware.status.pan_tilt
    return None if status is None else ExclusivePanTilt(hardware, status, cancelled=cancelled)


def begin_move(rig: AssembledRig, pose: PanTiltPose, *, halted: Callable[[], bool]) -> None:
    """Start a move, in the hardware thread; hold it if the stop was engaged meanwhile."""
    _begin(rig, lambda pan_tilt: pan_tilt.move_to(pose), halted=halted)


def begin_homing(rig: AssembledRig, *, halted: Callable[[], bool]) -> None:
    """Start homing, in the hardware thread; hold it if the stop was engaged meanwhile."""
    _begin(rig, lambda pan_tilt: pan_tilt.home(), halted=halted)


def _begin(rig: AssembledRig, move: Callable[[PanTilt], None], *, halted: Callable[[], bool]) -> None:
    pan_tilt = _pan_tilt_of(rig)
    if halted():
        raise refusals.stopped()
    move(pan_tilt)
    if halted():  # the stop came between the check and the command on the wire
        pan_tilt.hold()
        raise refusals.stopped()


def _pan_tilt_of(rig: AssembledRig) -> PanTilt:
    if rig.pan_tilt is None:
        raise no_pan_tilt("turn the rig")
    return rig.pan_tilt
