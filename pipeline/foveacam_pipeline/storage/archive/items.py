"""Uploads, lists and fetches the items of an archive, file by file; an interrupted transfer is resumed."""

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

from pydantic import JsonValue

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.storage.archive.large_files import PART_BYTES, LargeFile
from foveacam_pipeline.storage.archive.manifest import (
    MANIFEST,
    ArchivedFile,
    ArchiveManifest,
    ArchiveRecord,
    ItemKind,
    item_folder,
    mismatch,
    parse_manifest,
    read_record,
    write_record,
)
from foveacam_pipeline.storage.archive.store import ArchiveStore, open_store
from foveacam_pipeline.storage.disk import disk_errors, finish_part, part_path, sync_folder

BytesWatcher = Callable[[int, int], None]
"""Receives the bytes done and their total; may raise Cancelled."""
_AT_ONCE = 4
"""Number of files sent concurrently."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ArchiveItem:
    """A dataset, a recording or a still on the disk.

    `files`: its files by their names in the archive; one that is archived already need not be on the disk.
    `large`: those that need not stay on the disk. `record`: path of its record. `about`: what is shown of it
    without reading its files.
    """

    kind: ItemKind
    id: str
    name: str
    label: str
    created_utc: str
    files: Mapping[str, Path]
    large: frozenset[str]
    record: Path
    about: Mapping[str, JsonValue] = field(default_factory=dict)


def upload_item(
    url: str, item: ArchiveItem, *, utc: str, watch: BytesWatcher, part_bytes: int = PART_BYTES
) -> ArchiveRecord:
    """Send the files that the archive lacks, then the manifest; write the local record and return it.

    A file that is there with the right hash is not sent again, nor a part of a large one. Raise Busy for a
    file that changes meanwhile.
    """
    store = open_store(url)
    known = read_record(item.record)
    if known is not None and known.archive != store.url:
        _check_local(item, known)
    earlier = {} if known is None else known.manifest.files
    files = {name: _described(path, earlier.get(name)) for name, path in sorted(item.files.items())}
    manifest = ArchiveManifest(
        kind=item.kind,
        id=item.id,
        name=item.name,
        label=item.label,
        created_utc=item.created_utc,
        archived_utc=utc,
        about=dict(item.about),
        files=files,
    )
    _Upload(store, item, manifest, watch=watch, part_bytes=part_bytes).run()
    store.write(f"{manifest.folder}/{MANIFEST}", manifest.model_dump_json(indent=1).encode())
    record = ArchiveRecord(archive=store.url, manifest=manifest)
    write_record(item.record, record)
    return record


def remove_large_files(item: ArchiveItem, record: ArchiveRecord) -> int:
    """Remove the local copies of an item's large files that its archive holds; return the bytes freed."""
    there = open_store(record.archive).sizes(record.manifest.folder)
    freed = 0
    with disk_errors(f"removing the local files of {item.name}", item.record.parent):
        for name in item.large:
            path, file = item.files[name], record.manifest.files[name]
            if path.is_file() and there.get(record.manifest.key(name)) == file.size_bytes:
                path.unlink()
                freed += file.size_bytes
    return freed


def fetch_item(record: ArchiveRecord, files: Mapping[str, Path], *, watch: BytesWatcher) -> None:
    """Fetch those of `files` that are not on disk, each written atomically and checked by its hash."""
    store = open_store(record.archive)
    wanted = {name: path for name, path in files.items() if not path.is_file()}
    total, done = sum(record.manifest.files[name].size_bytes for name in wanted), 0
    for name, path in wanted.items():
        with disk_errors(f"fetching {name}", path.parent):
            path.parent.mkdir(parents=True, exist_ok=True)
            for count in _fetched(store, record, name, path):
                done += count
                watch(done, total)


def list_archive(url: str) -> list[ArchiveRecord]:
    """Return all items of an archive, the newest first."""
    store = open_store(url)
    keys = [key for key in store.sizes("") if key.endswith(f"/{MANIFEST}") and key.count("/") == 2]
    found = [parse_manifest(store.read(key), what=f"{store.url}/{key}") for key in keys]
    records = [ArchiveRecord(archive=store.url, manifest=manifest) for manifest in found]
    return sorted(records, key=lambda record: record.manifest.created_utc, reverse=True)


