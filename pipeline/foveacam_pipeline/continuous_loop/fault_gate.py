"""Circuit breaker of a loop: latches when triggered exposures fail repeatedly in the same way."""

import re

from foveacam_hardware.contract import DeviceFault, FoveaError, NotConnected, Timeout

LATCH_AFTER = 10
"""Equal failures in a row after which the gate latches until the operator resets it."""
SAME_WORDS = 40
"""Failures are equal if this many leading characters of their messages agree, numbers removed."""


class FaultGate:
    """Counts exposures and their failures; while it is latched, the loop's owner triggers none."""

    def __init__(self) -> None:
        self.exposures = 0
        self.failures = 0
        """All failures since the loop began."""
        self.in_a_row = 0
        self.reason: str | None = None
        """Message of the last failure, for the operator; None after a good exposure."""

    @property
    def latched(self) -> bool:
        """Whether the operator has to reset the gate."""
        return self.in_a_row >= LATCH_AFTER

    def passed(self) -> None:
        """Count a good exposure."""
        self.exposures += 1
        self.in_a_row, self.reason = 0, None

    def failed(self, error: FoveaError) -> bool:
        """Count a device failure; return False for any other error, which the caller raises."""
        if not isinstance(error, DeviceFault | Timeout | NotConnected):
            return False
        message = str(error)
        same = self.reason is not None and _kind(self.reason) == _kind(message)
        self.failures += 1
        self.in_a_row = self.in_a_row + 1 if same else 1
        self.reason = message
        return True

    def reset(self) -> None:
        """Unlatch the gate; the counts of exposures and failures stay."""
        self.in_a_row, self.reason = 0, None


def _kind(message: str) -> str:
    """Return the part of a message that equal failures share; exposure numbers and times differ."""
    return re.sub(r"[\d.]+", "", message)[:SAME_WORDS]
