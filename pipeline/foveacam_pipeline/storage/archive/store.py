"""The objects of an archive: on S3-compatible storage, or in a folder (file://).

Sole importer of fsspec (extra `archive`). Credentials come from the usual environment and profiles of S3, the
endpoint of storage that is not Amazon's from FOVEACAM_ARCHIVE_ENDPOINT.
"""

import asyncio
import logging
import os
import re
from collections.abc import Collection
from functools import cache
from pathlib import Path
from typing import Any

from foveacam_hardware.contract import InvalidInput, install_command
from foveacam_pipeline.storage.archive.failures import archive_errors
from foveacam_pipeline.storage.archive.large_files import (
    FolderSender,
    LargeFile,
    LargeFileSender,
    MultipartSender,
)
from foveacam_pipeline.storage.disk import write_file

_log = logging.getLogger(__name__)

ENDPOINT = "FOVEACAM_ARCHIVE_ENDPOINT"
_URL = re.compile(r"s3://[a-z0-9][a-z0-9.-]{1,62}(/[^?#]*)?|file:///[^?#]*")
_CLIENT = {"connect_timeout": 5, "read_timeout": 30, "retries": {"max_attempts": 2}}
"""Timeouts, s, and retries of the client; s3fs retries by itself besides."""


def checked_url(url: str) -> str:
    """Return the URL of an archive without a slash at its end; raise InvalidInput for another."""
    if not _URL.fullmatch(url):
        raise InvalidInput(
            f"archive {url!r}: that is no address of an archive",
            asked=url,
            remedy="give one such as s3://bucket/prefix",
        )
    return url.rstrip("/")


def open_store(url: str) -> "ArchiveStore":
    """Return the store of an archive, one for all threads; raise InvalidInput without the extra."""
    return _opened(checked_url(url), os.environ.get(ENDPOINT, ""))


@cache
def _opened(url: str, endpoint: str) -> "ArchiveStore":
    return ArchiveStore(url, endpoint=endpoint)


class ArchiveStore:
    """Reads and writes objects by their keys below an archive's URL; for use by any thread."""

    def __init__(self, url: str, *, endpoint: str = "") -> None:
        self.url = url
        scheme, _, path = url.partition("://")
        self._in_folder = scheme == "file"
        self._root = path
        self._files, self._failures = _file_system(scheme, endpoint)
        self._sender: LargeFileSender = FolderSender() if self._in_folder else MultipartSender(self._files)

    def sizes(self, folder: str) -> dict[str, int]:
        """Return the sizes of all objects below a folder, by key."""
        with archive_errors(f"listing {folder or 'all'}", self.url, self._failures):
            try:
                found = self._files.find(self._path(folder), detail=True)
            except FileNotFoundError as error:
                if error.__cause__ is not None:  # a bucket that is not there
                    raise
                return {}
        base = len(self._files._strip_protocol(self._path(""))) + 1  # noqa: SLF001 - fsspec has no public name for it
        return {str(path)[base:]: int(entry["size"]) for path, entry in found.items()}

    def read(self, key: str, *, start: int | None = None, end: int | None = None) -> bytes:
        """Return an object, or its bytes from `start` to before `end`."""
        with archive_errors(f"reading {key}", self.url, self._failures):
            content = self._files.cat_file(self._path(key), start=start, end=end)
            return bytes(content)

    def write(self, key: str, content: bytes) -> None:
        """Write a small object; whole or not at all."""
        with archive_errors(f"writing {key}", self.url, self._failures):
            if self._in_folder:
                path = Path(self._path(key))
                path.parent.mkdir(parents=True, exist_ok=True)
                write_file(path, content)
            else:
                self._files.pipe_file(self._path(key), content)

    def send(self, key: str, file: LargeFile) -> bool:
        """Write a large file as an object, whole or not at all; resume after the stored parts.

        Return False, and leave no object, for a file whose content has another hash.
        """
        with archive_errors(f"sending {key}", self.url, self._failures):
            return self._sender.send(self._path(key), file)

    def drop_unfinished(self, folder: str, *, keep: Collection[str]) -> None:
        """Remove the parts of large files below a folder that were not sent whole, except those of `keep`."""
        with archive_errors(f"listing unfinished uploads of {folder}", self.url, self._failures):
            self._sender.drop_unfinished(self._path(folder), keep={self._path(key) for key in keep})

    def _path(self, key: str) -> str:
        return f"{self._root}/{key}".rstrip("/")


def _file_system(
    scheme: str, endpoint: str
) -> tuple[Any, tuple[type[Exception], ...]]:  # Any: fsspec ships no types
    """Return fsspec's file system, and the exceptions that it raises."""
    try:
        import fsspec

        if scheme != "s3":
            return fsspec.filesystem(scheme, auto_mkdir=True, skip_instance_cache=True), (OSError,)
        import aiohttp
        import fsspec.asyn
        from botocore.exceptions import BotoCoreError, ClientError
    except ImportError as error:
        command = install_command("archive")
        raise InvalidInput(
            f"an archive needs packages that are not installed ({error.name})",
            asked="an archive",
            found=f"{error.name} is not installed",
            remedy=f"install them: {command}",
        ) from error
    # What a lost connection leaves in tasks is told by the call that fails
    fsspec.asyn.get_loop().set_exception_handler(
        lambda loop, context: _log.debug("%s", context["message"], exc_info=context.get("exception"))
    )
    files = fsspec.filesystem(
        "s3",
        client_kwargs={"endpoint_url": endpoint} if endpoint else {},
        config_kwargs=_CLIENT,
        use_listings_cache=False,
        skip_instance_cache=True,
    )
    return files, (OSError, BotoCoreError, ClientError, aiohttp.ClientError, asyncio.TimeoutError)
