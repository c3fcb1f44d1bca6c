"""A temporary folder for a Unix socket that its owner alone can enter; what a kill left is removed."""

import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path

PREFIX = "foveacam-viser-"


class SocketFolder:
    """A new folder of mode 0700, locked while its owner lives; `close` removes it, or a later start."""

    def __init__(self) -> None:
        clear_abandoned(Path(tempfile.gettempdir()))
        folder = Path(tempfile.mkdtemp(prefix=PREFIX))
        self.path = folder / "socket"
        self._lock_fd = os.open(folder, os.O_RDONLY)
        fcntl.flock(self._lock_fd, fcntl.LOCK_EX)

    def close(self) -> None:
        """Remove it; called once."""
        shutil.rmtree(self.path.parent, ignore_errors=True)
        os.close(self._lock_fd)


def clear_abandoned(parent: Path) -> None:
    """Remove the folders of this user whose owner was killed; one without a socket has yet to be locked."""
    for folder in parent.glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):  # another user's, or removed meanwhile
            if (folder / "socket").exists() and not _locked(folder):
                shutil.rmtree(folder)


def _locked(folder: Path) -> bool:
    lock_fd = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(lock_fd)
    return False
