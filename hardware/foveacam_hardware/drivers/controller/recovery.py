"""What the mirrors' driver does when the controller falls silent or answers out of turn.

A packet may get lost: then the mirrors are parked and the caller is told to ask again. A controller that
has stopped, restarted or lost its state is given up, and the session with it.
"""

import logging
import threading
from collections.abc import Callable
from typing import TypeVar

from foveacam_hardware.contract import FoveaError, NotConnected, Timeout
from foveacam_hardware.drivers.controller.commanded_position import CommandedPosition
from foveacam_hardware.drivers.controller.replies import MALFORMED, ControllerRefusal
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.wire.controller import BadPacket

logger = logging.getLogger(__name__)

_Answer = TypeVar("_Answer")

PROBES = 2
"""The first may be swallowed by what a lost byte left of the packet before it."""

RAIL_WARNING = (
    "a controller that has stopped leaves the mirror rail on, and only a power cycle clears it:"
    " switch its supply off and on, then reconnect"
)
_STATE_LOST = frozenset(
    {"Cannot perform action: system is not enabled", "Unknown stream", "Unknown stream id", "System disabled"}
)


def switched_off(session: ControllerSession, *, probe_s: float, tries: int = PROBES) -> bool:
    """Try to switch the rail off on a session that failed; tell whether the controller says that it is."""
    probe = ControllerRequests(session, deadline_s=probe_s)
    for _ in range(tries):
        try:
            probe.switch(on=False)
            return True
        except FoveaError as failure:
            logger.info("controller: not switched off after a failed start: %s", failure)
    return False


def undone(dialogue: ControllerRequests | None, failure: FoveaError, *, probe_s: float) -> FoveaError:
    """Leave the rail off after a start that failed, if anybody listens; return the error to raise."""
    off = dialogue is not None and switched_off(dialogue.session, probe_s=probe_s)
    return failure if off or not isinstance(failure, Timeout) else Timeout(f"{failure}; {RAIL_WARNING}")


class LinkRecovery:
    """Watches over conversations; `fault` says why the controller was given up."""

    def __init__(self, targets: CommandedPosition, *, enabled: Callable[[], bool], probe_s: float) -> None:
        self.fault: str | None = None
        self.lost_answers = 0
        """Answers that did not come from a controller that then answered again, since the connect."""
        self._probe_s = probe_s
        self._targets = targets
        self._enabled = enabled
        self._lock = threading.Lock()

    def begin(self) -> None:
        """Start anew with a session that has just been identified."""
        self.fault = None
        self.lost_answers = 0

    def guarded(self, dialogue: ControllerRequests, action: Callable[[], _Answer]) -> _Answer:
        """Run a conversation; silence is looked into, and a controller that lost its state is given up."""
        try:
            return action()
        except BadPacket as damaged:
            raise self._lost(
                dialogue, Timeout(f"controller: an answer came damaged ({damaged})")
            ) from damaged
        except Timeout as silence:
            raise self._lost(dialogue, silence) from silence
        except ControllerRefusal as refusal:
            self._targets.lose_track()
            if refusal.text == MALFORMED:
                raise self._lost(dialogue, Timeout(f"{refusal}: it came damaged")) from refusal
            if refusal.text in _STATE_LOST:
                raise self.give_up(
                    dialogue, f"{refusal}: it restarted, or another program used it"
                ) from refusal
            raise

    def give_up(self, dialogue: ControllerRequests, reason: str) -> NotConnected:
        """End the session for a reason, and return the error to raise."""
        failure = NotConnected(reason)
        self.fault = reason
        dialogue.session.fail(failure)
        return failure

    def _lost(self, dialogue: ControllerRequests, silence: Timeout) -> Timeout:
        """Return the error to raise for an answer that did not come, from a controller that still answers."""
        self._targets.lose_track()
        self._after_silence(dialogue, silence)
        self.lost_answers += 1
        return Timeout(
            f"{silence}; it answers again, so a packet was lost: the mirrors are parked, ask again"
        )

    def _after_silence(self, dialogue: ControllerRequests, silence: Timeout) -> None:
        """Park; return when the controller answers again in the state it should be in, else give it up."""
        with self._lock:
            probe = ControllerRequests(dialogue.session, deadline_s=self._probe_s)
            for _ in range(PROBES):
                self._park_if_enabled(dialogue)
                try:
                    found_enabled = probe.enabled()
                except (Timeout, BadPacket):
                    continue
                if found_enabled is not self._enabled():
                    raise self.give_up(dialogue, "controller: it was silent and came back in another state")
                self._park_if_enabled(dialogue)
                return
            found = f"{silence}, nor to {PROBES} more questions: it has stopped or the line is broken"
            raise Timeout(str(self.give_up(dialogue, f"{found}; {RAIL_WARNING}"))) from silence

    def _park_if_enabled(self, dialogue: ControllerRequests) -> None:
        if self._enabled():
            dialogue.session.forget(*self._targets.park(dialogue.session))
