"""Protocols of the devices that carry the rig: a pan-tilt that turns it and a rail that moves it sideways."""

from typing import Protocol

from foveacam_hardware.contract.values import (
    DeviceInfo,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    RailLimits,
    RailState,
)


class PanTilt(Protocol):
    """Turns the whole rig. Calls return at once; a caller that waits for a move polls `state`."""

    @property
    def info(self) -> DeviceInfo:
        """Vendor, model, serial number, version and port of the device."""
        ...

    @property
    def limits(self) -> PanTiltLimits:
        """Reachable bearings."""
        ...

    @property
    def moves_itself(self) -> bool:
        """False when the operator turns the rig by hand: `move_to` then only shows the requested bearing."""
        ...

    @property
    def state(self) -> PanTiltState:
        """Whether it is connected and moving, and its position."""
        ...

    def connect(self) -> None:
        """Open the link and identify the device that answers."""
        ...

    def close(self) -> None:
        """Stop and release the device; do nothing when closed."""
        ...

    def home(self) -> None:
        """Begin to search for the reference switches."""
        ...

    def confirm_zero(self) -> None:
        """Accept the operator's confirmation that the device is at its zero position.

        Raise `InvalidInput` for a device that finds its zero by itself, `DeviceFault` when its state rules it
        out.
        """
        ...

    def move_to(self, pose: PanTiltPose) -> None:
        """Begin to move; raise `OutOfRange` beyond the limits, `DeviceFault` in an alarm state."""
        ...

    def hold(self) -> None:
        """Stop moving now, callable from any thread at any time."""
        ...


class Rail(Protocol):
    """Moves the whole rig sideways. Calls return at once; a caller that waits for a move polls `state`."""

    @property
    def info(self) -> DeviceInfo:
        """Vendor, model, serial number, version and port of the device."""
        ...

    @property
    def limits(self) -> RailLimits:
        """Reachable positions."""
        ...

    @property
    def moves_itself(self) -> bool:
        """False when the operator pushes the rig by hand: `move_to` then only shows the position."""
        ...

    @property
    def state(self) -> RailState:
        """Whether it is connected and moving, and its position."""
        ...

    def connect(self) -> None:
        """Open the link and identify the device that answers."""
        ...

    def close(self) -> None:
        """Stop and release the device; do nothing when closed."""
        ...

    def home(self) -> None:
        """Begin to search for the reference switch, then go to the centre of the rail."""
        ...

    def confirm_zero(self) -> None:
        """Accept the operator's confirmation that the device is at its zero position.

        Raise `InvalidInput` for a device that finds its zero by itself, `DeviceFault` when its state rules it
        out.
        """
        ...

    def move_to(self, position_m: float) -> None:
        """Begin to move; raise `OutOfRange` beyond the limits, `DeviceFault` in an alarm state."""
        ...

    def hold(self) -> None:
        """Stop moving now, callable from any thread at any time."""
        ...