def find_item(url: str, kind: ItemKind, item_id: str) -> ArchiveRecord:
    """Return one item of an archive; raise InvalidInput for one that is not there."""
    store = open_store(url)
    content = store.read(f"{item_folder(kind, item_id)}/{MANIFEST}")
    return ArchiveRecord(archive=store.url, manifest=parse_manifest(content, what=f"{kind} {item_id}"))


class _Upload:
    """One upload of an item; counts the bytes of all its threads."""

    def __init__(
        self,
        store: ArchiveStore,
        item: ArchiveItem,
        manifest: ArchiveManifest,
        *,
        watch: BytesWatcher,
        part_bytes: int,
    ) -> None:
        self._store, self._item, self._manifest, self._watch = store, item, manifest, watch
        self._part_bytes = part_bytes
        self._lock, self._done = Lock(), 0

    def run(self) -> None:
        """Send every file that is not there."""
        there = self._store.sizes(self._manifest.folder)
        files = self._manifest.files
        keys = {self._manifest.key(name): name for name in files}  # once each: equal files have one key
        missing = {key: name for key, name in keys.items() if there.get(key) != files[name].size_bytes}
        large = {key for key, name in missing.items() if self._is_large(name)}
        if large:
            self._store.drop_unfinished(self._manifest.folder, keep=large)
        self._count(self._manifest.size_bytes - sum(files[name].size_bytes for name in missing.values()))
        with ThreadPoolExecutor(_AT_ONCE, thread_name_prefix="foveacam-archive") as pool:
            sent = [pool.submit(self._send, name) for name in missing.values()]
            try:
                for future in sent:
                    future.result()
            finally:
                pool.shutdown(cancel_futures=True)

    def _is_large(self, name: str) -> bool:
        return self._manifest.files[name].size_bytes >= 2 * self._part_bytes

    def _send(self, name: str) -> None:
        path, file, key = self._item.files[name], self._manifest.files[name], self._manifest.key(name)
        self._count(0)
        if self._is_large(name):
            large = LargeFile(
                path=path, sha256=file.sha256, part_bytes=self._part_bytes, on_bytes=self._count
            )
            if not self._store.send(key, large):
                raise self._changed(name)
            return
        content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() != file.sha256:
            raise self._changed(name)
        self._store.write(key, content)
        self._count(file.size_bytes)

    def _changed(self, name: str) -> Busy:
        return Busy(
            f"archiving {self._item.name}: {name} was changed meanwhile",
            asked=f"archive {self._item.name}",
            found=f"{name} was changed meanwhile",
            remedy="archive it again",
        )

    def _count(self, sent: int) -> None:
        with self._lock:
            self._done += sent
            self._watch(self._done, self._manifest.size_bytes)


def _check_local(item: ArchiveItem, known: ArchiveRecord) -> None:
    """Raise InvalidInput for an item whose files are only in another archive."""
    if any(name in known.manifest.files and not path.exists() for name, path in item.files.items()):
        found = f"its files are in {known.archive} alone"
        raise InvalidInput(
            asked=f"archive {item.name}",
            found=found,
            remedy="fetch it first",
        )


def _fetched(store: ArchiveStore, record: ArchiveRecord, name: str, path: Path) -> Iterator[int]:
    """Write one file under its name once its hash is right; yield the bytes of each part that came."""
    file, key = record.manifest.files[name], record.manifest.key(name)
    digest, part = hashlib.sha256(), part_path(path)
    try:
        with part.open("wb") as target:
            for start in range(0, file.size_bytes, PART_BYTES):
                content = store.read(key, start=start, end=min(start + PART_BYTES, file.size_bytes))
                digest.update(content)
                target.write(content)
                yield len(content)
            target.flush()
            os.fsync(target.fileno())
        if digest.hexdigest() != file.sha256:
            raise mismatch(name, record.url)
        finish_part(path)
        sync_folder(path.parent)
    finally:
        part.unlink(missing_ok=True)


def _described(path: Path, earlier: ArchivedFile | None) -> ArchivedFile:
    """Return size and hash of a file; from the record if the file is only in the archive."""
    if earlier is not None and not path.exists():
        return earlier
    with disk_errors(f"archiving {path.name}", path.parent):
        return ArchivedFile(size_bytes=path.stat().st_size, sha256=_sha256(path))


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
