"""A rail on a Grbl board, as `contract.Rail`: Z moves the rig sideways, in millimetres.

The board may be the pan-tilt's: then homing homes both, and a hold stops both. The board itself is
`grbl_board`'s.
"""

from dataclasses import dataclass

from foveacam_hardware.contract import Clock, DeviceInfo, RailLimits, RailState
from foveacam_hardware.drivers.positioners.grbl_axes import GrblAxis
from foveacam_hardware.drivers.positioners.grbl_board import GrblBoard
from foveacam_hardware.drivers.positioners.limits import check_position
from foveacam_hardware.wire.link import LinkFactory

USER = "rail"
MM_A_M = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class GrblRailMounting:
    """How the rail sits on its motor. `zero_m`: where the rig stands when the machine counts zero.

    After homing that is at the reference switch; `has_switches` false: there is none, and the machine counts
    from where it was switched on. `reversed`: the motor counts against the rig's right.
    """

    zero_m: float = 0.0
    speed_m_s: float = 0.05
    has_switches: bool = True
    reversed: bool = False

    def goal_mm(self, position_m: float) -> float:
        """Return a place as Z of the machine."""
        return self._sign * MM_A_M * (position_m - self.zero_m)

    def position_m(self, machine_mm: float) -> float:
        """Return where the rig stands at a Z of the machine."""
        return self.zero_m + self._sign * machine_mm / MM_A_M

    def axis(self, limits: RailLimits) -> GrblAxis:
        """Return Z as the board's."""
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

    `board`: one that it shares with the pan-tilt, which has Z of this mounting; None: it has its own.
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
        """Who it is; with its version once it was connected."""
        return DeviceInfo(vendor="Grbl", model="rail", serial=self._name, version=self._board.version)

    @property
    def state(self) -> RailState:
        """Ask where it stands; never raises."""
        found = self._board.state(USER)
        return RailState(
            connected=found.connected,
            moving=found.moving,
            homed=found.homed,
            position_m=None if found.place is None else self._mounting.position_m(found.place[2]),
            fault=found.fault,
            awaits_zero=found.awaits_zero,
        )

    def connect(self) -> None:
        """Open the link, check who answers and whether it can move as far as the limits say."""
        self._board.connect(USER)

    def close(self) -> None:
        """Stop and release; harmless when closed."""
        self._board.close(USER)

    def home(self) -> None:
        """Begin to look for the reference switch; when it is found, the rig goes to the middle."""
        self._board.home(USER)

    def confirm_zero(self) -> None:
        """Take the operator's word that every axis of its board stands at its zero."""
        self._board.confirm_zero(USER)

    def move_to(self, position_m: float) -> None:
        """Begin to move; a move that is under way is given up for it."""
        check_position(position_m, self.limits, name=self._name)
        self._board.move_to(USER, {"Z": self._mounting.goal_mm(position_m)})

    def hold(self) -> None:
        """Stop moving now; a search for the switch is broken off, and has to be done again."""
        self._board.hold(USER)
