"""Small files that are replaced whole or not at all, and what kind of document they hold."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from foveacam_pipeline.capture.dataset.disk import write_file


def write_whole(path: Path, text: str) -> None:
    """Put `text` on the disk, over an older file, for good; the folder is made. Raise `OSError`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, text.encode())


def write_document(path: Path, document: Mapping[str, object]) -> None:
    """Write a JSON document whole. Raise `OSError`, or `ValueError` for a number that JSON cannot carry."""
    write_whole(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def read_document(path: Path, *, form: str, version: int) -> dict[str, Any]:
    """Return a JSON document of that format and version, without both.

    Raise `OSError` (`FileNotFoundError` where there is none), or `ValueError` for any other content.
    """
    found = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(found, dict) or (found.pop("format", None), found.pop("version", None)) != (
        form,
        version,
    ):
        raise ValueError(f"{form} version {version} is needed")
    return found
