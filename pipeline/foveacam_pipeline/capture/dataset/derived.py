"""What is made of a dataset later and lies in its folder, unknown to its index: a reference.

`reference/reference.json` names the other files with their SHA-256. The folder is made under another name and
takes the place of an older one by a rename: whoever reads it finds one that is whole, or none.
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
"""Of a picture the name without its end: svg, png."""
VERSION = 1
_MAKING, _OLDER = f".{REFERENCE}.part", f".{REFERENCE}.older"


def reference_files(folder: Path) -> dict[str, str]:
    """Return the files of a dataset's reference (from the dataset's folder) with their SHA-256."""
    path = folder / REFERENCE / REFERENCE_DOCUMENT
    if not path.exists():
        return {}
    again = "make the reference again"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        known = found["format"] == REFERENCE_FORMAT and found["version"] == VERSION
        files = {str(name): str(digest) for name, digest in found["files"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InvalidInput(f"{path} cannot be read ({error!r}); {again}") from error
    if not known:
        raise InvalidInput(f"{path}: {REFERENCE_FORMAT} version {VERSION} is needed; {again}")
    if any(Path(name).parent != Path(REFERENCE) for name in files):
        raise InvalidInput(f"{path} names files that are not in its folder; {again}")
    return files


def begin_reference(folder: Path) -> Path:
    """Return an empty folder in which a dataset's reference can be made. Raise OSError."""
    drop_half_made(folder)
    making = folder / _MAKING
    making.mkdir()
    return making


def finish_reference(folder: Path) -> Path:
    """Put what was made in the place of what was there, which waits to be dropped. Raise OSError."""
    whole = folder / REFERENCE
    if whole.exists():
        whole.rename(folder / _OLDER)
    (folder / _MAKING).rename(whole)
    return whole


def remove_reference(folder: Path) -> None:
    """Remove a dataset's reference, at once; harmless where there is none. Raise OSError."""
    drop_half_made(folder)
    with suppress(FileNotFoundError):
        (folder / REFERENCE).rename(folder / _MAKING)
    drop_half_made(folder)


def drop_half_made(folder: Path) -> None:
    """Remove what an ended writer left; what it was about to replace is there again. Raise OSError."""
    older, whole = folder / _OLDER, folder / REFERENCE
    if older.exists() and not whole.exists():
        older.rename(whole)
    for left in (older, folder / _MAKING):
        shutil.rmtree(left, ignore_errors=True)
