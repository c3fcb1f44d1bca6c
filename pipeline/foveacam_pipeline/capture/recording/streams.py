"""One camera of a recording: when its frames were exposed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.recording.values import StreamFormat


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedStream:
    """One camera of a recording; `t_ns`: (n,) int64, ascending, the recording's monotonic clock."""

    name: str
    role: Role | None
    form: StreamFormat
    t_ns: NDArray[np.int64]

    def __len__(self) -> int:
        """Return how many frames it has."""
        return len(self.t_ns)

    @property
    def fps(self) -> float:
        """Mean rate, Hz; 0 when there are too few frames."""
        span_ns = int(self.t_ns[-1] - self.t_ns[0]) if len(self) > 1 else 0
        return (len(self) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0


def nearest_index(times_ns: NDArray[np.int64], t_ns: int) -> int:
    """Return the number of the moment that is nearest; `times_ns` ascends and may not be empty."""
    after = int(np.searchsorted(times_ns, t_ns))
    before = max(0, after - 1)
    after = min(after, len(times_ns) - 1)
    return before if abs(int(times_ns[before]) - t_ns) <= abs(int(times_ns[after]) - t_ns) else after
