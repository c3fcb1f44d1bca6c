"""Small documents with names given by users: one JSON file each, listed, replaced and deleted by name."""

import hashlib
import logging
import threading
from pathlib import Path
from typing import Annotated, Generic, TypeAlias, TypeVar

from pydantic import Field

from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.foundation.whole_file import read_document, write_document

_log = logging.getLogger(__name__)

GivenName: TypeAlias = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^\x00-\x1f\x7f/]+$")]
"""A name in an address: no control characters, no slash."""


class NamedDocument(ResponseModel):
    """A document with its name."""

    name: str


DocumentT = TypeVar("DocumentT", bound=NamedDocument)


class NamedDocuments(Generic[DocumentT]):
    """The documents of one folder; callable from any thread."""

    def __init__(self, folder: Path, schema: type[DocumentT], *, form: str, version: int) -> None:
        self._folder = folder
        self._schema = schema
        self._form = form
        self._version = version
        self._lock = threading.Lock()

    def every(self) -> list[DocumentT]:
        """Return all documents by their names; damaged files are skipped."""
        with self._lock:
            found = [self._read(path) for path in self._folder.glob("*.json")]
        return sorted((one for one in found if one is not None), key=lambda one: one.name.casefold())

    def get(self, name: str) -> DocumentT:
        """Return a document; raise `NotFound` where there is none of this name."""
        found = self._read(self._path(name))
        if found is None:
            known = ", ".join(one.name for one in self.every()) or "none"
            raise NotFound(
                f"there is nothing named {name!r}; there is {known}",
                asked=name,
                found=known,
                remedy="use one of these names",
            )
        return found

    def put(self, document: DocumentT) -> None:
        """Write a document over one of the same name; raise as `write_document`."""
        content = {"format": self._form, "version": self._version, **document.as_json()}
        with self._lock:
            write_document(self._path(document.name), content, what=f"{document.name!r}")

    def delete(self, name: str) -> None:
        """Delete a document; raise `NotFound` where there is none of this name."""
        self.get(name)
        with self._lock, disk_errors(f"removing {name!r}", self._folder):
            self._path(name).unlink(missing_ok=True)

    def _read(self, path: Path) -> DocumentT | None:
        try:
            return read_document(path, self._schema, form=self._form, version=self._version)
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            _log.warning("%s is passed over: %s", path, error)
            return None

    def _path(self, name: str) -> Path:
        return self._folder / f"{hashlib.sha256(name.encode()).hexdigest()[:24]}.json"
