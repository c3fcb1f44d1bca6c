"""Uploads of recordings in parts: each part is written as it arrives, the complete file is checked.

Parts are small enough for the server's timeout of a request body; a lost connection costs one part.
"""

import asyncio
import os
import threading
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path

from foveacam_hardware.contract import Busy, InvalidInput, OutOfRange, StorageFull
from foveacam_pipeline.capture.recording.framing import MAGIC
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.http.answers import MIB
from foveacam_server.foundation.names import new_id
from foveacam_server.foundation.persons.person_quota import PERSON, Person, Places
from foveacam_server.resources.capturing.recordings.collection import RecordingCollection, StoredRecording
from foveacam_server.resources.capturing.recordings.imports.schema import GIB, LARGEST_BYTES, UploadRequest

PART_BYTES = 8 * MIB
"""Largest part: over a line of 1 Mbit/s it takes 70 s."""
UPLOADS = ".uploads"
IDLE_S = 3600.0
"""Idle time after which an upload is dropped."""
LEFT_S = 30.0
"""Idle time after which a new upload of the same name replaces it, as its page was closed."""
WRITE_BYTES = MIB
HEAD_SHOWN = 12
"""Bytes of a wrong file's beginning that the error message shows."""

MOST_OPEN, MOST_OPEN_EACH = 16, 4
"""Most uploads in progress, of all persons and of one."""

FreeBytes = Callable[[Path], int]


@dataclass(slots=True, kw_only=True, eq=False)
class Upload:
    """An upload in progress; `recording`: set once it is complete."""

    id: str
    name: str
    size_bytes: int
    path: Path
    received_bytes: int = 0
    recording: StoredRecording | None = None
    touched_s: float = field(default_factory=time.monotonic)
    writing: bool = False
    person: Person = None
    """Person on whose quota it counts until it is complete or dropped."""


