"""Reaction of the mirror driver to missing, damaged and unexpected answers of the controller.

After a lost packet the mirrors are parked and the caller gets an error that asks to repeat the request. When
the controller has stopped, restarted or lost its state, the session is ended.
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
"""Requests after silence; the first may be destroyed by the rest of a packet that lost a byte."""

RAIL_WARNING = (
    "a controller that has stopped leaves the mirror rail on, and only a power cycle clears it:"
    " switch its supply off and on, then reconnect"
)
_STATE_LOST = frozenset(
    {"Cannot perform action: system is not enabled", "Unknown stream", "Unknown stream id", "System disabled"}
)


def switch_off(session: ControllerSession, *, probe_s: float, tries: int = PROBES) -> bool:
    """Try to switch the rail off on a failed session; return whether the controller confirms it."""
    probe = ControllerRequests(session, deadline_s=probe_s)
    for _ in range(tries):
        try:
            probe.switch(on=False)
            return True
        except FoveaError as failure:
            logger.info("controller: not switched off after a failed start: %s", failure)
    return False


def undo_start(requests: ControllerRequests | None, failure: FoveaError, *, probe_s: float) -> FoveaError:
    """Try to switch the rail off after a failed start; return the error to raise."""
    off = requests is not None and switch_off(requests.session, probe_s=probe_s)
    return failure if off or not isinstance(failure, Timeout) else Timeout(f"{failure}; {RAIL_WARNING}")


class LinkRecovery:
    """Runs requests and handles their failures; `fault` says why the session was ended."""

    def __init__(self, position: CommandedPosition, *, enabled: Callable[[], bool], probe_s: float) -> None:
        self.fault: str | None = None
        self.lost_answers = 0
        """Answers lost since the connect from a controller that answered again afterwards."""
        self._probe_s = probe_s
        self._position = position
        self._enabled = enabled
        self._lock = threading.Lock()

    def begin(self) -> None:
        """Reset for a new session."""
        self.fault = None
        self.lost_answers = 0

    def run(self, requests: ControllerRequests, action: Callable[[], _Answer]) -> _Answer:
        """Run requests; probe the controller after silence, and end the session when it lost its state."""
        try:
            return action()
        except BadPacket as damaged:
            raise self._handle_loss(
                requests, Timeout(f"controller: an answer came damaged ({damaged})")
            ) from damaged
        except Timeout as silence:
            raise self._handle_loss(requests, silence) from silence
        except ControllerRefusal as refusal:
            self._position.forget_stream()
            if refusal.text == MALFORMED:
                raise self._handle_loss(requests, Timeout(f"{refusal}: it came damaged")) from refusal
            if refusal.text in _STATE_LOST:
                raise self.give_up(
                    requests, f"{refusal}: it restarted, or another program used it"
                ) from refusal
            raise

    def give_up(self, requests: ControllerRequests, reason: str) -> NotConnected:
        """End the session for a reason; return the error to raise."""
        failure = NotConnected(reason)
        self.fault = reason
        requests.session.fail(failure)
        return failure

    def _handle_loss(self, requests: ControllerRequests, silence: Timeout) -> Timeout:
        """Handle a lost answer; return the error to raise if the controller still answers."""
        self._position.forget_stream()
        self._probe_after_silence(requests, silence)
        self.lost_answers += 1
        return Timeout(
            f"{silence}; it answers again, so a packet was lost: the mirrors are parked, ask again"
        )

    def _probe_after_silence(self, requests: ControllerRequests, silence: Timeout) -> None:
        """Park; return when the controller answers again in the expected state, else end the session."""
        with self._lock:
            probe = ControllerRequests(requests.session, deadline_s=self._probe_s)
            for _ in range(PROBES):
                self._park_if_enabled(requests)
                try:
                    found_enabled = probe.enabled()
                except (Timeout, BadPacket):
                    continue
                if found_enabled is not self._enabled():
                    raise self.give_up(requests, "controller: it was silent and came back in another state")
                self._park_if_enabled(requests)
                return
            found = f"{silence}, nor to {PROBES} more questions: it has stopped or the line is broken"
            raise Timeout(str(self.give_up(requests, f"{found}; {RAIL_WARNING}"))) from silence

    def _park_if_enabled(self, requests: ControllerRequests) -> None:
        if self._enabled():
            requests.session.forget(*self._position.park(requests.session))
