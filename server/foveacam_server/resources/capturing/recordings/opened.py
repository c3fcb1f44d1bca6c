"""A cache of open recordings, so that a long index is not read again for every picture."""

import threading
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from foveacam_pipeline.capture.recording.reader import Recording

KEPT = 4
"""Most open recordings; the least recently used is closed."""


@dataclass(slots=True, eq=False)
class _Open:
    recording: Recording
    lock: threading.Lock = field(default_factory=threading.Lock)
    closed: bool = False

    def close(self) -> None:
        with self.lock:
            self.closed = True
            self.recording.close()


class OpenRecordings:
    """Cache of open recordings, each lent to one thread at a time."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open: OrderedDict[tuple[Path, int, int], _Open] = OrderedDict()

    @contextmanager
    def reading(self, path: Path) -> Iterator[Recording]:
        """Yield an open recording; raise `InvalidInput` for another file. Frames stay valid afterwards."""
        while True:
            entry = self._entry(path)
            with entry.lock:
                if not entry.closed:
                    yield entry.recording
                    return

    def is_open(self, path: Path) -> bool:
        """Return whether a recording is open."""
        with self._lock:
            return any(key[0] == path for key in self._open)

    def forget(self, path: Path) -> None:
        """Close a removed recording, if it is open, so that its disk space is freed."""
        with self._lock:
            gone = [self._open.pop(key) for key in list(self._open) if key[0] == path]
        for entry in gone:
            entry.close()

    def close(self) -> None:
        """Close all recordings."""
        with self._lock:
            left, self._open = list(self._open.values()), OrderedDict()
        for entry in left:
            entry.close()

    def _entry(self, path: Path) -> _Open:
        key = _key(path)
        with self._lock:
            entry = self._open.get(key)
            if entry is None:
                entry = self._open[key] = _Open(Recording(path))
            self._open.move_to_end(key)
            surplus = [self._open.popitem(last=False)[1] for _ in range(len(self._open) - KEPT)]
        for old in surplus:
            old.close()
        return entry


def _key(path: Path) -> tuple[Path, int, int]:
    try:
        found = path.stat()
    except OSError:
        return path, 0, 0
    return path, found.st_mtime_ns, found.st_size
