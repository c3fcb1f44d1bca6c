"""A rail on which the operator pushes the rig by hand, as `contract.Rail`: it only remembers what is wanted.

Where the rig stands nobody can say; the rail's own scale tells the operator.
"""

from foveacam_hardware.contract import DeviceInfo, NotConnected, RailLimits, RailState
from foveacam_hardware.drivers.positioners.rail_limits import check_position

ANYWHERE = RailLimits(min_m=-2.0, max_m=2.0)


class ManualRail:
    """A rail with a scale; `wanted_m` is the place last asked for, None when none is."""

    moves_itself = False

    def __init__(self, *, limits: RailLimits = ANYWHERE, name: str = "by hand") -> None:
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
