"""Lists, reads, writes and restores the rig files of the data directory and that of the command line.

A file is overwritten only if it still has the content that the writer saw; the old content is kept as a
version.
"""

import difflib
import hashlib
import tomllib
from pathlib import Path
from typing import Any

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_hardware.rig_config import load_rig_config
from foveacam_server.foundation.errors import EditedMeanwhile, NotFound
from foveacam_server.foundation.whole_file import write_whole

TomlTable = dict[str, Any]  # Any: not validated yet
"""A table of a rig file."""
RIGS = "rigs"
"""Folder of the data directory with rig files."""
VERSIONS_KEPT = 50


class RigFileFolder:
    """The rig files that a server may read and write; `given`: that of the command line, if any."""

    def __init__(self, data: Path, *, given: Path | None) -> None:
        self._folder = data / RIGS
        self._versions = data / "rig_setup" / "versions"
        self._given = None if given is None else given.absolute()

    @property
    def given(self) -> Path | None:
        """The rig file of the command line."""
        return self._given

    def every(self) -> list[Path]:
        """Return all rig files, the command line's first."""
        own = sorted(path.absolute() for path in self._folder.glob("*.toml"))
        first = [] if self._given is None else [self._given]
        return first + [path for path in own if path != self._given]

    def known(self, path: str) -> Path:
        """Return a file of the list by its path; raise `NotFound` for any other."""
        for known in self.every():
            if str(known) == path:
                return known
        raise NotFound(
            f"{path} is not one of the rig files of this server",
            asked=path,
            remedy="choose one of /api/v1/rig/setup/files, or start with foveacam serve --rig FILE",
        )

    def named(self, rig_id: str) -> Path:
        """Return the file of a new rig."""
        return (self._folder / f"{rig_id}.toml").absolute()

    def problem(self, path: Path) -> str | None:
        """Return why a file cannot be opened as a rig; None when it can."""
        try:
            load_rig_config(path)
        except FoveaError as error:
            return str(error)
        return None

    def read(self, path: Path) -> str | None:
        """Return a file's text; None without a file; raise `InvalidInput` when it is not text."""
        try:
            return path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidInput(f"rig file {path}: cannot be read ({error}); correct it by hand") from error

    def write(self, path: Path, text: str, *, seen: str | None) -> None:
        """Write a file if it still has the content with hash `seen`; keep the old content as a version."""
        before = self._check_seen(path, seen)
        if before is not None:
            self._keep(path, before)
        write_whole(path, text, what=f"the rig file {path.name}")

    def versions(self, path: Path) -> int:
        """Return how many earlier versions of a file can be restored."""
        return len(self._kept(path))

    def put_back(self, path: Path, *, seen: str | None) -> None:
        """Restore the last version of a file if it still has the content with hash `seen`."""
        self._check_seen(path, seen)
        kept = self._kept(path)
        if not kept:
            raise NotFound(
                f"{path.name} has no earlier version", asked=f"undo {path.name}", remedy="edit it instead"
            )
        write_whole(path, kept[-1].read_text(encoding="utf-8"), what=f"the rig file {path.name}")
        kept[-1].unlink()

    def _check_seen(self, path: Path, seen: str | None) -> str | None:
        """Return a file's present text; raise `EditedMeanwhile` when it has another hash than `seen`."""
        now = self.read(path)
        if hash_of(now) != seen:
            raise EditedMeanwhile(
                f"{path.name} was changed by somebody else since it was shown here; nothing was written",
                asked=f"save {path.name}",
                found="another content" if now is not None else "no file",
                remedy="look at the changes, then save again",
            )
        return now

    def _keep(self, path: Path, text: str) -> None:
        kept = self._kept(path)
        number = int(kept[-1].stem) + 1 if kept else 1
        write_whole(self._folder_of(path) / f"{number:05d}.toml", text, what=f"a version of {path.name}")
        for old in kept[: max(0, len(kept) + 1 - VERSIONS_KEPT)]:
            old.unlink()

    def _kept(self, path: Path) -> list[Path]:
        return sorted(self._folder_of(path).glob("*.toml"))

    def _folder_of(self, path: Path) -> Path:
        return self._versions / hashlib.sha256(str(path).encode()).hexdigest()[:16]


def hash_of(text: str | None) -> str | None:
    """Return the hash of a file's text; None without a file."""
    return None if text is None else hashlib.sha256(text.encode()).hexdigest()


def difference(before: str | None, after: str | None, *, name: str) -> str:
    """Return the unified diff of two texts; "" where they are equal."""
    lines = difflib.unified_diff(
        (before or "").splitlines(keepends=True),
        (after or "").splitlines(keepends=True),
        fromfile=name,
        tofile=name,
    )
    return "".join(line if line.endswith("\n") else f"{line}\n" for line in lines)


def content_of(text: str | None) -> TomlTable:
    """Return the content of a rig file's text; empty when it is not TOML."""
    try:
        return tomllib.loads(text or "")
    except tomllib.TOMLDecodeError:
        return {}
