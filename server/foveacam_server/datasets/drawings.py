"""Pictures of datasets (sheet, coverage, anaglyphs), drawn on request and cached until the dataset grows."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.pictures import (
    contact_sheet,
    coverage_picture,
    png_bytes,
    point_anaglyph,
    thumbnail,
)
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_server.datasets.collection import DatasetCollection, StoredCapture, point_of, readable_dataset
from foveacam_server.rig.encoder import encode_jpeg

SHEET_QUALITY = 85
FRAME_QUALITY = 90
_KINDS: dict[str, Callable[[Dataset], NDArray[np.uint8]]] = {
    "thumbnail": thumbnail,
    "sheet": contact_sheet,
    "coverage": coverage_picture,
}


def capture_picture(collection: DatasetCollection, stored: StoredCapture, name: str, *, form: str) -> Path:
    """Return the path of a capture's thumbnail, contact sheet or coverage; `form`: jpg or png."""
    dataset = readable_dataset(stored)
    return _file(collection, stored, name, form=form, draw=lambda: _KINDS[name](dataset))


def anaglyph_picture(
    collection: DatasetCollection, stored: StoredCapture, *, index: int, bracket: int, form: str
) -> Path:
    """Return the path of one point's red and cyan picture; `index`: its number in the plan."""
    point = point_of(stored, index)
    name = f"anaglyph-{index}-{bracket}"
    return _file(collection, stored, name, form=form, draw=lambda: point_anaglyph(point, bracket=bracket))


def frame_picture(frame: Frame, *, form: str) -> bytes:
    """Return a frame as the bytes of an 8-bit picture; `form`: jpg or png."""
    image = np.ascontiguousarray(rgb(to_uint8(frame)))
    return png_bytes(image) if form == "png" else encode_jpeg(image, quality=FRAME_QUALITY)


def _file(
    collection: DatasetCollection,
    stored: StoredCapture,
    name: str,
    *,
    form: str,
    draw: Callable[[], NDArray[np.uint8]],
) -> Path:
    folder = collection.pictures(stored.id)
    path = folder / f"{name}-{len(readable_dataset(stored))}.{form}"
    if path.exists():
        return path
    picture = draw()
    content = png_bytes(picture) if form == "png" else encode_jpeg(picture, quality=SHEET_QUALITY)
    with disk_errors(f"a picture of capture {stored.name}", collection.folder):
        folder.mkdir(parents=True, exist_ok=True)
        for older in folder.glob(f"{name}-*.{form}"):
            older.unlink(missing_ok=True)
        write_file(path, memoryview(content))
    return path
