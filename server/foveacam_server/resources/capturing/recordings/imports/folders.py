"""Folders of the server's machine from which recordings are opened in place; no other path is read."""

import os
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.recording.values import OLD_SUFFIX, SUFFIX
from foveacam_server.resources.capturing.recordings.imports.schema import (
    FolderDocument,
    FolderFile,
    FoldersDocument,
)

MOST_FILES = 500
"""Largest number of listed files."""
MOST_ENTRIES = 20_000
"""Largest number of folder entries searched."""
IMPORT = "import"
"""The folder of the data directory from which recordings are opened without any setting."""


class RecordingFolders:
    """Lists the recordings of some folders, and resolves a path below one of them."""

    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders = tuple(folder.expanduser().absolute() for folder in folders)

    def describe(self, opened: set[Path]) -> FoldersDocument:
        """Return the folders and their newest recordings; `opened`: real paths of those already opened."""
        files, looked_at = list[tuple[float, FolderFile]](), 0
        for folder in self._folders:
            for entry in _entries(folder):
                looked_at += 1
                if looked_at > MOST_ENTRIES:
                    break
                if (found := _file(entry, opened)) is not None:
                    files.append(found)
        files.sort(key=lambda one: one[0], reverse=True)
        return FoldersDocument(
            folders=[
                FolderDocument(path=str(folder), found=os.access(folder, os.R_OK | os.X_OK))
                for folder in self._folders
            ],
            files=[file for _, file in files[:MOST_FILES]],
            complete=looked_at <= MOST_ENTRIES and len(files) <= MOST_FILES,
        )

    def resolve(self, text: str) -> Path:
        """Return the real path of a recording; raise `InvalidInput` unless it lies below one of the folders.

        A relative path lies below the first folder. Links are followed before the check.
        """
        try:
            path = (self._folders[0] / text).resolve()
            inside = any(path.is_relative_to(folder.resolve()) for folder in self._folders)
            there = inside and path.is_file()
        except (OSError, ValueError, RuntimeError) as error:
            raise InvalidInput(
                f"open: that is no path of a file ({error}); choose one of the list"
            ) from error
        if not inside:
            allowed = ", ".join(map(str, self._folders))
            raise InvalidInput(
                f"open: {text} is in none of the folders that recordings are opened from",
                asked=text,
                found=f"recordings are opened from {allowed}",
                remedy=f"move it to one of {allowed}, or name its folder in FOVEACAM_RECORDING_FOLDERS",
            )
        if not there or path.suffix.lower() not in (SUFFIX, OLD_SUFFIX):
            raise InvalidInput(
                f"open: {text} is no file that ends in {SUFFIX} or {OLD_SUFFIX}",
                asked=text,
                found="no such file" if not there else f"a file that ends in {path.suffix or 'nothing'}",
                remedy="choose one of the list",
            )
        return path


def _entries(folder: Path) -> Iterator[os.DirEntry[str]]:
    """Yield the files below a folder, without hidden ones; a folder that cannot be read has none."""
    waiting = [str(folder)]
    while waiting:
        try:
            entries = list(os.scandir(waiting.pop()))
        except OSError:
            continue
        for entry in entries:
            if entry.name.startswith("."):
                continue
            if entry.is_dir(follow_symlinks=False):
                waiting.append(entry.path)
            yield entry


def _file(entry: os.DirEntry[str], opened: set[Path]) -> tuple[float, FolderFile] | None:
    if Path(entry.name).suffix.lower() not in (SUFFIX, OLD_SUFFIX) or not entry.is_file(
        follow_symlinks=False
    ):
        return None
    try:
        found = entry.stat(follow_symlinks=False)
    except OSError:
        return None
    modified = datetime.fromtimestamp(found.st_mtime, UTC).isoformat(timespec="seconds")
    return found.st_mtime, FolderFile(
        path=entry.path,
        name=Path(entry.name).stem,
        size_bytes=found.st_size,
        modified_utc=modified.replace("+00:00", "Z"),
        opened=Path(entry.path).resolve() in opened,
    )
