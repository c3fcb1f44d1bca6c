"""Moves the rail through the hardware thread: status, moves, hold, homing."""

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
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import AssembledRig


@dataclass(frozen=True, slots=True, kw_only=True)
class RailStatus:
    """Status of the rail at one moment."""

    info: DeviceInfo
    limits: RailLimits
    moves_itself: bool
    places: tuple[RailPlace, ...]
    state: RailState


class RailService:
    """Moves the rail; raises `Stopped` while stopped and `Busy` while a job has the rig."""

    def __init__(self, hardware: HardwareThread) -> None:
        self._hardware = hardware
        self._known: Rail | None = None  # a hold bypasses the queue

    def read_status(self) -> "Future[RailStatus | None]":
        """Read the status from the device; None when the rig has none."""
        return self._hardware.submit(self._read_status)

    def move(self, position_m: float) -> "Future[None]":
        """Start a move; raise `OutOfRange`, `Busy`, `Stopped`, `NotConnected` at once or by the future."""
        return self._begin("move the rig", lambda rail: rail.move_to(position_m))

    def move_to_place(self, name: str) -> "Future[float]":
        """Start a move to a named place and return its position, metres."""
        self._check_free("move the rig")
        return self._hardware.submit(lambda rig: self._go_to_place(rig, name))

    def home(self) -> "Future[None]":
        """Start homing: search the reference switch."""
        return self._begin("home the rail", lambda rail: rail.home())

    def confirm_zero(self) -> "Future[None]":
        """Take the present position as the zero, on the operator's confirmation."""
        self._check_free("take the rail's present position as its zero")
        return self._hardware.submit(lambda rig: self._rail_of(rig).confirm_zero())

    def hold(self) -> None:
        """Stop moving now, bypassing the queue, if there is a rail that was used before."""
        if self._known is not None:
            self._known.hold()

    def _begin(self, asked: str, move: Callable[[Rail], None]) -> "Future[None]":
        self._check_free(asked)
        return self._hardware.submit(lambda rig: self._move(self._rail_of(rig), move))

    def _move(self, rail: Rail, move: Callable[[Rail], None]) -> None:
        self._check_stop()
        move(rail)
        try:
            self._check_stop()
        except Stopped:  # the stop came between the check and the command on the wire
            rail.hold()
            raise

    def _go_to_place(self, rig: AssembledRig, name: str) -> float:
        rail, places = self._rail_of(rig), rig.rail_places
        position_m = next((place.position_m for place in places if place.name == name), None)
        if position_m is not None:
            self._move(rail, lambda rail: rail.move_to(position_m))
            return position_m
        known = ", ".join(repr(place.name) for place in places) or "none"
        raise InvalidInput(
            f"there is no place {name!r} on the rail; this rig has {known}",
            asked=f"place {name!r}",
            found=f"the places are {known}",
            remedy="choose one, or name them in the rig's file ([[rail.places]])",
        )

    def _read_status(self, rig: AssembledRig) -> RailStatus | None:
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

    def _rail_of(self, rig: AssembledRig) -> Rail:
        self._known = rig.rail
        if rig.rail is None:
            raise NotConnected(
                "asked to move the rig sideways: this rig has no rail",
                asked="move the rig sideways",
                found="no rail",
                remedy="name one in the rig's file ([rail], kind grbl or manual)",
            )
        return rig.rail

    def _check_stop(self) -> None:
        if self._hardware.halted:
            raise refusals.stopped()

    def _check_free(self, asked: str) -> None:
        self._check_stop()
        self._hardware.use.check_free(asked)
