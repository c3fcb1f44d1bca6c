"""Stops a loop whose triggered exposures fail again and again in the same way."""

import re

from foveacam_hardware.contract import DeviceFault, FoveaError, NotConnected, Timeout

LATCH_AFTER = 10
"""After so many equal failures in a row the loop waits for the operator."""
SAME_WORDS = 40
"""Failures whose messages, without their numbers, begin with so many equal characters are equal."""


class FaultGate:
    """Counts exposures and their failures; while it is latched, the loop's owner makes no more of them."""

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
        """Count a failure; return False where it is not one of a device: the caller raises it."""
        if not isinstance(error, DeviceFault | Timeout | NotConnected):
            return False
        message = str(error)
        same = self.reason is not None and _kind(self.reason) == _kind(message)
        self.failures += 1
        self.in_a_row = self.in_a_row + 1 if same else 1
        self.reason = message
        return True

    def reset(self) -> None:
        """Let exposures pass again."""
        self.in_a_row, self.reason = 0, None


def _kind(message: str) -> str:
    """Return what messages of equal failures have in common: each names its own exposure and times."""
    return re.sub(r"[\d.]+", "", message)[:SAME_WORDS]
