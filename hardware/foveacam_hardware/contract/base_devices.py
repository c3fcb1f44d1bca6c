"""Protocols of what the rig stands on: what turns it while it is calibrated, what moves it sideways."""

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
    """What turns the whole rig. Calls return at once; whoever waits polls `state`."""

    @property
    def info(self) -> DeviceInfo:
        """Who it is."""
        ...

    @property
    def limits(self) -> PanTiltLimits:
        """How far it turns."""
        ...

    @property
    def moves_itself(self) -> bool:
        """False when the operator turns the rig by hand: `move_to` then only says where to."""
        ...

    @property
    def state(self) -> PanTiltState:
        """Connected, moving, where."""
        ...

    def connect(self) -> None:
        """Open the link and check who answers."""
        ...

    def close(self) -> None:
        """Stop and release; harmless when closed."""
        ...

    def home(self) -> None:
        """Begin to look for the reference switches."""
        ...

    def confirm_zero(self) -> None:
        """Take the operator's word that it stands at its zero.

        Raise `InvalidInput` for one that finds its zero by itself, `DeviceFault` where that cannot be.
        """
        ...

    def move_to(self, pose: PanTiltPose) -> None:
        """Begin to move; raise `OutOfRange` beyond the limits, `DeviceFault` when it is in alarm."""
        ...

    def hold(self) -> None:
        """Stop moving now, callable from any thread at any time."""
        ...


class Rail(Protocol):
    """What moves the whole rig sideways. Calls return at once; whoever waits polls `state`."""

    @property
    def info(self) -> DeviceInfo:
        """Who it is."""
        ...

    @property
    def limits(self) -> RailLimits:
        """How far it reaches."""
        ...

    @property
    def moves_itself(self) -> bool:
        """False when the operator pushes the rig by hand: `move_to` then only says where to."""
        ...

    @property
    def state(self) -> RailState:
        """Connected, moving, where."""
        ...

    def connect(self) -> None:
        """Open the link and check who answers."""
        ...

    def close(self) -> None:
        """Stop and release; harmless when closed."""
        ...

    def home(self) -> None:
        """Begin to look for the reference switch; then go to the middle."""
        ...

    def confirm_zero(self) -> None:
        """Take the operator's word that it stands at its zero.

        Raise `InvalidInput` for one that finds its zero by itself, `DeviceFault` where that cannot be.
        """
        ...

    def move_to(self, position_m: float) -> None:
        """Begin to move; raise `OutOfRange` beyond the limits, `DeviceFault` when it is in alarm."""
        ...

    def hold(self) -> None:
        """Stop moving now, callable from any thread at any time."""
        ...
