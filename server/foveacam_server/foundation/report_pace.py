"""Limits the rate of progress reports."""

from foveacam_hardware.contract import Clock

EVENTS_NS = 200_000_000
"""Period of the progress events."""


class ReportPace:
    """Limits the reports of a job to one per period; the first is due at once."""

    def __init__(self, clock: Clock, *, period_ns: int) -> None:
        self._clock, self._period_ns = clock, period_ns
        self._due_ns: int | None = None

    def is_due(self, *, at_once: bool = False) -> bool:
        """Return whether to report now, and begin another period if so; `at_once`: report in any case."""
        now_ns = self._clock.now_ns()
        if not at_once and self._due_ns is not None and now_ns < self._due_ns:
            return False
        self._due_ns = now_ns + self._period_ns
        return True
