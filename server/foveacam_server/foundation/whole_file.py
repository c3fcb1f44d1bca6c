"""Writes small files atomically; reads and writes JSON documents with format and version."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel

from foveacam_pipeline.storage.disk import disk_errors, write_file

SchemaT = TypeVar("SchemaT", bound=BaseModel)


def write_whole(path: Path, text: str, *, what: str, mode: int | None = None) -> None:
    """Write `text` to the disk durably, replacing an older file; the folder is made. `mode`: its permissions.

    Raise `StorageFull` or `DeviceFault` that names `what` was to be written; an older file is then unchanged.
    """
    with disk_errors(what, path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, text.encode(), mode=mode)


def write_document(path: Path, document: Mapping[str, object], *, what: str) -> None:
    """Write a JSON document as `write_whole` does; `ValueError` for a number that JSON cannot carry."""
    write_whole(path, document_text(document), what=what)


def document_text(document: Mapping[str, object]) -> str:
    """Return the text of a JSON document's file."""
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def read_document(path: Path, schema: type[SchemaT], *, form: str, version: int) -> SchemaT:
    """Return a JSON document of that format and version as its schema.

    Raise `OSError` (`FileNotFoundError` where there is none), or `ValueError` for any other content.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except RecursionError as error:
        raise ValueError("its lists are nested too deeply") from error
    if not isinstance(found, dict) or (found.pop("format", None), found.pop("version", None)) != (
        form,
        version,
    ):
        raise ValueError(f"{form} version {version} is needed")
    return schema.model_validate(found)
