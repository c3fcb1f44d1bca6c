"""Applies the rules of retention: on request as previewed, and once an hour where they are automatic."""

import threading
from pathlib import Path

from foveacam_server.foundation.errors import EditedMeanwhile
from foveacam_server.foundation.periodic import PeriodicThread
from foveacam_server.resources.capturing.retention.rules import Sources, preview
from foveacam_server.resources.capturing.retention.schema import RetentionApplied, RetentionPreview

PERIOD_S = 3600.0


class RetentionService:
    """Applies the rules of a data directory to its collections."""

    def __init__(self, data: Path, sources: Sources) -> None:
        self._data, self._sources = data, sources
        self._lock = threading.Lock()
        self._thread = PeriodicThread("foveacam-retention", self.apply_automatic, period_s=PERIOD_S)

    def start(self) -> None:
        """Start to apply automatic rules, the first time after an hour."""
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._thread.close()

    def preview(self) -> RetentionPreview:
        """Return what the rules would remove now."""
        return preview(self._data, self._sources)

    def apply(self, digest: str) -> RetentionApplied:
        """Remove exactly the items of a preview; raise EditedMeanwhile for an outdated one."""
        with self._lock:
            found = self.preview()
            if found.digest != digest:
                raise EditedMeanwhile(
                    "what the rules would remove has changed since then; nothing was removed",
                    asked=digest,
                    found=found.digest,
                    remedy="look again: GET /api/v1/retention",
                )
            for item in found.items:
                self._sources[item.kind].remove(item.id)
        return RetentionApplied(items=found.items, size_bytes=found.size_bytes)

    def apply_automatic(self) -> None:
        """Apply the rules where they are automatic."""
        found = self.preview()
        if found.rules.automatic and found.items:
            self.apply(found.digest)
