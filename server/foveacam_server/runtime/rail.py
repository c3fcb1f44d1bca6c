"""The rail behind the hardware thread: where the rig stands, moving it sideways, stopping that."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from foveacam_hardware.contract import (
    DeviceInfo,
    InvalidInput,
    NotConnected,
    Rail,
    RailLimits,
    RailPlace,
    RailState,
    Stopped,
)
from foveacam_server.runtime import refusals
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.ports import AssembledRig


@dataclass(frozen=True, slots=True, kw_only=True)
class RailStatus:
    """The rail at one moment."""

    info: DeviceInfo
    limits: RailLimits
    moves_itself: bool
    places: tuple[RailPlace, ...]
    state: RailState


class RailService:
    """Takes wishes of where the rig shall stand; moves are refused while stopped or while a job works."""

    def __init__(self, hardware: HardwareThread) -> None:
        self._hardware = hardware
        self._known: Rail | None = None  # a hold goes past the queue, to the device itself

    def seen_now(self) -> "Future[RailStatus | None]":
        """Ask the device itself; None when the rig has none."""
        return self._hardware.submit(self._look)

    def move(self, position_m: float) -> "Future[None]":
        """Begin to move; raise `OutOfRange`, `Busy`, `Stopped` or `NotConnected` by the future or at once."""
        return self._begin("move the rig", lambda rail: rail.move_to(position_m))

    def move_to_place(self, name: str) -> "Future[float]":
        """Begin to move to a place by its name, and return where that is, metres."""
        self._check_free("move the rig")
        return self._hardware.submit(lambda rig: self._go_to_place(rig, name))

    def home(self) -> "Future[None]":
        """Begin to look for the reference switch."""
        return self._begin("home the rail", lambda rail: rail.home())

    def confirm_zero(self) -> "Future[None]":
        """Take the operator's word that it stands at its zero."""
        self._check_free("take where the rail stands for its zero")
        return self._hardware.submit(lambda rig: self._of(rig).confirm_zero())

    def hold(self) -> None:
        """Stop moving now, past the queue; harmless when there is no rail, or nobody has asked for it yet."""
        if self._known is not None:
            self._known.hold()

    def _begin(self, asked: str, move: Callable[[Rail], None]) -> "Future[None]":
        self._check_free(asked)
        return self._hardware.submit(lambda rig: self._move(self._of(rig), move))

    def _move(self, rail: Rail, move: Callable[[Rail], None]) -> None:
        self._check_stop()
        move(rail)
        try:
            self._check_stop()
        except Stopped:  # it came between the check and the command on the wire
            rail.hold()
            raise

    def _go_to_place(self, rig: AssembledRig, name: str) -> float:
        rail, places = self._of(rig), rig.rail_places
        position_m = next((place.position_m for place in places if place.name == name), None)
        if position_m is not None:
            self._move(rail, lambda rail: rail.move_to(position_m))
            return position_m
        known = ", ".join(repr(place.name) for place in places) or "none"
        raise InvalidInput(
            f"there is no place {name!r} on the rail; this rig has {known}; choose one, or name them in the"
            " rig's file",
            asked=f"place {name!r}",
            found=f"the places are {known}",
            remedy="choose one, or name them in the rig's file ([[rail.places]])",
        )

    def _look(self, rig: AssembledRig) -> RailStatus | None:
        rail = self._known = rig.rail
        if rail is None:
            return None
        return RailStatus(
            info=rail.info,
            limits=rail.limits,
            moves_itself=rail.moves_itself,
            places=tuple(rig.rail_places),
            state=rail.state,
        )

    def _of(self, rig: AssembledRig) -> Rail:
        self._known = rig.rail
        if rig.rail is None:
            remedy = "name one in the rig's file ([rail], kind grbl or manual)"
            raise NotConnected(
                f"asked to move the rig sideways: this rig has no rail; {remedy}",
                asked="move the rig sideways",
                found="no rail",
                remedy=remedy,
            )
        return rig.rail

    def _check_stop(self) -> None:
        if self._hardware.halted:
            raise refusals.stopped()

    def _check_free(self, asked: str) -> None:
        self._check_stop()
        if self._hardware.busy_with is not None:
            raise refusals.in_use(asked, self._hardware.busy_with)
