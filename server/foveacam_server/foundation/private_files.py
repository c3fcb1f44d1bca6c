"""Protects files and folders from other users of the machine: secrets, and all that a server stores."""

import logging
import os
import stat
from pathlib import Path

from foveacam_pipeline.storage.disk import PRIVATE

_log = logging.getLogger(__name__)

PRIVATE_FOLDER = 0o700
PRIVATE_UMASK = 0o077
_OTHERS = stat.S_IRWXG | stat.S_IRWXO


def make_private_folder(folder: Path) -> None:
    """Make a folder that only its owner may enter, or restrict an existing one. Raise `OSError`."""
    folder.mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
    make_private(folder)


def make_private_file(path: Path) -> None:
    """Make an empty private file, or restrict an existing one, before it is written. Raise `OSError`."""
    try:
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, PRIVATE))
    except FileExistsError:
        make_private(path)  # not opened: closing a database's file would drop SQLite's locks


def make_private(path: Path) -> None:
    """Remove the permissions of others from a file or folder, and log that; raise `FileNotFoundError`.

    One that belongs to another user, or is shared on purpose (a folder such as /tmp), is only logged.
    """
    mode = stat.S_IMODE(path.stat().st_mode)
    if not mode & _OTHERS:
        return
    kept = mode & ~_OTHERS
    try:
        if mode & stat.S_ISVTX:
            raise PermissionError("it is shared by all users")
        path.chmod(kept)
    except OSError as error:
        reason = error.strerror or error
        _log.warning("%s can be read by others (mode %o) and cannot be closed: %s", path, mode, reason)
        return
    level = logging.WARNING if path.is_dir() else logging.INFO  # one log line for the folder and its content
    _log.log(level, "%s could be read by others (mode %o); it has mode %o now", path, mode, kept)


def warn_if_readable(path: Path, *, what: str) -> None:
    """Log a warning about a secret's file that every user of this machine can read."""
    mode = stat.S_IMODE(path.stat().st_mode)
    if mode & stat.S_IRWXO:
        _log.warning("%s %s can be read by every user of this machine: chmod 600 it", what, path)
