"""State machine of a pan-tilt or rail: whether its position is known; all transitions in one table.

Pure: a driver reports what happened, and reads the phase. Moves under way are left to the drivers: a device
whose position is known stays `HOMED` while it moves.
"""

from collections.abc import Mapping
from enum import StrEnum


class Phase(StrEnum):
    """Phase of a device; its position is known in `HOMED` alone."""

    DISCONNECTED = "disconnected"
    UNKNOWN = "unknown"
    """Connected, its position not known: it has to be homed."""
    AWAITS_ZERO = "awaits_zero"
    """The same, of a device without switches: the operator has to confirm that it is at its zero."""
    HOMING = "homing"
    HELD = "held"
    """A hold was sent while it was homing, whose end is awaited."""
    HOMED = "homed"
    ALARM = "alarm"
    """It stopped by itself, or its homing failed; see the fault. Its position is not known."""


class Event(StrEnum):
    """Event that changes the phase of a device."""

    CONNECTED = "connected"
    """Nothing proves that it did not restart since its position was known."""
    PROVEN = "proven"
    """It was connected again and proved that it has not restarted since its position was known."""
    LINK_LOST = "link lost"
    HOMING_BEGUN = "homing begun"
    HOLD = "hold"
    HOMING_DONE = "homing done"
    HOMING_FAILED = "homing failed"
    """It ended without finding the switches, by itself or by a hold."""
    ZERO_CONFIRMED = "zero confirmed"
    ALARMED = "alarmed"
    RESTARTED = "restarted"


_CONNECTED_PHASES = frozenset(Phase) - {Phase.DISCONNECTED}
TRANSITIONS: Mapping[Event, Mapping[Phase, Phase]] = {
    Event.CONNECTED: {Phase.DISCONNECTED: Phase.UNKNOWN},
    Event.PROVEN: {Phase.DISCONNECTED: Phase.HOMED},
    Event.LINK_LOST: dict.fromkeys(Phase, Phase.DISCONNECTED),
    Event.HOMING_BEGUN: dict.fromkeys((Phase.UNKNOWN, Phase.HOMED, Phase.ALARM), Phase.HOMING),
    Event.HOLD: {phase: phase for phase in _CONNECTED_PHASES} | {Phase.HOMING: Phase.HELD},
    Event.HOMING_DONE: dict.fromkeys((Phase.HOMING, Phase.HELD), Phase.HOMED),
    Event.HOMING_FAILED: {Phase.HOMING: Phase.ALARM, Phase.HELD: Phase.UNKNOWN},
    Event.ZERO_CONFIRMED: dict.fromkeys((Phase.AWAITS_ZERO, Phase.ALARM, Phase.HOMED), Phase.HOMED),
    Event.ALARMED: dict.fromkeys(_CONNECTED_PHASES, Phase.ALARM),
    Event.RESTARTED: dict.fromkeys(_CONNECTED_PHASES, Phase.UNKNOWN),
}
"""Phase after each event, by the phase before it. Other events of a phase are refused before they are sent.

For a device without switches, read `AWAITS_ZERO` where a transition ends in `UNKNOWN`.
"""
HOMING_PHASES = frozenset({Phase.HOMING, Phase.HELD})


class PositionerLife:
    """The phase of one device, and its fault in words for the operator."""

    def __init__(self, *, has_switches: bool = True) -> None:
        self.has_switches = has_switches
        self.phase = Phase.DISCONNECTED
        self.fault: str | None = None

    def apply(self, event: Event, *, fault: str | None = None) -> None:
        """Go to the phase after an event, with its fault; None: there is none any more."""
        after = TRANSITIONS[event][self.phase]
        if after is Phase.UNKNOWN and not self.has_switches:
            after = Phase.AWAITS_ZERO
        self.phase, self.fault = after, fault

    @property
    def connected(self) -> bool:
        """Whether a device answers."""
        return self.phase is not Phase.DISCONNECTED

    @property
    def homed(self) -> bool:
        """Whether its position is known."""
        return self.phase is Phase.HOMED

    @property
    def is_homing(self) -> bool:
        """Whether it is homing, or coming to the end of a homing that was held."""
        return self.phase in HOMING_PHASES

    @property
    def awaits_zero(self) -> bool:
        """Whether the operator has to confirm its zero before it is usable."""
        return not self.has_switches and self.phase in (Phase.AWAITS_ZERO, Phase.ALARM)

    @property
    def remedy(self) -> str:
        """Instruction to the operator that makes its position known."""
        return "home it" if self.has_switches else "bring it to its zero, then confirm that it stands there"
