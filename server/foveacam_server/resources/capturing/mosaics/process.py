"""Make one mosaic in a child process, so that live views continue: `python -m` this module.

It may be killed at any time; the next run continues from what is on the disk.
"""

import shutil
import sys
from dataclasses import replace
from pathlib import Path

from foveacam_server.foundation.child_work import StdoutProgress, run_child
from foveacam_server.resources.capturing.mosaics.collection import recipe_in
from foveacam_server.resources.capturing.mosaics.schema import MosaicRequest

COSTS = {"depth of the pairs": 8.0, "depth where views overlap": 7.0, "overlaps": 3.0}
"""Duration of one fovea's step relative to a tile's, for the progress; measured at full resolution."""


def make(dataset: Path, folder: Path, request: MosaicRequest, *, card: Path | None) -> None:
    """Make the mosaic of a dataset in `folder`, with mesh and depth tiles, or continue an unfinished one.

    `card`: of the network that computes the depth of the pairs, if any. An unfinished mosaic of other frames,
    another request or another network is deleted.
    """
    from foveacam_pipeline.capture.dataset import Dataset
    from foveacam_pipeline.capture.mosaic.build import build_mosaic, chart_of
    from foveacam_pipeline.capture.mosaic.depth_tiles import write_depth_tiles
    from foveacam_pipeline.capture.mosaic.folder import recipe_of
    from foveacam_pipeline.capture.mosaic.views import mosaic_calibration, mosaic_views
    from foveacam_pipeline.networks.card import load_network
    from foveacam_pipeline.storage.disk import disk_errors
    from foveacam_web.glb import write_glb

    network = None if card is None else load_network(card)
    settings, opened = replace(request.settings(), network=network), Dataset.open(dataset)
    calibration, scan = mosaic_calibration(opened), opened.scan(request.scan)
    views = mosaic_views(scan, calibration, settings)
    chart = chart_of(views, calibration)
    if folder.exists() and recipe_in(folder) != recipe_of(scan, settings, chart):
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
    """Run with the arguments dataset, folder, request as JSON, and the path of a network's card or nothing.

    Return the exit status as `run_child`.
    """
    dataset, folder, request, card = sys.argv[1:]
    return run_child(
        lambda: make(
            Path(dataset),
            Path(folder),
            MosaicRequest.model_validate_json(request),
            card=Path(card) if card else None,
        )
    )


if __name__ == "__main__":
    sys.exit(main())
