"""Pictures of stills, drawn on request and cached on the disk."""

from pathlib import Path

from foveacam_hardware.contract import Frame, Role
from foveacam_pipeline.capture.dataset import DatasetPoint, ImageCodec
from foveacam_pipeline.capture.dataset.images import encode
from foveacam_pipeline.storage.archive import read_stored
from foveacam_pipeline.storage.disk import disk_errors, write_file
from foveacam_server.datasets.collection import point_of
from foveacam_server.datasets.drawings import frame_picture
from foveacam_server.resources.stills.collection import StillCollection, StoredStill

PREVIEW = "jpg"


def still_picture(
    collection: StillCollection, found: StoredStill, camera: Role, *, form: str, frame: int | None
) -> Path:
    """Return the path of one camera's picture: `jpg` with 8 bits, `png` or `tiff` with full depth.

    `frame`: one of the stack, from 0, if all were stored; None: the mean, or the only one.
    """
    point = point_of(found.stored, 0)
    whole = _stored_file(point, camera, form=form, frame=frame)
    if whole is not None and (found.stored.folder / whole).exists():
        return found.stored.folder / whole
    name = f"{camera.value}-mean.{form}" if frame is None else f"{camera.value}-{frame}.{form}"
    path = collection.pictures(found.stored.id) / name
    if path.exists():
        return path
    if whole is not None:  # it is in the archive alone
        content = memoryview(read_stored(found.stored.folder, whole))
    else:
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
    return memoryview(frame_picture(frame, form=PREVIEW))
