"""Restores a backup into a new data directory: completely, with all hashes correct, or not at all.

All headers are checked before anything is written: a backup holds regular files only, each once, with a plain
path and the size in its manifest.
"""

import hashlib
import math
import os
import shutil
import tarfile
import unicodedata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from pydantic import ValidationError

from foveacam_hardware.contract import Cancelled, InvalidInput, StorageFull
from foveacam_pipeline.storage.disk import PRIVATE, disk_errors, part_path, sync_folder
from foveacam_pipeline.workers.progress import ProgressWatcher
from foveacam_server.foundation.backup.archive import MANIFEST, BackupManifest, report_bytes
from foveacam_server.foundation.migrate import is_known
from foveacam_server.foundation.private_files import make_private_folder

_CHUNK_BYTES = 1 << 20
_MANIFEST_BYTES = 1 << 28
"""Largest manifest, bytes; that of a million files has half as many."""
_LAST_MTIME_S = 1 << 40
_BAD_HEADER = (tarfile.TarError, EOFError, ValueError, KeyError, OverflowError, RecursionError)
"""Errors that `tarfile` raises for damaged or malicious headers."""


def restore(archive: Path, folder: Path, *, watch: ProgressWatcher) -> BackupManifest:
    """Unpack a backup into a new or empty directory.

    Raise InvalidInput for a directory that is not empty and for an archive that is no backup, cut short,
    damaged, of a newer version, or holds anything but plain files; StorageFull for a full disk; Cancelled.
    The directory is then as before.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidInput(
            f"{folder} has something in it: a backup is restored into a new directory; choose another with "
            "--data DIR",
            asked=str(folder),
        )
    part = part_path(folder.absolute())
    with _readable(archive):
        members, manifest = _listed(archive)
    _check_version(archive, manifest)
    with disk_errors(f"the backup {archive.name}", folder.absolute().parent):
        shutil.rmtree(part, ignore_errors=True)  # of an interrupted restoration
        try:
            make_private_folder(part)
            _check_room(archive, part, manifest)
            with _readable(archive):
                found = _unpack(archive, members, part, watch)
            _check_hashes(archive, found, manifest)
            os.sync()
            if folder.exists():
                folder.rmdir()
            part.replace(folder)
            sync_folder(folder.absolute().parent)
        finally:
            shutil.rmtree(part, ignore_errors=True)
    return manifest


@contextmanager
def _readable(archive: Path) -> Iterator[None]:
    try:
        yield
    except FileNotFoundError as error:
        raise InvalidInput(f"{archive} does not exist", asked=str(archive)) from error
    except (PermissionError, IsADirectoryError) as error:
        raise InvalidInput(f"{archive} cannot be read: {error.strerror}", asked=str(archive)) from error
    except _BAD_HEADER as error:
        raise InvalidInput(
            f"{archive} is no backup, or was cut short ({error}); nothing was restored, use another one",
            asked=str(archive),
            found=str(error),
        ) from error


def _listed(archive: Path) -> tuple[list[tarfile.TarInfo], BackupManifest]:
    """Return the files of a backup, checked by their headers, and its manifest."""
    members: dict[str, tarfile.TarInfo] = {}
    left_bytes = archive.stat().st_size
    with tarfile.open(archive, "r:") as tar:
        for member in tar:
            left_bytes -= member.size
            fault = _fault_of(member, members, left_bytes=left_bytes)
            if fault is not None:
                raise tarfile.ReadError(f"it holds {member.name!r}, which is no file of a backup: {fault}")
            members[member.name] = member
        last = members.popitem()[1] if members else None
        content = None if last is None or last.name != MANIFEST else tar.extractfile(last)
        if content is None or MANIFEST in members:
            raise tarfile.ReadError("its manifest is missing")
        manifest = _manifest(content.read(_MANIFEST_BYTES))
    _check_sizes(members, manifest)
    return list(members.values()), manifest


def _fault_of(
    member: tarfile.TarInfo, before: Mapping[str, tarfile.TarInfo], *, left_bytes: int
) -> str | None:
    """Return why a member cannot belong to a backup; `left_bytes`: of the archive, beyond its header."""
    path = PurePosixPath(member.name)
    if member.type not in (tarfile.REGTYPE, tarfile.AREGTYPE):
        return "it is no regular file"
    if member.sparse is not None or any(name.startswith("GNU.sparse") for name in member.pax_headers):
        return "it is a sparse file"
    if any(unicodedata.category(letter) in ("Cc", "Cs") for letter in member.name):
        return "its name has control characters"
    if path.is_absolute() or ".." in path.parts or not path.parts or path.as_posix() != member.name:
        return "its path leads elsewhere"
    if member.name in before or any(parent.as_posix() in before for parent in path.parents):
        return "another file has its place"
    if member.size < 0 or left_bytes < 0:
        return "it is larger than the backup"
    if not math.isfinite(member.mtime) or not 0 <= member.mtime < _LAST_MTIME_S:
        return "its time is invalid"
    return None


def _check_sizes(members: Mapping[str, tarfile.TarInfo], manifest: BackupManifest) -> None:
    sizes = {file.path: file.size for file in manifest.files}
    for name in sorted(sizes.keys() | members.keys()):
        found = members[name].size if name in members else None
        if found != sizes.get(name):
            raise tarfile.ReadError(f"{name}: {found} bytes, by its manifest {sizes.get(name)}")


def _check_version(archive: Path, manifest: BackupManifest) -> None:
    if manifest.revision is not None and not is_known(manifest.revision):
        raise InvalidInput(
            f"{archive} was made by a newer version ({manifest.program}, database {manifest.revision}); "
            "nothing was restored",
            asked=str(archive),
            found=manifest.program,
            remedy="update the program first",
        )


def _check_room(archive: Path, part: Path, manifest: BackupManifest) -> None:
    """Raise `StorageFull` when the files of a backup do not fit on the disk."""
    needed, free = sum(file.size for file in manifest.files), shutil.disk_usage(part).free
    if needed > free:
        raise StorageFull(
            f"{archive} holds {needed / 1e6:.0f} MB, {free / 1e6:.0f} MB are free; nothing was restored",
            asked=f"{needed} bytes",
            found=f"{free} bytes free",
            remedy="free some space or choose another disk with --data DIR",
        )


def _unpack(
    archive: Path, members: list[tarfile.TarInfo], part: Path, watch: ProgressWatcher
) -> dict[str, str]:
    """Write the files; return the SHA-256 of each."""
    total, done = archive.stat().st_size, 0
    found: dict[str, str] = {}
    with tarfile.open(archive, "r:") as tar:
        for member in members:
            content = tar.extractfile(member)
            if content is None:
                raise AssertionError("a regular file has content")
            path = part / member.name
            path.parent.mkdir(parents=True, exist_ok=True)
            digest = hashlib.sha256()
            with path.open("xb") as file:
                os.fchmod(file.fileno(), PRIVATE)
                while chunk := content.read(_CHUNK_BYTES):
                    digest.update(chunk)
                    file.write(chunk)
                    done += len(chunk)
                    report_bytes(watch, done, total)
                    if watch.cancelled():
                        raise Cancelled("the restoration was cancelled; nothing was restored")
            os.utime(path, (member.mtime, member.mtime))
            found[member.name] = digest.hexdigest()
    return found


def _manifest(content: bytes) -> BackupManifest:
    try:
        return BackupManifest.model_validate_json(content)
    except ValidationError as error:
        raise tarfile.ReadError(f"its manifest is not valid: {error.errors()[0]['msg']}") from error


def _check_hashes(archive: Path, found: Mapping[str, str], manifest: BackupManifest) -> None:
    for file in manifest.files:
        if found[file.path] != file.sha256:
            raise InvalidInput(
                f"{archive} is damaged: {file.path} differs from its hash; nothing was restored, use another "
                "one",
                asked=str(archive),
                found=file.path,
            )
