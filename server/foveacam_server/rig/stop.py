"""The stop: holds and parks all devices at once and refuses moves until released.

It needs no lease, no queue and no database.
"""

import logging
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

from foveacam_hardware.contract import FoveaError
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.names import utc_now
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.schema import StopAnswer, StopChange, StopDocument

_log = logging.getLogger(__name__)


CONFIRM_S = 1.0
"""Longest wait for the controller's acknowledgement; 2 to 20 ms are usual."""


def bring_to_rest(rig: AssembledRig) -> bool:
    """Hold pan-tilt and rail and park the mirrors, from any thread; return whether the mirrors confirmed."""
    if rig.pan_tilt is not None:
        _try_move("the pan-tilt could not be held", rig.pan_tilt.hold)
    if rig.rail is not None:
        _try_move("the rail could not be held", rig.rail.hold)
    return _try_move(
        "the mirrors could not be parked", partial(rig.mirrors.park_confirmed, within_s=CONFIRM_S)
    )


def _try_move(trouble: str, move: Callable[[], object]) -> bool:
    try:
        move()
    except FoveaError as error:
        _log.warning("stop: %s: %s", trouble, error)
        return False
    return True


class Haltable(Protocol):
    """Access of the stop to the hardware thread."""

    def halt(self) -> bool:
        """Refuse moves and park; return whether the mirrors confirmed."""
        ...

    def resume(self) -> None:
        """Allow moves again."""
        ...


RELEASED = StopDocument(engaged=False, since_utc=None, by=None)


class StopSwitch:
    """Engages and releases the stop; anybody may engage it at any time."""

    def __init__(self, hardware: Haltable, *, cancel_jobs: Callable[[str], None], events: EventLog) -> None:
        self._hardware = hardware
        self._cancel_jobs = cancel_jobs
        self._events = events
        self._lock = threading.Lock()
        self._state = RELEASED

    @property
    def state(self) -> StopDocument:
        """Whether it is engaged."""
        return self._state

    def engage(self, by: str) -> StopAnswer:
        """Park now and cancel all jobs that move the rig; return whether the mirrors confirmed."""
        with self._lock:
            if not self._state.engaged:
                self._state = StopDocument(engaged=True, since_utc=utc_now(), by=by)
            state = self._state
        began_s = time.perf_counter()
        parked = self._hardware.halt()
        elapsed_ms = round(1e3 * (time.perf_counter() - began_s), 3)
        self._cancel_jobs("the stop was engaged")
        message = "stop: mirrors parked" if parked else "stop: engaged, but the mirrors did not confirm"
        data = StopChange(by=by, parked=parked, stop=state)
        self._events.emit("stop.engaged", message, level=EventLevel.WARNING, data=data)
        return StopAnswer(engaged=True, parked=parked, parked_in_ms=elapsed_ms)

    def release(self, by: str) -> StopDocument:
        """Allow moves again, if the stop is engaged."""
        with self._lock:
            was_engaged = self._state.engaged
            self._state = RELEASED
            self._hardware.resume()
        if was_engaged:
            data = StopChange(by=by, stop=RELEASED)
            self._events.emit("stop.released", "the stop was released", data=data)
        return self._state
