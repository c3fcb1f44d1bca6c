"""Pictures of captures, drawn when they are asked for and kept until the capture grows."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.pictures import (
    contact_sheet,
    coverage_picture,
    png_bytes,
    point_anaglyph,
    thumbnail,
)
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_server.capturing.capture_collection import CaptureCollection, StoredCapture
from foveacam_server.capturing.points import point_of, readable
from foveacam_server.runtime.encoder import encode_jpeg

QUALITY = 85
_KINDS: dict[str, Callable[[Dataset], NDArray[np.uint8]]] = {
    "thumbnail": thumbnail,
    "sheet": contact_sheet,
    "coverage": coverage_picture,
}


def drawing(shelf: CaptureCollection, kept: StoredCapture, name: str, *, form: str) -> Path:
    """Return the file of the thumbnail, contact sheet or coverage of a capture; `form`: jpg or png."""
    dataset = readable(kept)
    return _file(shelf, kept, name, form=form, draw=lambda: _KINDS[name](dataset))


def anaglyph_drawing(
    shelf: CaptureCollection, kept: StoredCapture, *, index: int, bracket: int, form: str
) -> Path:
    """Return the file of the red and cyan picture of one point, by its number in the plan."""
    point = point_of(kept, index)
    name = f"anaglyph-{index}-{bracket}"
    return _file(shelf, kept, name, form=form, draw=lambda: point_anaglyph(point, bracket=bracket))


def _file(
    shelf: CaptureCollection,
    kept: StoredCapture,
    name: str,
    *,
    form: str,
    draw: Callable[[], NDArray[np.uint8]],
) -> Path:
    folder = shelf.pictures(kept.id)
    path = folder / f"{name}-{len(readable(kept))}.{form}"
    if path.exists():
        return path
    picture = draw()
    content = png_bytes(picture) if form == "png" else encode_jpeg(picture, quality=QUALITY)
    with disk_errors(f"a picture of capture {kept.name}", shelf.folder):
        folder.mkdir(parents=True, exist_ok=True)
        for older in folder.glob(f"{name}-*.{form}"):
            older.unlink(missing_ok=True)
        write_file(path, memoryview(content))
    return path
