"""The boards that there are, and what makes one of each."""

from enum import StrEnum

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.far_ends.board_far_end import BoardFarEnd
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.pan_tilt import SET_UP, PanTiltCables, Place


class BoardKind(StrEnum):
    """Who answers at the port."""

    GRBL = "grbl"
    GRBL_WITH_RAIL = "grbl-rail"
    """Its third axis moves a rail."""
    PTU = "ptu"


def board(kind: BoardKind, clock: Clock, cables: PanTiltCables, *, start: Place = SET_UP) -> BoardFarEnd:
    """Return a board whose motors turn `cables`, from `start` on."""
    match kind:
        case BoardKind.PTU:
            return PtuFarEnd(clock, cables, start=start)
        case BoardKind.GRBL | BoardKind.GRBL_WITH_RAIL:
            return GrblFarEnd(clock, cables, has_rail=kind is BoardKind.GRBL_WITH_RAIL, start=start)
