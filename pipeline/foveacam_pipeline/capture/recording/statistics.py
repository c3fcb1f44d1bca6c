"""Honest counts of a recording: of every published frame, whether it lies on the file, or why not."""

from dataclasses import dataclass, field, replace
from enum import StrEnum


class FrameLoss(StrEnum):
    """Why a frame that was published is not on the file."""

    QUEUE = "queue"
    """The ring was full: the disk is slower than the cameras."""
    FORMAT = "format"
    """It was not of the format that its stream began with."""
    DISK = "disk"
    """The disk took no more."""
    CLOSED = "closed"
    """It came after the end."""
    DEADLINE = "deadline"
    """It was still waiting when finishing had to end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamStatistics:
    """One stream; published = written + dropped + waiting, and waiting is 0 once the recording is over."""

    published: int = 0
    missing: int = 0
    """Numbers that are missing between the frames published: nobody read those, or they never came."""
    last_seq: int | None = None
    written: int = 0
    waiting: int = 0
    losses: dict[FrameLoss, int] = field(default_factory=dict)
    bytes_written: int = 0
    first_t_ns: int | None = None
    last_t_ns: int | None = None

    @property
    def dropped(self) -> int:
        """Frames that are not on the file, for whatever reason."""
        return sum(self.losses.values())

    @property
    def fps(self) -> float:
        """Mean rate of the frames written, Hz; 0 when there are too few."""
        if self.first_t_ns is None or self.last_t_ns is None or self.last_t_ns <= self.first_t_ns:
            return 0.0
        return (self.written - 1) * 1e9 / (self.last_t_ns - self.first_t_ns)

    def with_published(self, seq: int) -> "StreamStatistics":
        """Count one that came, and those whose numbers are missing before it."""
        gap = 0 if self.last_seq is None else max(0, seq - self.last_seq - 1)
        return replace(
            self,
            published=self.published + 1,
            missing=self.missing + gap,
            last_seq=seq if self.last_seq is None else max(seq, self.last_seq),
            waiting=self.waiting + 1,
        )

    def with_written(self, size: int, *, t_ns: int) -> "StreamStatistics":
        """Count one that waited and is on the file, `size` bytes of it."""
        return replace(
            self,
            written=self.written + 1,
            waiting=self.waiting - 1,
            bytes_written=self.bytes_written + size,
            first_t_ns=t_ns if self.first_t_ns is None else min(t_ns, self.first_t_ns),
            last_t_ns=t_ns if self.last_t_ns is None else max(t_ns, self.last_t_ns),
        )

    def with_lost(self, loss: FrameLoss) -> "StreamStatistics":
        """Count one that waited and will not be on the file."""
        losses = {**self.losses, loss: self.losses.get(loss, 0) + 1}
        return replace(self, waiting=self.waiting - 1, losses=losses)

    def with_taken_back(self, size: int) -> "StreamStatistics":
        """Count one that was written, `size` bytes, and had to make room for the file's end."""
        losses = {**self.losses, FrameLoss.DISK: self.losses.get(FrameLoss.DISK, 0) + 1}
        return replace(self, written=self.written - 1, bytes_written=self.bytes_written - size, losses=losses)

    def document(self) -> dict[str, object]:
        """Return it for people and programs."""
        return {
            "published": self.published,
            "written": self.written,
            "dropped": self.dropped,
            "missing": self.missing,
            "losses": {loss.value: count for loss, count in self.losses.items()},
            "fps": round(self.fps, 3),
            "bytes": self.bytes_written,
        }
