"""Pictures of stills: 8-bit previews, drawn once and kept; and files of full depth."""

from pathlib import Path

import numpy as np

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.capture.dataset import DatasetPoint, ImageCodec
from foveacam_pipeline.capture.dataset.images import encode
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_server.capturing.points import point_of
from foveacam_server.capturing.still_collection import StillCollection, StoredStill
from foveacam_server.runtime.encoder import encode_jpeg

QUALITY = 90
PREVIEW = "jpg"


def still_picture(
    shelf: StillCollection, found: StoredStill, camera: Role, *, form: str, frame: int | None
) -> Path:
    """Return the file of what one camera saw: `jpg` with 8 bits, `png` or `tiff` with all of them.

    `frame`: one of the stack, from 0, where all were kept; None is the mean, or the only one.
    """
    point = point_of(found.kept, 0)
    whole = _as_kept(point, camera, form=form, frame=frame)
    if whole is not None:
        return found.kept.folder / whole
    name = f"{camera.value}-mean.{form}" if frame is None else f"{camera.value}-{frame}.{form}"
    path = shelf.pictures(found.kept.id) / name
    if path.exists():
        return path
    taken = point.stacked(camera) if frame is None else point.frame(camera, stack=frame)
    content = _encoded(taken, form)
    with disk_errors(f"a picture of still {found.kept.name}", shelf.folder):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content)
    return path


def _as_kept(point: DatasetPoint, camera: Role, *, form: str, frame: int | None) -> str | None:
    """Return the file of the still itself that holds just this; None where there is none."""
    files = [kept for kept in point.frames if kept.role is camera]
    wanted = [kept for kept in files if kept.stack == frame] if frame is not None else files
    if form == PREVIEW or len(wanted) != 1:
        return None
    return wanted[0].file if wanted[0].file.endswith(f".{form}") else None


def _encoded(frame: Frame, form: str) -> memoryview:
    if form != PREVIEW:
        return encode(frame.image, ImageCodec(form))
    return memoryview(encode_jpeg(np.ascontiguousarray(rgb(to_uint8(frame))), quality=QUALITY))
