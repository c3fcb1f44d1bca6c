"""Moves the pan-tilt through the hardware thread, for REST and for a job with exclusive use of the rig."""

from concurrent.futures import Future

from foveacam_hardware.contract import (
    InvalidInput,
    PanTiltPose,
    PanTiltState,
    Station,
)
from foveacam_server.rig import refusals
from foveacam_server.rig.exclusive_pan_tilt import _pan_tilt_of, begin_homing, begin_move
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.status import PanTiltStatus


class PanTiltService:
    """Moves the pan-tilt; raises `Stopped` while stopped and `Busy` while a job has the rig."""

    def __init__(self, hardware: HardwareThread) -> None:
        self._hardware = hardware

    @property
    def status(self) -> PanTiltStatus | None:
        """The pan-tilt's last status; None when there is none."""
        return self._hardware.status.pan_tilt

    @property
    def usable(self) -> bool:
        """Whether the device is present and connected."""
        status = self.status
        return status is not None and status.state.connected

    @property
    def stations(self) -> tuple[Station, ...]:
        """Named poses of the pan-tilt, from the rig file."""
        return self._hardware.status.stations

    def station(self, name: str) -> Station:
        """Return a station by its name or raise `InvalidInput` that lists them."""
        for station in self.stations:
            if station.name == name:
                return station
        known = ", ".join(repr(station.name) for station in self.stations) or "none"
        raise InvalidInput(
            f"there is no station {name!r}; this rig has {known}",
            asked=f"station {name!r}",
            found=f"the stations are {known}",
            remedy="choose one, or name them in the rig's file",
        )

    def move(self, pose: PanTiltPose) -> "Future[None]":
        """Start a move; raise `OutOfRange`, `Busy`, `Stopped`, `NotConnected` at once or by the future."""
        self._check_free("turn the rig")
        return self._hardware.submit(lambda rig: begin_move(rig, pose, halted=lambda: self._hardware.halted))

    def home(self) -> "Future[None]":
        """Start homing: search the reference switches."""
        self._check_free("home the pan-tilt")
        return self._hardware.submit(lambda rig: begin_homing(rig, halted=lambda: self._hardware.halted))

    def confirm_zero(self) -> "Future[None]":
        """Take the present position as the zero, on the operator's confirmation."""
        self._check_free("take the pan-tilt's present pose as its zero")
        return self._hardware.submit(lambda rig: _pan_tilt_of(rig).confirm_zero())

    def hold(self) -> None:
        """Stop moving now, bypassing the queue."""
        self._hardware.hold_pan_tilt()

    def read_state(self) -> "Future[PanTiltState]":
        """Read the state from the device."""
        return self._hardware.submit(lambda rig: _pan_tilt_of(rig).state)

    def _check_free(self, asked: str) -> None:
        if self._hardware.halted:
            raise refusals.stopped()
        self._hardware.use.check_free(asked)
