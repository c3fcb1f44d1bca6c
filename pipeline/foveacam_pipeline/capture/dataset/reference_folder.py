"""The folder `reference/` of a dataset: a depth reference made later, not listed by the frame index.

`reference/reference.json` names the other files with their SHA-256. A new reference is written into a
temporary folder that then replaces the old one by a rename, so that a reader finds a complete one or none.
"""

import json
import shutil
from contextlib import suppress
from pathlib import Path

from foveacam_hardware.contract import InvalidInput

REFERENCE = "reference"
REFERENCE_DOCUMENT = "reference.json"
REFERENCE_FORMAT = "foveacam-reference"
REFERENCE_SAMPLES = "samples.csv"
REFERENCE_PICTURE = "comparison"
"""File name of the figure without its suffix (svg, png)."""
REFERENCE_VERSION = 1
_MAKING, _OLDER = f".{REFERENCE}.part", f".{REFERENCE}.older"


def reference_files(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file of a reference, by its path relative to the dataset's folder."""
    path = folder / REFERENCE / REFERENCE_DOCUMENT
    if not path.exists():
        return {}
    again = "make the reference again"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        known = found["format"] == REFERENCE_FORMAT and found["version"] == REFERENCE_VERSION
        files = {str(name): str(digest) for name, digest in found["files"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InvalidInput(f"{path} cannot be read ({error!r}); {again}") from error
    if not known:
        raise InvalidInput(f"{path}: {REFERENCE_FORMAT} version {REFERENCE_VERSION} is needed; {again}")
    if any(Path(name).parent != Path(REFERENCE) for name in files):
        raise InvalidInput(f"{path} names files that are not in its folder; {again}")
    return files


def begin_reference(folder: Path) -> Path:
    """Return an empty temporary folder for a new reference. Raise OSError."""
    remove_unfinished_reference(folder)
    making = folder / _MAKING
    making.mkdir()
    return making


def finish_reference(folder: Path) -> Path:
    """Rename the temporary folder to `reference`, setting an older one aside for removal. Raise OSError."""
    whole = folder / REFERENCE
    if whole.exists():
        whole.rename(folder / _OLDER)
    (folder / _MAKING).rename(whole)
    return whole


def remove_reference(folder: Path) -> None:
    """Remove a dataset's reference in one rename; do nothing where there is none. Raise OSError."""
    remove_unfinished_reference(folder)
    with suppress(FileNotFoundError):
        (folder / REFERENCE).rename(folder / _MAKING)
    remove_unfinished_reference(folder)


def remove_unfinished_reference(folder: Path) -> None:
    """Remove what an interrupted writer left, and restore the reference it was replacing. Raise OSError."""
    older, whole = folder / _OLDER, folder / REFERENCE
    if older.exists() and not whole.exists():
        older.rename(whole)
    for left in (older, folder / _MAKING):
        shutil.rmtree(left, ignore_errors=True)
