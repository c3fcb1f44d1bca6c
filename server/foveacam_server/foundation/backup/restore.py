"""Restores a backup into a new data directory: whole, with every hash right, or not at all."""

import hashlib
import os
import shutil
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from pydantic import ValidationError

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_pipeline.storage.disk import PRIVATE, disk_errors, part_path, sync_folder
from foveacam_server.foundation.backup.archive import MANIFEST, BackupManifest, CopyWatcher
from foveacam_server.foundation.migrate import is_known
from foveacam_server.foundation.private_files import make_private_folder

_CHUNK_BYTES = 1 << 20


def restore(archive: Path, folder: Path, *, watch: CopyWatcher) -> BackupManifest:
    """Unpack a backup into a directory that is new or empty.

    Raise InvalidInput for a directory with something in it and for a backup that is none, was cut short,
    damaged, or made by a newer version; StorageFull for a full disk; Cancelled. The directory is then as
    before.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidInput(
            f"{folder} has something in it: a backup is restored into a new directory; choose another with "
            "--data DIR",
            asked=str(folder),
        )
    part = part_path(folder.absolute())
    with disk_errors(f"the backup {archive.name}", folder.absolute().parent):
        shutil.rmtree(part, ignore_errors=True)  # of one that was cut short
        try:
            make_private_folder(part)
            with _readable(archive):
                found, manifest = _unpack(archive, part, watch)
            _check(archive, found, manifest)
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
    except (tarfile.ReadError, EOFError) as error:
        raise InvalidInput(
            f"{archive} is no backup, or was cut short ({error}); nothing was restored, use another one",
            asked=str(archive),
            found=str(error),
        ) from error


def _unpack(archive: Path, part: Path, watch: CopyWatcher) -> tuple[dict[str, str], BackupManifest]:
    """Return the SHA-256 of each file, and the manifest."""
    total, done = archive.stat().st_size, 0
    found: dict[str, str] = {}
    with tarfile.open(archive, "r:") as tar:
        for member in tar:
            content = tar.extractfile(member)
            if content is None or not _is_safe(member.name):
                raise tarfile.ReadError(f"it holds {member.name!r}, which is no file of a backup")
            if member.name == MANIFEST:
                return found, _manifest(content.read())
            path = part / member.name
            path.parent.mkdir(parents=True, exist_ok=True)
            digest = hashlib.sha256()
            with path.open("xb") as file:
                os.fchmod(file.fileno(), PRIVATE)
                while chunk := content.read(_CHUNK_BYTES):
                    digest.update(chunk)
                    file.write(chunk)
                    done += len(chunk)
                    watch.on_bytes(min(done, total), total)
                    if watch.stopped():
                        raise Cancelled("the restoration was cancelled; nothing was restored")
            os.utime(path, (member.mtime, member.mtime))
            found[member.name] = digest.hexdigest()
    raise tarfile.ReadError("its manifest is missing")


def _is_safe(name: str) -> bool:
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts and bool(path.parts)


def _manifest(content: bytes) -> BackupManifest:
    try:
        return BackupManifest.model_validate_json(content)
    except ValidationError as error:
        raise tarfile.ReadError(f"its manifest is not valid: {error.errors()[0]['msg']}") from error


def _check(archive: Path, found: dict[str, str], manifest: BackupManifest) -> None:
    wanted = {file.path: file.sha256 for file in manifest.files}
    for name in sorted(wanted.keys() | found.keys()):
        if found.get(name) != wanted.get(name):
            raise InvalidInput(
                f"{archive} is damaged: {name} differs from its hash; nothing was restored, use another one",
                asked=str(archive),
                found=name,
            )
    if manifest.revision is not None and not is_known(manifest.revision):
        raise InvalidInput(
            f"{archive} was made by a newer version ({manifest.program}, database {manifest.revision}); "
            "nothing was restored, update the program first",
            asked=str(archive),
            found=manifest.program,
            remedy="update the program first",
        )
