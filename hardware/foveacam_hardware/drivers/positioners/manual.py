"""A rig that the operator turns by hand, as `contract.PanTilt`: it only remembers what is wanted.

Where the base points nobody can say; whoever asks for a bearing watches the wide view until it is reached.
"""

import math
from collections.abc import Callable

from foveacam_hardware.contract import (
    DeviceInfo,
    NotConnected,
    OutOfRange,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    RailLimits,
    RailState,
)
from foveacam_hardware.drivers.positioners.limits import check_position

ANY_BEARING = PanTiltLimits(
    pan_min_rad=-math.pi, pan_max_rad=math.pi, tilt_min_rad=-math.pi / 2, tilt_max_rad=math.pi / 2
)
ANY_POSITION = RailLimits(min_m=-2.0, max_m=2.0)


def _nobody(wanted: PanTiltPose | None) -> None:
    """Tell nobody: the operator reads what is wanted."""


class ManualPanTilt:
    """A tripod head, or a table; `wanted` is the bearing last asked for, None when none is.

    `on_wanted` is told of every change of it.
    """

    moves_itself = False
    limits = ANY_BEARING

    def __init__(
        self, *, name: str = "by hand", on_wanted: Callable[[PanTiltPose | None], None] = _nobody
    ) -> None:
        self.info = DeviceInfo(vendor="none", model="turned by hand", serial=name)
        self.wanted: PanTiltPose | None = None
        self._on_wanted = on_wanted
        self._connected = False

    @property
    def state(self) -> PanTiltState:
        """Say that it is there, and that nobody knows where it points."""
        return PanTiltState(connected=self._connected, wanted=self.wanted)

    def connect(self) -> None:
        """Begin; there is nothing that could fail."""
        self._connected = True

    def close(self) -> None:
        """End; harmless when ended."""
        self._connected = False
        self.wanted = None

    def home(self) -> None:
        """Do nothing: there are no switches, and no need of them."""
        self._check("home")

    def confirm_zero(self) -> None:
        """Do nothing: it counts nothing."""
        self._check("take where it stands for its zero")

    def move_to(self, pose: PanTiltPose) -> None:
        """Remember where the operator is to turn it."""
        self._check("move")
        if abs(pose.pan_rad) > ANY_BEARING.pan_max_rad or abs(pose.tilt_rad) > ANY_BEARING.tilt_max_rad:
            raise OutOfRange(
                f"pan-tilt (by hand): pan {math.degrees(pose.pan_rad):.1f}, tilt"
                f" {math.degrees(pose.tilt_rad):.1f} deg is outside ±180, ±90 deg; choose a bearing inside"
            )
        self._want(pose)

    def hold(self) -> None:
        """Want nothing any more."""
        self._check("hold")
        self._want(None)

    def _want(self, pose: PanTiltPose | None) -> None:
        self.wanted = pose
        self._on_wanted(pose)

    def _check(self, action: str) -> None:
        if not self._connected:
            raise NotConnected(f"pan-tilt (by hand): asked to {action} before it was connected; connect it")


class ManualRail:
    """A rail with a scale; `wanted_m` is the place last asked for, None when none is."""

    moves_itself = False

    def __init__(self, *, limits: RailLimits = ANY_POSITION, name: str = "by hand") -> None:
        self.limits = limits
        self.info = DeviceInfo(vendor="none", model="moved by hand", serial=name)
        self.wanted_m: float | None = None
        self._connected = False

    @property
    def state(self) -> RailState:
        """Say that it is there, where it is wanted, and that nobody knows where it stands."""
        return RailState(connected=self._connected, wanted_m=self.wanted_m)

    def connect(self) -> None:
        """Begin; there is nothing that could fail."""
        self._connected = True

    def close(self) -> None:
        """End; harmless when ended."""
        self._connected = False
        self.wanted_m = None

    def home(self) -> None:
        """Do nothing: there is no switch, and no need of one."""
        self._check("home")

    def confirm_zero(self) -> None:
        """Do nothing: it counts nothing."""
        self._check("take where it stands for its zero")

    def move_to(self, position_m: float) -> None:
        """Remember where the operator is to push it."""
        self._check("move")
        check_position(position_m, self.limits, name="rail (by hand)")
        self.wanted_m = position_m

    def hold(self) -> None:
        """Want nothing any more."""
        self._check("hold")
        self.wanted_m = None

    def _check(self, action: str) -> None:
        if not self._connected:
            raise NotConnected(f"rail (by hand): asked to {action} before it was connected; connect it")
