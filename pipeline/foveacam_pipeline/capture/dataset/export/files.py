"""The folder of an export: all of it, or none."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from foveacam_hardware.contract import Image, InvalidInput
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.storage.disk import disk_errors, sync_folder


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder beside `path` that gets its name when the block ends well, else goes.

    Raise InvalidInput where something is already, StorageFull or DeviceFault when the disk does.
    """
    if path.exists():
        raise InvalidInput(f"{path} exists already, nothing was overwritten; give another name")
    unfinished = path.with_name(f".{path.name}.part")
    with disk_errors("the export", path.parent):
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.mkdir(parents=True)
        try:
            yield unfinished
            unfinished.rename(path)
            sync_folder(path.parent)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)


def put_png(path: Path, image: Image) -> None:
    """Write one picture; its folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(encode(image, ImageCodec.PNG))
