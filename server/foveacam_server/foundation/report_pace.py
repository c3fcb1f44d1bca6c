"""How often long work reports its progress."""

from foveacam_hardware.contract import Clock

EVENTS_NS = 200_000_000
"""Period of progress that events announce."""


class ReportPace:
    """Limits the reports of a job to one a period; the first is due at once."""

    def __init__(self, clock: Clock, *, period_ns: int) -> None:
        self._clock, self._period_ns = clock, period_ns
        self._due_ns: int | None = None

    def is_due(self, *, at_once: bool = False) -> bool:
        """Return whether to report now, and begin another period if so; `at_once`: this one cannot wait."""
        now_ns = self._clock.now_ns()
        if not at_once and self._due_ns is not None and now_ns < self._due_ns:
            return False
        self._due_ns = now_ns + self._period_ns
        return True
