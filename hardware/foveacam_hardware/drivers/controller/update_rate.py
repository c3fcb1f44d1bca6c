"""Rate control of position updates: additive increase while the link keeps up, halved when it does not.

The governor is pure (times are passed in); the pacer makes steering threads wait for it and for pending
requests.
"""

import threading

from foveacam_hardware.contract import Clock
from foveacam_hardware.drivers.controller.session import ControllerSession

CEILING_HZ = 1000.0
FLOOR_HZ = 60.0
STEP_HZ = 25.0
PERIOD_NS = 100_000_000
QUEUE_LIMIT_BYTES = 1024
SLOWER_BY = 2.0
"""Ratio of the round trips' p95 to that at the connect above which the link counts as congested."""
LEAST_BASELINE_MS = 1.0
"""One USB frame: below it, round trips depend on the scheduler, not on the link (deduced)."""
HOLD_NS = (5_000_000, 100_000_000)
"""Shortest and longest wait of an update behind an unacknowledged request."""


class UpdateRateGovernor:
    """The update rate of one link; called from one thread at a time."""

    def __init__(
        self,
        *,
        ceiling_hz: float = CEILING_HZ,
        floor_hz: float = FLOOR_HZ,
        least_baseline_ms: float = LEAST_BASELINE_MS,
    ) -> None:
        self.ceiling_hz = ceiling_hz
        self.floor_hz = floor_hz
        self.least_baseline_ms = least_baseline_ms
        self.begin(0, baseline_ms=least_baseline_ms)

    def begin(self, t_ns: int, *, baseline_ms: float) -> None:
        """Start at the ceiling; `baseline_ms`: p95 of the round trips at the connect."""
        self.rate_hz = self.ceiling_hz
        self._baseline_ms = max(baseline_ms, self.least_baseline_ms)
        self._stalls = 0
        self._adjusted_ns = t_ns
        self._next_ns = t_ns

    def adjust(self, t_ns: int, *, stalls: int, queued_bytes: int, rtt_p95_ms: float | None) -> None:
        """Adjust the rate to the state of the link, at most once a period.

        `stalls`: total of writes that the port did not accept at once; `rtt_p95_ms`: of the last second, if
        any.
        """
        periods = (t_ns - self._adjusted_ns) // PERIOD_NS
        if periods < 1:
            return
        self._adjusted_ns += periods * PERIOD_NS
        stalled, self._stalls = stalls > self._stalls, stalls
        slow = rtt_p95_ms is not None and rtt_p95_ms > SLOWER_BY * self._baseline_ms
        if stalled or slow or queued_bytes > QUEUE_LIMIT_BYTES:
            self.rate_hz = max(self.floor_hz, self.rate_hz / 2)
        else:
            self.rate_hz = min(self.ceiling_hz, self.rate_hz + STEP_HZ * periods)

    def adjustment_due(self, t_ns: int) -> bool:
        """Return whether it is time to adjust; measuring the link costs system calls."""
        return t_ns - self._adjusted_ns >= PERIOD_NS

    def reserve(self, t_ns: int) -> int:
        """Reserve the next slot for an update; return its time, ns, not before `t_ns`."""
        due_ns = max(t_ns, self._next_ns)
        self._next_ns = due_ns + round(1e9 / self.rate_hz)
        return due_ns

    def hold_ns(self, rtt_p95_ms: float | None) -> int:
        """Return the longest wait of an update behind an unacknowledged request."""
        shortest_ns, longest_ns = HOLD_NS
        if rtt_p95_ms is None:
            return shortest_ns
        return min(longest_ns, max(shortest_ns, round(SLOWER_BY * rtt_p95_ms * 1e6)))


class SteeringPacer:
    """Makes position updates wait for their slot and behind pending requests; any thread may call."""

    def __init__(self, governor: UpdateRateGovernor, clock: Clock) -> None:
        self._governor = governor
        self._clock = clock
        self._lock = threading.Lock()
        self._looked_ns = 0
        """Time of the last adjustment, ns: each late round trip counts once, as each stalled write does."""

    @property
    def rate_hz(self) -> float:
        """Current limit of updates per second."""
        return self._governor.rate_hz

    def begin(self, session: ControllerSession) -> None:
        """Reset for a link that has just connected; its round trips are the baseline."""
        with self._lock:
            self._governor.begin(self._clock.now_ns(), baseline_ms=session.recent_p95_ms() or 0.0)

    def wait(self, session: ControllerSession) -> None:
        """Wait until an update may be sent."""
        with self._lock:
            t_ns = self._clock.now_ns()
            if self._governor.adjustment_due(t_ns):
                backlog = session.backlog()
                self._governor.adjust(
                    t_ns,
                    stalls=backlog.stalls,
                    queued_bytes=backlog.queued_bytes,
                    rtt_p95_ms=session.fresh_p95_ms(since_ns=self._looked_ns),
                )
                self._looked_ns = t_ns
            due_ns = self._governor.reserve(t_ns)
        if session.pending:
            session.wait_answered(self._governor.hold_ns(session.recent_p95_ms()) * 1e-9)
        self._clock.sleep_until_ns(due_ns)
