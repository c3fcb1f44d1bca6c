"""The options of an export, and the new folder that it is written into."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Image, InvalidInput
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.stereo.rectify import SCALES
from foveacam_pipeline.storage.disk import disk_errors, sync_folder


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportChoice:
    """Options of an export. `scale`: of warped images; `seeds_per_pair`: 3D points added per pair.

    `on_point(index)` is called after each exported point.
    """

    scale: float = 1.0
    seeds_per_pair: int = 100
    on_point: Callable[[int], None] | None = None

    def __post_init__(self) -> None:
        if self.scale not in SCALES:
            raise InvalidInput(f"export at scale {self.scale!r}: 0.5 or 1.0 is needed")
        if self.seeds_per_pair < 0:
            raise InvalidInput(f"{self.seeds_per_pair} points a pair: 0 or more are needed")

    def report_point(self, index: int) -> None:
        """Call `on_point`, if there is one, for an exported point."""
        if self.on_point is not None:
            self.on_point(index)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder beside `path`: renamed to `path` when the block succeeds, else removed.

    Raise InvalidInput where `path` exists, StorageFull or DeviceFault on a disk error.
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


def write_png(path: Path, image: Image) -> None:
    """Write one image as PNG; its folder is created."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(encode(image, ImageCodec.PNG))
