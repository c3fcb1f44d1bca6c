"""The folder of each capture's products beside the datasets: its name, and its removal at once."""

import hashlib
import re
import shutil
from pathlib import Path

from foveacam_pipeline.storage.disk import disk_errors

_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


def product_home(folder: Path, capture_id: str) -> Path:
    """Return the folder of a capture's products in `folder`, safe for any id."""
    plain = _PLAIN.fullmatch(capture_id) is not None
    return folder / (capture_id if plain else "." + hashlib.sha256(capture_id.encode()).hexdigest())


def remove_product(home: Path, *, what: str) -> None:
    """Delete a folder of products, if there is one; it disappears at once. Raise as `disk_errors`."""
    gone = home.with_name(f"{home.name}.gone")
    shutil.rmtree(gone, ignore_errors=True)
    if not home.exists():
        return
    with disk_errors(f"removing {what}", home.parent):
        home.rename(gone)
    shutil.rmtree(gone, ignore_errors=True)


def replace_product(made: Path, place: Path) -> None:
    """Move a finished product to its place, from which an older one disappears. Raise OSError."""
    older = place.with_name(f"{place.name}.older")
    shutil.rmtree(older, ignore_errors=True)
    if place.exists():
        place.rename(older)
    made.rename(place)
    shutil.rmtree(older, ignore_errors=True)
