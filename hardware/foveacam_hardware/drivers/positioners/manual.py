"""Manual pan-tilt and rail as `contract.PanTilt` and `contract.Rail`: they only store the requested position.

The actual position is not known: a caller watches the wide view, the operator reads the rail's scale.
"""

import math
from collections.abc import Callable

from foveacam_hardware.contract import (
    DeviceInfo,
    NotConnected,
    PanTiltLimits,
    PanTiltPose,
    PanTiltState,
    RailLimits,
    RailState,
)
from foveacam_hardware.drivers.positioners.limits import check_bearing, check_position

ANY_BEARING = PanTiltLimits(
    pan_min_rad=-math.pi, pan_max_rad=math.pi, tilt_min_rad=-math.pi / 2, tilt_max_rad=math.pi / 2
)
ANY_POSITION = RailLimits(min_m=-2.0, max_m=2.0)


def _ignore(wanted: PanTiltPose | None) -> None:
    """Do nothing."""


class ManualPanTilt:
    """A tripod head or table turned by hand; `wanted` is the requested bearing, None when none is.

    `on_wanted` is called on every change of it.
    """

    moves_itself = False
    limits = ANY_BEARING

    def __init__(
        self, *, name: str = "by hand", on_wanted: Callable[[PanTiltPose | None], None] = _ignore
    ) -> None:
        self.info = DeviceInfo(vendor="none", model="turned by hand", serial=name)
        self.wanted: PanTiltPose | None = None
        self._on_wanted = on_wanted
        self._connected = False

    @property
    def state(self) -> PanTiltState:
        """Whether it is connected, and the requested bearing; the actual one is not known."""
        return PanTiltState(connected=self._connected, wanted=self.wanted)

    def connect(self) -> None:
        """Mark as connected; cannot fail."""
        self._connected = True

    def close(self) -> None:
        """Mark as closed."""
        self._connected = False
        self.wanted = None

    def home(self) -> None:
        """Do nothing: there are no switches."""
        self._check("home")

    def confirm_zero(self) -> None:
        """Do nothing: there is no position counter."""
        self._check("take where it stands for its zero")

    def move_to(self, pose: PanTiltPose) -> None:
        """Store the bearing that the operator is asked to turn to."""
        self._check("move")
        check_bearing(pose, ANY_BEARING, name="pan-tilt (by hand)")
        self._request(pose)

    def hold(self) -> None:
        """Clear the request."""
        self._check("hold")
        self._request(None)

    def _request(self, pose: PanTiltPose | None) -> None:
        self.wanted = pose
        self._on_wanted(pose)

    def _check(self, action: str) -> None:
        if not self._connected:
            raise NotConnected(f"pan-tilt (by hand): asked to {action} before it was connected; connect it")


class ManualRail:
    """A rail with a scale; `wanted_m` is the requested position, None when none is."""

    moves_itself = False

    def __init__(self, *, limits: RailLimits = ANY_POSITION, name: str = "by hand") -> None:
        self.limits = limits
        self.info = DeviceInfo(vendor="none", model="moved by hand", serial=name)
        self.wanted_m: float | None = None
        self._connected = False

    @property
    def state(self) -> RailState:
        """Whether it is connected, and the requested position; the actual one is not known."""
        return RailState(connected=self._connected, wanted_m=self.wanted_m)

    def connect(self) -> None:
        """Mark as connected; cannot fail."""
        self._connected = True

    def close(self) -> None:
        """Mark as closed."""
        self._connected = False
        self.wanted_m = None

    def home(self) -> None:
        """Do nothing: there is no switch."""
        self._check("home")

    def confirm_zero(self) -> None:
        """Do nothing: there is no position counter."""
        self._check("take where it stands for its zero")

    def move_to(self, position_m: float) -> None:
        """Store the position that the operator is asked to push to."""
        self._check("move")
        check_position(position_m, self.limits, name="rail (by hand)")
        self.wanted_m = position_m

    def hold(self) -> None:
        """Clear the request."""
        self._check("hold")
        self.wanted_m = None

    def _check(self, action: str) -> None:
        if not self._connected:
            raise NotConnected(f"rail (by hand): asked to {action} before it was connected; connect it")