class UploadService:
    """The uploads in progress; removes files left by an earlier run."""

    def __init__(self, collection: RecordingCollection, *, free_bytes: FreeBytes) -> None:
        self._collection = collection
        self._folder = collection.folder / UPLOADS
        self._free_bytes = free_bytes
        self._lock = threading.Lock()
        self._uploads: dict[str, Upload] = {}
        self._places = Places(
            "uploads", most=MOST_OPEN, most_each=MOST_OPEN_EACH, remedy="wait for one, or abandon one"
        )
        for left in self._folder.glob("*"):
            left.unlink(missing_ok=True)

    def begin(self, request: UploadRequest) -> Upload:
        """Begin an upload; raise at once for a used name, or a size beyond the limit or the free space."""
        stem = self._collection.new_file(request.name).stem
        self._forget_idle(stem)
        self._check_size(request)
        with self._lock:
            coming = {one.name.casefold() for one in self._uploads.values() if one.recording is None}
            if stem.casefold() in coming:
                raise Busy(f"a recording named {stem!r} is being sent already; choose another name")
            return self._begun(stem, request.size_bytes)

    def _begun(self, stem: str, size_bytes: int) -> Upload:
        """Return a new upload, counted on the person's quota; call with the lock held."""
        upload_id, person = new_id("upl"), PERSON.get()
        upload = Upload(
            id=upload_id, name=stem, size_bytes=size_bytes, path=self._folder / upload_id, person=person
        )
        self._places.take(person)
        try:
            with disk_errors(f"receiving recording {stem}", self._folder.parent):
                self._folder.mkdir(exist_ok=True)
                upload.path.touch()
        except BaseException:
            self._places.give_back(person)
            raise
        self._uploads[upload_id] = upload
        return upload

    def get(self, upload_id: str) -> Upload:
        """Return an upload or raise `NotFound`."""
        with self._lock:
            found = self._uploads.get(upload_id)
        if found is None:
            raise NotFound(f"there is no upload {upload_id}; begin one", asked=upload_id)
        return found

    async def add(self, upload_id: str, *, at: int, parts: AsyncIterator[bytes]) -> Upload:
        """Write one part as it arrives; after the last one, check the file and add it to the recordings."""
        upload = self.get(upload_id)
        self._take(upload, at=at)
        try:
            received = await _written(upload, parts)
            if at < len(MAGIC) <= received:
                self._check_head(upload)
            upload.received_bytes = received
            if received == upload.size_bytes:
                self._complete(upload, await asyncio.to_thread(self._finish, upload))
        finally:
            upload.writing, upload.touched_s = False, time.monotonic()
        return upload

    def abandon(self, upload_id: str) -> None:
        """Drop an upload and delete its received parts."""
        self._drop(self.get(upload_id))

    def _take(self, upload: Upload, *, at: int) -> None:
        """Mark an upload as being written from byte `at` on."""
        with self._lock:
            if upload.writing:
                raise Busy(f"a part of {upload.name} is being written; send one after the other")
            if at != upload.received_bytes or upload.recording is not None:
                raise InvalidInput(
                    f"upload {upload.name}: the next part begins at byte {upload.received_bytes}, not {at}",
                    asked=f"a part from byte {at}",
                    found=f"{upload.received_bytes} of {upload.size_bytes} bytes have come",
                    remedy="go on from there",
                )
            upload.writing = True

    def _check_size(self, request: UploadRequest) -> None:
        if request.size_bytes > LARGEST_BYTES:
            raise OutOfRange(
                f"upload: {request.size_bytes / GIB:.1f} GiB are more than the {LARGEST_BYTES / GIB:g} GiB "
                "that are received",
                asked=f"{request.size_bytes} bytes",
                found=f"a limit of {LARGEST_BYTES} bytes",
                remedy="copy it to a folder of the server's machine and open it there",
            )
        if request.size_bytes < len(MAGIC):
            raise InvalidInput(
                f"upload: {request.size_bytes} bytes are no recording",
                found=f"{request.size_bytes} bytes",
                remedy="choose a .fcap file",
            )
        free, needed = self._free_bytes(self._collection.folder), request.size_bytes + RESERVE_BYTES
        if needed > free:
            raise StorageFull(
                f"upload: {needed / 1e6:.0f} MB are needed, with the {RESERVE_TEXT}; {free / 1e6:.0f} MB are "
                "free on the server's disk",
                asked=f"{needed} bytes",
                found=f"{free} bytes",
                remedy="free some space",
            )

    def _check_head(self, upload: Upload) -> None:
        """Drop the upload and raise `InvalidInput` unless it begins like a recording."""
        with upload.path.open("rb") as file:
            head = file.read(HEAD_SHOWN)
        if head.startswith(MAGIC):
            return
        self._drop(upload)
        found = f"it begins with {_words(head)}"
        raise InvalidInput(
            f"upload {upload.name}: this is no recording, {found}",
            asked="a recording (MCAP)",
            found=found,
            remedy="choose a .fcap or .fovea file",
        )

    def _finish(self, upload: Upload) -> StoredRecording:
        """Sync the complete file and add it to the recordings; drop one that cannot be used."""
        try:
            with disk_errors(f"receiving recording {upload.name}", self._folder):
                _sync(upload.path)
            return self._collection.add(upload.path, name=upload.name)
        except BaseException:
            self._drop(upload)
            raise

    def _complete(self, upload: Upload, recording: StoredRecording) -> None:
        with self._lock:
            upload.recording = recording
            if upload.id in self._uploads:  # otherwise it was cancelled meanwhile
                self._places.give_back(upload.person)

    def _drop(self, upload: Upload) -> None:
        with self._lock:
            found = self._uploads.pop(upload.id, None)
        if found is not None and found.recording is None:
            self._places.give_back(found.person)
        upload.path.unlink(missing_ok=True)

    def _forget_idle(self, stem: str) -> None:
        """Drop idle uploads, after a shorter time the one whose name is uploaded again."""
        now_s = time.monotonic()
        with self._lock:
            resting = [one for one in self._uploads.values() if not one.writing]
        for upload in resting:
            longest_s = LEFT_S if upload.name.casefold() == stem.casefold() else IDLE_S
            if now_s - upload.touched_s > longest_s:
                self._drop(upload)


async def _written(upload: Upload, parts: AsyncIterator[bytes]) -> int:
    """Append the arriving bytes in blocks and return the length; raise for more than announced."""
    end = upload.received_bytes
    with (
        disk_errors(f"receiving recording {upload.name}", upload.path.parent),
        await asyncio.to_thread(upload.path.open, "r+b") as file,
    ):
        await asyncio.to_thread(file.truncate, end)  # drops the bytes of an interrupted part
        file.seek(end)
        waiting = bytearray()
        async for part in parts:
            waiting += part
            end += len(part)
            _check_end(upload, end)
            if len(waiting) >= WRITE_BYTES:
                await asyncio.to_thread(file.write, bytes(waiting))
                waiting.clear()
        await asyncio.to_thread(file.write, bytes(waiting))
    return end


def _sync(path: Path) -> None:
    """Flush a file to the disk (fsync). Raise OSError."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


def _check_end(upload: Upload, end: int) -> None:
    if end > upload.size_bytes:
        raise InvalidInput(
            f"upload {upload.name}: more than the {upload.size_bytes} bytes that were announced have come;"
            " begin again with its true length"
        )


def _words(head: bytes) -> str:
    """Return the beginning of a wrong file for the message: its text, or its bytes."""
    text = head.decode("ascii", "replace")
    if text.isprintable() and text.isascii():
        return f'the text "{text}"'
    return f"the bytes {head[:8].hex(' ')}"
