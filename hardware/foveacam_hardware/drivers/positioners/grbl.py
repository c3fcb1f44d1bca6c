"""A pan-tilt on a Grbl board as `contract.PanTilt`: X is pan, Y is tilt, in degrees; see `grbl_board`."""

from foveacam_hardware.contract import Clock, DeviceInfo, PanTiltLimits, PanTiltPose, PanTiltState
from foveacam_hardware.drivers.positioners.grbl_axes import GrblMounting
from foveacam_hardware.drivers.positioners.grbl_board import GrblBoard
from foveacam_hardware.drivers.positioners.limits import check_bearing
from foveacam_hardware.wire.link import LinkFactory

USER = "pan-tilt"


class GrblPanTilt:
    """Turns the rig; `hold` and `state` may be called from any thread, the rest from one at a time.

    `board`: a board shared with a rail, with axes X and Y of this mounting; None: a board of its own.
    """

    moves_itself = True

    def __init__(
        self,
        link_factory: LinkFactory,
        clock: Clock,
        *,
        limits: PanTiltLimits,
        name: str = "pan-tilt",
        mounting: GrblMounting | None = None,
        board: GrblBoard | None = None,
    ) -> None:
        self.limits = limits
        self._name = name
        self._mounting = mounting or GrblMounting()
        self._board = board or GrblBoard(
            link_factory,
            clock,
            axes=self._mounting.axes(limits),
            name=name,
            has_switches=self._mounting.has_switches,
        )

    @property
    def info(self) -> DeviceInfo:
        """Identity of the device, with its version once connected."""
        return DeviceInfo(vendor="Grbl", model="pan-tilt", serial=self._name, version=self._board.version)

    @property
    def state(self) -> PanTiltState:
        """State and pose, queried from the board; never raises."""
        found = self._board.state(USER)
        return PanTiltState(
            connected=found.connected,
            moving=found.moving,
            homed=found.homed,
            pose=None if found.position is None else self._mounting.bearing(found.position),
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
        """Begin to search for the reference switches; when found, the base turns straight ahead."""
        self._board.home(USER)

    def confirm_zero(self) -> None:
        """Accept the operator's confirmation that every axis of the board is at its zero."""
        self._board.confirm_zero(USER)

    def move_to(self, pose: PanTiltPose) -> None:
        """Begin to move, replacing a move in progress."""
        check_bearing(pose, self.limits, name=self._name)
        self._board.move_to(USER, self._mounting.goals(pose))

    def hold(self) -> None:
        """Stop moving now; an interrupted homing has to be repeated."""
        self._board.hold(USER)
