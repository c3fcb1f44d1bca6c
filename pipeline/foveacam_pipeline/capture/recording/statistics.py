"""Frame counts of a recording: for every published frame, whether it was written, or why not."""

from dataclasses import dataclass, field, replace
from enum import StrEnum


class FrameLoss(StrEnum):
    """Why a published frame is not in the file."""

    QUEUE = "queue"
    """The ring was full: the disk is slower than the cameras."""
    FORMAT = "format"
    """Its format differs from that of the stream's first frame."""
    DISK = "disk"
    """Writing it failed."""
    CLOSED = "closed"
    """It arrived after the recording had ended."""
    DEADLINE = "deadline"
    """It was still queued when the time to finish ran out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamStatistics:
    """One stream; published = written + dropped + waiting, and waiting is 0 once the recording has ended."""

    published: int = 0
    missing: int = 0
    """Sequence numbers missing between published frames: the frames were not read, or never arrived."""
    last_seq: int | None = None
    written: int = 0
    waiting: int = 0
    losses: dict[FrameLoss, int] = field(default_factory=dict)
    bytes_written: int = 0
    first_t_ns: int | None = None
    last_t_ns: int | None = None

    @property
    def dropped(self) -> int:
        """Frames that are not in the file, for any reason."""
        return sum(self.losses.values())

    @property
    def fps(self) -> float:
        """Mean rate of the written frames, Hz; 0 when there are too few."""
        if self.first_t_ns is None or self.last_t_ns is None or self.last_t_ns <= self.first_t_ns:
            return 0.0
        return (self.written - 1) * 1e9 / (self.last_t_ns - self.first_t_ns)

    def with_published(self, seq: int) -> "StreamStatistics":
        """Count a published frame, and the missing numbers before it."""
        gap = 0 if self.last_seq is None else max(0, seq - self.last_seq - 1)
        return replace(
            self,
            published=self.published + 1,
            missing=self.missing + gap,
            last_seq=seq if self.last_seq is None else max(seq, self.last_seq),
            waiting=self.waiting + 1,
        )

    def with_written(self, size: int, *, t_ns: int) -> "StreamStatistics":
        """Count a queued frame as written, `size` bytes."""
        return replace(
            self,
            written=self.written + 1,
            waiting=self.waiting - 1,
            bytes_written=self.bytes_written + size,
            first_t_ns=t_ns if self.first_t_ns is None else min(t_ns, self.first_t_ns),
            last_t_ns=t_ns if self.last_t_ns is None else max(t_ns, self.last_t_ns),
        )

    def with_lost(self, loss: FrameLoss) -> "StreamStatistics":
        """Count a queued frame as lost."""
        losses = {**self.losses, loss: self.losses.get(loss, 0) + 1}
        return replace(self, waiting=self.waiting - 1, losses=losses)

    def with_taken_back(self, size: int) -> "StreamStatistics":
        """Count a written frame, `size` bytes, as removed to make room for the file's end."""
        losses = {**self.losses, FrameLoss.DISK: self.losses.get(FrameLoss.DISK, 0) + 1}
        return replace(self, written=self.written - 1, bytes_written=self.bytes_written - size, losses=losses)

    def document(self) -> dict[str, object]:
        """Return the counts as JSON."""
        return {
            "published": self.published,
            "written": self.written,
            "dropped": self.dropped,
            "missing": self.missing,
            "losses": {loss.value: count for loss, count in self.losses.items()},
            "fps": round(self.fps, 3),
            "bytes": self.bytes_written,
        }
