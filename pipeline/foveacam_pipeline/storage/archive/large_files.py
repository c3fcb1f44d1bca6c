"""Resumable upload of a large file in parts: after an interruption only missing parts are sent.

One sender for S3-compatible storage (multipart uploads), one for a folder (a `.part` file). Neither ends with
an object whose content has another hash than was asked for.
"""

import hashlib
import os
from base64 import b64encode
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from foveacam_pipeline.storage.disk import PART, sync_folder

PART_BYTES = 16 << 20
"""Size of a part; a file of twice this size or more is sent in parts."""
_MOST_PARTS = 10_000
"""Most parts of an upload to S3 (Amazon S3 User Guide, multipart upload limits)."""
_AT_ONCE = 2
"""Number of parts of a file sent concurrently; an interruption loses the parts in transit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LargeFile:
    """A file to send: its path, the hash that it must have, the size of its parts.

    `on_bytes`: called with the bytes of each part that is there, from any thread; may raise.
    """

    path: Path
    sha256: str
    part_bytes: int
    on_bytes: Callable[[int], None]

    def parts(self, digest: Any) -> Iterator[bytes]:  # noqa: ANN401 - hashlib names no type
        """Yield the content in parts and feed it to a hash."""
        size = max(self.part_bytes, -(-self.path.stat().st_size // _MOST_PARTS))
        with self.path.open("rb") as file:
            while content := file.read(size):
                digest.update(content)
                yield content


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """A part of a file; `stored_etag`: the tag of the stored part with its number, empty for none."""

    number: int
    content: bytes
    stored_etag: str


class LargeFileSender(Protocol):
    """Sends large files to one kind of storage."""

    def send(self, target: str, file: LargeFile) -> bool:
        """Write a file as the object `target`; return False, and leave none, for another hash."""
        ...

    def drop_unfinished(self, folder: str, *, keep: Collection[str]) -> None:
        """Remove the parts of unfinished objects below a folder, except those of the objects `keep`."""
        ...


class MultipartSender:
    """Sends to S3-compatible storage by multipart uploads, whose parts it compares by MD5."""

    def __init__(self, files: Any) -> None:  # noqa: ANN401 - s3fs ships no types
        self._files = files

    def send(self, target: str, file: LargeFile) -> bool:
        """Complete the newest unfinished upload of the object, or start a new one."""
        upload = _place(target)
        upload["UploadId"] = self._unfinished_id(upload) or self._new_id(upload)
        stored = {part["PartNumber"]: part["ETag"] for part in self._stored(upload)}
        digest, etags = hashlib.sha256(), list[Future[str]]()
        pool = ThreadPoolExecutor(_AT_ONCE, thread_name_prefix="foveacam-archive-part")
        try:
            for number, content in enumerate(file.parts(digest), start=1):
                if number > _AT_ONCE + 1:  # bounds the parts in memory
                    etags[-_AT_ONCE - 1].result()
                part = _Part(number=number, content=content, stored_etag=stored.get(number, ""))
                etags.append(pool.submit(self._send_part, upload, part, file.on_bytes))
            parts = [
                {"PartNumber": number, "ETag": etag.result()} for number, etag in enumerate(etags, start=1)
            ]
        finally:
            pool.shutdown(cancel_futures=True)
        if digest.hexdigest() != file.sha256:
            self._files.call_s3("abort_multipart_upload", **upload)
            return False
        self._files.call_s3("complete_multipart_upload", **upload, MultipartUpload={"Parts": parts})
        return True

    def drop_unfinished(self, folder: str, *, keep: Collection[str]) -> None:
        """Abort the unfinished uploads below a folder, except those of the objects `keep`."""
        kept = {_place(target)["Key"] for target in keep}
        place = _place(f"{folder}/")
        for upload in self._unfinished(place):
            if upload["Key"] not in kept:
                self._files.call_s3(
                    "abort_multipart_upload",
                    Bucket=place["Bucket"],
                    Key=upload["Key"],
                    UploadId=upload["UploadId"],
                )

    def _send_part(self, upload: Mapping[str, str], part: _Part, on_bytes: Callable[[int], None]) -> str:
        """Send a part unless it is already stored; return its tag."""
        md5 = hashlib.md5(part.content, usedforsecurity=False)  # S3's checksum of a part
        etag = part.stored_etag
        if etag.strip('"') != md5.hexdigest():
            checksum = b64encode(md5.digest()).decode()
            answer = self._files.call_s3(
                "upload_part", **upload, PartNumber=part.number, Body=part.content, ContentMD5=checksum
            )
            etag = str(answer["ETag"])
        on_bytes(len(part.content))
        return etag

    def _new_id(self, place: Mapping[str, str]) -> str:
        return str(self._files.call_s3("create_multipart_upload", **place)["UploadId"])

    def _unfinished_id(self, place: Mapping[str, str]) -> str | None:
        found = [upload for upload in self._unfinished(place) if upload["Key"] == place["Key"]]
        return str(max(found, key=lambda upload: upload["Initiated"])["UploadId"]) if found else None

    def _unfinished(self, place: Mapping[str, str]) -> Iterator[Mapping[str, Any]]:
        """Yield the unfinished uploads of all keys that begin as this one's."""
        asked = {"Bucket": place["Bucket"], "Prefix": place["Key"]}
        return self._pages("list_multipart_uploads", "Uploads", asked, marks=("KeyMarker", "UploadIdMarker"))

    def _stored(self, upload: Mapping[str, str]) -> Iterator[Mapping[str, Any]]:
        return self._pages("list_parts", "Parts", upload, marks=("PartNumberMarker",))

    def _pages(
        self, method: str, entries: str, asked: Mapping[str, str], *, marks: tuple[str, ...]
    ) -> Iterator[Mapping[str, Any]]:
        """Yield the entries of a list that S3 gives in pages."""
        after: Mapping[str, Any] = {}
        while True:
            page = self._files.call_s3(method, **asked, **after)
            yield from page.get(entries, ())
            if not page.get("IsTruncated"):
                return
            after = {mark: page[f"Next{mark}"] for mark in marks}


class FolderSender:
    """Sends to a folder: into a file `.part` beside the object, which gets its name when it is whole."""

    def send(self, target: str, file: LargeFile) -> bool:
        """Resume after the bytes of the unfinished file that match the content."""
        path, digest = Path(target), hashlib.sha256()
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(path.name + PART)
        with part.open("r+b" if part.exists() else "w+b") as written:
            for content in file.parts(digest):
                start = written.tell()
                if written.read(len(content)) != content:
                    written.seek(start)
                    written.truncate()
                    written.write(content)
                file.on_bytes(len(content))
            written.truncate()
            written.flush()
            os.fsync(written.fileno())
        if digest.hexdigest() != file.sha256:
            part.unlink()
            return False
        part.replace(path)
        sync_folder(path.parent)
        return True

    def drop_unfinished(self, folder: str, *, keep: Collection[str]) -> None:
        """Remove the unfinished files below a folder, except those of the objects `keep`."""
        for part in Path(folder).rglob(f"*{PART}"):
            if str(part.with_name(part.name.removesuffix(PART))) not in keep:
                part.unlink(missing_ok=True)


def _place(target: str) -> dict[str, str]:
    """Return bucket and key of an object."""
    bucket, _, key = target.partition("/")
    return {"Bucket": bucket, "Key": key}
