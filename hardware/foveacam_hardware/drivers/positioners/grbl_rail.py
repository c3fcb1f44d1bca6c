"""A rail on a Grbl board as `contract.Rail`: Z moves the rig sideways, in millimetres.

The board may be shared with the pan-tilt: then homing homes both, and a hold stops both. Talking to the board
is left to `grbl_board`.
"""

from dataclasses import dataclass

from foveacam_hardware.contract import Clock, DeviceInfo, RailLimits, RailState
from foveacam_hardware.contract.quantities import check_positive
from foveacam_hardware.drivers.positioners.grbl_axes import GrblAxis
from foveacam_hardware.drivers.positioners.grbl_board import GrblBoard
from foveacam_hardware.drivers.positioners.limits import check_position
from foveacam_hardware.wire.link import LinkFactory

USER = "rail"
MM_A_M = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblRailMounting:
    """Relation between the rig's position and the motor's. `zero_m`: position of the rig at machine zero.

    After homing, machine zero is at the reference switch; `has_switches` false: there is none, and machine
    zero is the position at power-on. `reversed`: the motor counts positive to the rig's left.
    """

    zero_m: float = 0.0
    speed_m_s: float = 0.05
    has_switches: bool = True
    reversed: bool = False

    def __post_init__(self) -> None:
        check_positive("rail", speed_m_s=self.speed_m_s)

    def goal_mm(self, position_m: float) -> float:
        """Return the machine position Z of a rig position, mm."""
        return self._sign * MM_A_M * (position_m - self.zero_m)

    def position_m(self, machine_mm: float) -> float:
        """Return the rig position at a machine position Z, m."""
        return self.zero_m + self._sign * machine_mm / MM_A_M

    def axis(self, limits: RailLimits) -> GrblAxis:
        """Return the board's axis Z."""
        return GrblAxis(
            letter="Z",
            name="the rail",
            verb="move",
            unit="mm",
            span=MM_A_M * (limits.max_m - limits.min_m),
            rest=self.goal_mm(0.0),
            speed_per_s=MM_A_M * self.speed_m_s,
        )

    @property
    def _sign(self) -> float:
        return -1.0 if self.reversed else 1.0


class GrblRail:
    """Moves the rig sideways; `hold` and `state` may be called from any thread, the rest from one at a time.

    `board`: a board shared with the pan-tilt, with axis Z of this mounting; None: a board of its own.
    """

    moves_itself = True

    def __init__(
        self,
        link_factory: LinkFactory,
        clock: Clock,
        *,
        limits: RailLimits,
        name: str = "rail",
        mounting: GrblRailMounting | None = None,
        board: GrblBoard | None = None,
    ) -> None:
        self.limits = limits
        self._name = name
        self._mounting = mounting or GrblRailMounting()
        self._board = board or GrblBoard(
            link_factory,
            clock,
            axes=[self._mounting.axis(limits)],
            name=name,
            has_switches=self._mounting.has_switches,
        )

    @property
    def info(self) -> DeviceInfo:
        """Identity of the device, with its version once connected."""
        return DeviceInfo(vendor="Grbl", model="rail", serial=self._name, version=self._board.version)

    @property
    def state(self) -> RailState:
        """State and position, queried from the board; never raises."""
        found = self._board.state(USER)
        return RailState(
            connected=found.connected,
            moving=found.moving,
            homed=found.homed,
            position_m=None if found.position is None else self._mounting.position_m(found.position[2]),
            fault=found.fault,
            awaits_zero=found.awaits_zero,
        )

    def connect(self) -> None:
        """Open the link, identify the board and check that its travel covers the limits."""
        self._board.connect(USER)

    def close(self) -> None:
        """Stop and release; do nothing when closed."""
        self._board.close(USER)

    def home(self) -> None:
        """Begin to search for the reference switch; when found, the rig moves to the centre of the rail."""
        self._board.home(USER)

    def confirm_zero(self) -> None:
        """Accept the operator's confirmation that every axis of the board is at its zero."""
        self._board.confirm_zero(USER)

    def move_to(self, position_m: float) -> None:
        """Begin to move, replacing a move in progress."""
        check_position(position_m, self.limits, name=self._name)
        self._board.move_to(USER, {"Z": self._mounting.goal_mm(position_m)})

    def hold(self) -> None:
        """Stop moving now; an interrupted homing has to be repeated."""
        self._board.hold(USER)
