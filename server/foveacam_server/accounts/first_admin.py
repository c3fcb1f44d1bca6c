"""The one-time link that makes the first admin: in a file that only its owner can read, valid for an hour."""

import logging
import secrets
import threading
import time
from collections.abc import Callable
from pathlib import Path

from foveacam_pipeline.storage.disk import PRIVATE
from foveacam_server.accounts.tables import equal
from foveacam_server.foundation.whole_file import write_whole

_log = logging.getLogger(__name__)

LINK_FILE = "first_admin_link"
LIFE_S = 3600.0
_CODE_BYTES = 24


class FirstAdminLink:
    """The code of the link and its file; callable from any thread."""

    def __init__(self, folder: Path, now_s: Callable[[], float] = time.monotonic) -> None:
        self._path = folder / LINK_FILE
        self._now_s = now_s
        self._lock = threading.Lock()
        self._code: str | None = None
        self._until_s = 0.0
        self._remove()  # left by a killed server

    def code(self) -> str:
        """Return the code, made at the first call and valid for an hour from then."""
        with self._lock:
            if self._code is None:
                self._code, self._until_s = secrets.token_urlsafe(_CODE_BYTES), self._now_s() + LIFE_S
            return self._code

    def matches(self, code: str) -> bool:
        """Return whether `code` is the right one and still valid."""
        with self._lock:
            return self._code is not None and self._now_s() < self._until_s and equal(code, self._code)

    def write(self, address: str) -> Path:
        """Write the link below `address` to its file and return the path; raise `StorageFull`."""
        link = f"{address}join?code={self.code()}\n"
        write_whole(self._path, link, what="the link of the first admin", mode=PRIVATE)
        return self._path

    def forget(self) -> None:
        """Invalidate the code and remove the file, after its use or at the end of the server."""
        with self._lock:
            self._until_s = 0.0
        self._remove()

    def forget_expired(self) -> None:
        """Remove the file once the code has expired."""
        with self._lock:
            expired = self._code is not None and self._now_s() >= self._until_s
        if expired:
            self._remove()

    def _remove(self) -> None:
        if not self._path.exists():
            return
        try:
            self._path.unlink()
        except OSError as error:
            _log.warning("%s cannot be removed: %s; its link is refused", self._path, error.strerror)
