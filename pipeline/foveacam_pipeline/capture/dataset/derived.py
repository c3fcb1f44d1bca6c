"""What is made of a dataset later and lies in its folder, unknown to its index: a reference.

`reference/reference.json` is written last and names the other files with their SHA-256.
"""

import json
from pathlib import Path

from foveacam_hardware.contract import InvalidInput

REFERENCE = "reference"
REFERENCE_DOCUMENT = "reference.json"
REFERENCE_FORMAT = "foveacam-reference"
VERSION = 1


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
