"""Makes one mosaic in a process of its own, so that live views go on: `python -m` this module.

It may be killed at any time: what is on the disk by then is gone on with.
"""

import json
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_server.capturing.child_work import StdoutProgress, work
from foveacam_server.capturing.mosaic_collection import begun_as

COSTS = {"depth of the pairs": 8.0, "depth where views overlap": 7.0, "overlaps": 3.0}
"""What one fovea's step takes, in times of a tile; measured at full resolution."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MosaicSpec:
    """Which mosaic is asked for: whose picture, of which scan and exposure."""

    eye: str = Role.LEFT.value
    scan: int = 0
    bracket: int = 0


def make(dataset: Path, folder: Path, wish: MosaicSpec) -> None:
    """Make the mosaic of a dataset in `folder`, with mesh and depth tiles; go on where one was begun.

    What was begun of other frames or for another wish is thrown away.
    """
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.mosaic.build import build_mosaic, chart_of
    from foveacam_pipeline.capture.mosaic.depth_tiles import write_depth_tiles
    from foveacam_pipeline.capture.mosaic.folder import recipe_of
    from foveacam_pipeline.capture.mosaic.values import MosaicSettings
    from foveacam_pipeline.capture.mosaic.views import mosaic_calibration, mosaic_views
    from foveacam_pipeline.storage.disk import disk_errors
    from foveacam_web.glb import write_glb

    settings = MosaicSettings(eye=Role(wish.eye), scan=wish.scan, bracket=wish.bracket)
    opened = Dataset.open(dataset)
    calibration, scan = mosaic_calibration(opened), opened.scan(wish.scan)
    views = mosaic_views(scan, calibration, settings)
    chart = chart_of(views, calibration)
    if folder.exists() and begun_as(folder) != recipe_of(scan, settings, chart):
        shutil.rmtree(folder)
    made = build_mosaic(
        opened,
        folder,
        settings,
        watch=StdoutProgress(len(views), COSTS),
        mesh_file=lambda mesh: write_glb(mesh, y_up=True),
    )
    with disk_errors("the mosaic", folder.parent):
        write_depth_tiles(folder, made.placed.depth.z_m)


def main() -> int:
    """Do what the arguments say: dataset, folder, wish as JSON. Return 0, or 1 when it was told why not."""
    dataset, folder, wish = sys.argv[1:]
    return work(lambda: make(Path(dataset), Path(folder), MosaicSpec(**json.loads(wish))))


if __name__ == "__main__":
    sys.exit(main())
