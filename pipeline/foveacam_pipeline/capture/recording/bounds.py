"""When a recording ends by itself: its time is over, or the disk is down to what is kept free."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT

USUAL_S = 300.0
"""Of a recording for which nobody gave a time: 30 GB at 100 MB/s."""
LONGEST_S = 86_400.0
"""That can be asked for: a day."""


class EndCause(StrEnum):
    """What ended a recording; its file is whole after the first three."""

    DURATION = "duration"
    STOPPED = "stopped"
    DISK_RESERVE = "disk_reserve"
    CANCELLED = "cancelled"
    """Its job was cancelled, or the server ended."""
    FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingBounds:
    """How long a recording may become, and how small the disk's free space, which `free_bytes` returns."""

    longest_s: float
    free_bytes: Callable[[], int]

    def reached(self, elapsed_s: float) -> EndCause | None:
        """Return which bound it has come to after so long; None while it may go on."""
        if elapsed_s >= self.longest_s:
            return EndCause.DURATION
        return EndCause.DISK_RESERVE if self.free_bytes() < RESERVE_BYTES else None

    def room_bytes(self) -> int:
        """Return how much it may still write."""
        return max(0, self.free_bytes() - RESERVE_BYTES)


def reserve_words(path: Path) -> str:
    """Return why a recording ended before its time, for the operator."""
    return (
        f"recording {path.stem} has ended early: the disk of {path.parent} is down to the"
        f" {RESERVE_TEXT}; what was recorded is whole; free some space, and record anew"
    )
