"""Lets position updates onto the link: behind pending requests, and as fast as the governor allows."""

import threading

from foveacam_hardware.contract import Clock
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.drivers.controller.update_rate import UpdateRateGovernor


class SteeringPacer:
    """The turns of whoever steers; any thread may wait for one."""

    def __init__(self, governor: UpdateRateGovernor, clock: Clock) -> None:
        self._governor = governor
        self._clock = clock
        self._lock = threading.Lock()

    @property
    def rate_hz(self) -> float:
        """How many updates a second get through now."""
        return self._governor.rate_hz

    def begin(self, session: ControllerSession) -> None:
        """Start anew on a link that has just been connected, its round trips the measure of later ones."""
        with self._lock:
            self._governor.begin(self._clock.now_ns(), baseline_ms=session.recent_p95_ms() or 0.0)

    def wait_turn(self, session: ControllerSession) -> None:
        """Return when an update may go."""
        with self._lock:
            t_ns = self._clock.now_ns()
            if self._governor.looks(t_ns):
                backlog = session.backlog()
                self._governor.adjust(
                    t_ns,
                    stalls=backlog.stalls,
                    queued_bytes=backlog.queued_bytes,
                    rtt_p95_ms=session.recent_p95_ms(),
                )
            due_ns = self._governor.reserve(t_ns)
        if session.pending:
            session.wait_answered(self._governor.hold_ns(session.recent_p95_ms()) * 1e-9)
        self._clock.sleep_until_ns(due_ns)
