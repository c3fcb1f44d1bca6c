"""What the mirrors' driver does when the controller falls silent or answers out of turn.

A packet may get lost: then the mirrors are parked and the caller is told to ask again. A controller that
has stopped, restarted or lost its state is given up, and the session with it.
"""

import threading
from collections.abc import Callable
from typing import TypeVar

from foveacam_hardware.contract import NotConnected, Timeout
from foveacam_hardware.drivers.controller_dialogue import Dialogue
from foveacam_hardware.drivers.controller_session import Refusal
from foveacam_hardware.drivers.controller_targets import Targets

_Answer = TypeVar("_Answer")

PROBE_DEADLINE_S = 0.2
PROBES = 2
"""The first may be swallowed by what a lost byte left of the packet before it."""

RAIL_WARNING = (
    "a controller that has stopped leaves the mirror rail on, and only a power cycle clears it:"
    " switch its supply off and on, then reconnect"
)
_STATE_LOST = frozenset(
    {"Cannot perform action: system is not enabled", "Unknown stream", "Unknown stream id", "System disabled"}
)


class Recovery:
    """Watches over conversations; `fault` says why the controller was given up."""

    def __init__(self, targets: Targets, *, enabled: Callable[[], bool]) -> None:
        self.fault: str | None = None
        self._targets = targets
        self._enabled = enabled
        self._lock = threading.Lock()

    def guarded(self, dialogue: Dialogue, action: Callable[[], _Answer]) -> _Answer:
        """Run a conversation; silence is looked into, and a controller that lost its state is given up."""
        try:
            return action()
        except Timeout as silence:
            self._targets.lose_track()
            self._after_silence(dialogue, silence)
            raise Timeout(
                f"{silence}; it answers again, so a packet was lost: the mirrors are parked, ask again"
            ) from silence
        except Refusal as refusal:
            self._targets.lose_track()
            if refusal.text in _STATE_LOST:
                raise self.give_up(
                    dialogue, f"{refusal}: it restarted, or another program used it"
                ) from refusal
            raise

    def give_up(self, dialogue: Dialogue, reason: str) -> NotConnected:
        """End the session for a reason, and return the error to raise."""
        failure = NotConnected(reason)
        self.fault = reason
        dialogue.session.fail(failure)
        return failure

    def _after_silence(self, dialogue: Dialogue, silence: Timeout) -> None:
        """Park; return when the controller answers again in the state it should be in, else give it up."""
        with self._lock:
            probe = Dialogue(dialogue.session, deadline_s=PROBE_DEADLINE_S)
            for _ in range(PROBES):
                self._park_if_enabled(dialogue)
                try:
                    found_enabled = probe.enabled()
                except Timeout:
                    continue
                if found_enabled is not self._enabled():
                    raise self.give_up(dialogue, "controller: it was silent and came back in another state")
                self._park_if_enabled(dialogue)
                return
            found = f"{silence}, nor to {PROBES} more questions: it has stopped or the line is broken"
            raise Timeout(str(self.give_up(dialogue, f"{found}; {RAIL_WARNING}"))) from silence

    def _park_if_enabled(self, dialogue: Dialogue) -> None:
        if self._enabled():
            self._targets.park(dialogue.session)
