"""Pictures of captures and stills, drawn on request and cached on the disk until the capture grows."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.capture.dataset import Dataset, DatasetPoint, ImageCodec
from foveacam_pipeline.capture.dataset.images import encode
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
from foveacam_server.resources.captures.collection import CaptureCollection, StoredCapture
from foveacam_server.resources.captures.points import point_of, readable_dataset
from foveacam_server.resources.stills.collection import StillCollection, StoredStill
from foveacam_server.rig.encoder import encode_jpeg

SHEET_QUALITY = 85
_KINDS: dict[str, Callable[[Dataset], NDArray[np.uint8]]] = {
    "thumbnail": thumbnail,
    "sheet": contact_sheet,
    "coverage": coverage_picture,
}


def capture_picture(collection: CaptureCollection, stored: StoredCapture, name: str, *, form: str) -> Path:
    """Return the path of a capture's thumbnail, contact sheet or coverage; `form`: jpg or png."""
    dataset = readable_dataset(stored)
    return _file(collection, stored, name, form=form, draw=lambda: _KINDS[name](dataset))


def anaglyph_picture(
    collection: CaptureCollection, stored: StoredCapture, *, index: int, bracket: int, form: str
) -> Path:
    """Return the path of one point's red and cyan picture; `index`: its number in the plan."""
    point = point_of(stored, index)
    name = f"anaglyph-{index}-{bracket}"
    return _file(collection, stored, name, form=form, draw=lambda: point_anaglyph(point, bracket=bracket))


def _file(
    collection: CaptureCollection,
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


PREVIEW_QUALITY = 90
PREVIEW = "jpg"


def still_picture(
    collection: StillCollection, found: StoredStill, camera: Role, *, form: str, frame: int | None
) -> Path:
    """Return the path of one camera's picture: `jpg` with 8 bits, `png` or `tiff` with full depth.

    `frame`: one of the stack, from 0, if all were stored; None: the mean, or the only one.
    """
    point = point_of(found.stored, 0)
    whole = _stored_file(point, camera, form=form, frame=frame)
    if whole is not None:
        return found.stored.folder / whole
    name = f"{camera.value}-mean.{form}" if frame is None else f"{camera.value}-{frame}.{form}"
    path = collection.pictures(found.stored.id) / name
    if path.exists():
        return path
    taken = point.stacked(camera) if frame is None else point.frame(camera, stack=frame)
    content = _encoded(taken, form)
    with disk_errors(f"a picture of still {found.stored.name}", collection.folder):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content)
    return path


def _stored_file(point: DatasetPoint, camera: Role, *, form: str, frame: int | None) -> str | None:
    """Return the still's own file that is this picture; None without one."""
    files = [stored for stored in point.frames if stored.role is camera]
    wanted = [stored for stored in files if stored.stack == frame] if frame is not None else files
    if form == PREVIEW or len(wanted) != 1:
        return None
    return wanted[0].file if wanted[0].file.endswith(f".{form}") else None


def _encoded(frame: Frame, form: str) -> memoryview:
    if form != PREVIEW:
        return encode(frame.image, ImageCodec(form))
    return memoryview(encode_jpeg(np.ascontiguousarray(rgb(to_uint8(frame))), quality=PREVIEW_QUALITY))
