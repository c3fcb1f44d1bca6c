"""The limits at which a recording ends by itself: its duration, and the reserve of free disk space."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT

DEFAULT_S = 300.0
"""Duration of a recording for which none was given: 30 GB at 100 MB/s."""
LONGEST_S = 86_400.0
"""Longest duration that can be requested: a day."""


class EndCause(StrEnum):
    """The cause that ended a recording; its file is complete after the first three."""

    DURATION = "duration"
    STOPPED = "stopped"
    DISK_RESERVE = "disk_reserve"
    CANCELLED = "cancelled"
    """Its job was cancelled, or the server ended."""
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingBounds:
    """The longest duration of a recording, and a function that returns the disk's free space."""

    longest_s: float
    free_bytes: Callable[[], int]

    def reached(self, elapsed_s: float) -> EndCause | None:
        """Return the limit that is reached after `elapsed_s`; None while the recording may continue."""
        if elapsed_s >= self.longest_s:
            return EndCause.DURATION
        return EndCause.DISK_RESERVE if self.free_bytes() < RESERVE_BYTES else None

    def remaining_bytes(self) -> int:
        """Return how much the recording may still write, bytes."""
        return max(0, self.free_bytes() - RESERVE_BYTES)


def early_end_message(path: Path) -> str:
    """Return the operator's message for a recording that ended early."""
    return (
        f"recording {path.stem} has ended early: the disk of {path.parent} is down to the"
        f" {RESERVE_TEXT}; what was recorded is whole; free some space, and record anew"
    )
