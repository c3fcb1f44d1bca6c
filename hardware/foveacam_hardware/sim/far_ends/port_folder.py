"""The temporary folder in which a far end's port lies, and the removal of those whose owners were killed."""

import contextlib
import fcntl
import os
import shutil
import tempfile
from pathlib import Path

PREFIX = "foveacam-port-"
OWNER = "owner"
"""A file in it that its owner keeps locked: the system drops the lock with the process, however that ends."""


class PortFolder:
    """A new folder below the system's temporary one; its removal is left to `close`, or to a later start."""

    def __init__(self) -> None:
        clear_abandoned(Path(tempfile.gettempdir()))
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        self._lock_fd = _locked(self.path)

    def close(self) -> None:
        """Remove it; harmless when removed."""
        shutil.rmtree(self.path, ignore_errors=True)
        if self._lock_fd >= 0:
            os.close(self._lock_fd)
        self._lock_fd = -1


def clear_abandoned(parent: Path) -> list[Path]:
    """Remove the folders of this user whose owner has ended without removing them; return which."""
    return [folder for folder in parent.glob(f"{PREFIX}*") if _abandoned(folder) and _removed(folder)]


def _locked(folder: Path) -> int:
    """Lock the owner's file; it has its name only when it is locked, so that nobody finds it unlocked."""
    unnamed = folder / f".{OWNER}"
    lock_fd = os.open(unnamed, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    fcntl.flock(lock_fd, fcntl.LOCK_EX)
    unnamed.rename(folder / OWNER)
    return lock_fd


def _abandoned(folder: Path) -> bool:
    """Tell whether it is this user's, and its owner's lock is gone; what cannot be looked into is not."""
    try:
        if folder.is_symlink() or folder.stat().st_uid != os.getuid():
            return False
        lock_fd = os.open(folder / OWNER, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(lock_fd)
    return True


def _removed(folder: Path) -> bool:
    with contextlib.suppress(OSError):
        shutil.rmtree(folder)
    return not folder.exists()
