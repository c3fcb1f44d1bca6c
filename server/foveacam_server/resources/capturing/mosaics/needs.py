"""Checks whether a mosaic of a dataset is possible, and whether the disk has space for its estimated size."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from foveacam_hardware.contract import InvalidInput, NotCalibrated
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT, free_bytes, free_space_error
from foveacam_server.resources.capturing.mosaics.schema import MosaicNeedsDocument, MosaicRequest

if TYPE_CHECKING:
    from foveacam_pipeline.capture.mosaic.views import MosaicView

BYTES_PER_PX = 0.5
"""Bytes per pixel of a grey picture, all levels: JPEG at quality 90 takes 0.17 in `bench`, 0.44 for noise."""
BYTES_PER_CELL = 40.0
"""Bytes per cell of depth, its error, their pictures and the mesh."""
BYTES_PER_FOVEA_CELL = 12 * 3
"""Bytes per cell of a pair's results, stored until the end: three numbers; 14 bytes over 16 foveae of
`bench`."""
FIXED_BYTES = 20_000_000
"""Size of cloud and overview, for a mosaic of any size."""


def needs_of(dataset: Dataset, request: MosaicRequest, folder: Path) -> MosaicNeedsDocument:
    """Return a mosaic's needs in `folder`; raise `InvalidInput` or `NotCalibrated` if it is impossible."""
    # these import scipy, so they are loaded on demand
    from foveacam_pipeline.capture.mosaic.build import chart_of
    from foveacam_pipeline.capture.mosaic.chart import CELL
    from foveacam_pipeline.capture.mosaic.views import mosaic_views

    name = dataset.folder.name
    if dataset.calibration is None:
        raise NotCalibrated(
            f"dataset {name} has no calibration: its views cannot be laid side by side",
            asked=f"the mosaic of dataset {name}",
            found="it has no calibration",
            remedy="capture it again with a calibration in use",
        )
    settings = request.settings()
    views = mosaic_views(_scan(dataset, request.scan), dataset.calibration, settings)
    _check_overlap(views, name)
    chart = chart_of(views, dataset.calibration)
    pixels, cells = chart.width * chart.height, chart.rows * chart.columns
    fovea_cells = dataset.calibration.fovea_width * dataset.calibration.fovea_height / CELL**2
    channels = views[0].point.frame(settings.eye, bracket=settings.bracket).image.ndim
    needed = (
        BYTES_PER_PX * pixels * (1 if channels == 2 else 2)
        + BYTES_PER_CELL * cells
        + BYTES_PER_FOVEA_CELL * fovea_cells * len(views)
        + FIXED_BYTES
    )
    return MosaicNeedsDocument(
        views=len(views),
        width=chart.width,
        height=chart.height,
        needed_bytes=round(needed),
        free_bytes=free_bytes(folder),
    )


def check_room(needs: MosaicNeedsDocument) -> None:
    """Raise `OutOfRange`, or `StorageFull` for a full disk, with both sizes when the mosaic does not fit."""
    wanted_bytes = needs.needed_bytes + RESERVE_BYTES
    if wanted_bytes > needs.free_bytes:
        raise free_space_error(
            f"a mosaic of {needs.width} x {needs.height} px needs about {wanted_bytes / 1e6:.0f} MB while it "
            f"is made, with the {RESERVE_TEXT}; {needs.free_bytes / 1e6:.0f} MB are free on the disk",
            needed_bytes=wanted_bytes,
            free_bytes=needs.free_bytes,
            remedy="free some space",
        )


def _scan(dataset: Dataset, number: int) -> Dataset:
    if len(dataset) == 0:
        raise InvalidInput(f"dataset {dataset.folder.name} has no point yet; capture it first")
    return dataset.scan(number)


def _check_overlap(views: Sequence["MosaicView"], name: str) -> None:
    if len(views) == 1:
        raise InvalidInput(
            f"dataset {name} has a single point with this eye's frame: there is nothing to lay beside it",
            asked=f"the mosaic of dataset {name}",
            found="a single point",
            remedy="capture a raster of two points or more",
        )
    if not any(_overlap(a, b) for k, a in enumerate(views) for b in views[:k]):
        raise InvalidInput(
            f"no two of the {len(views)} views of dataset {name} overlap: their relative position is unknown",
            asked=f"the mosaic of dataset {name}",
            found=f"{len(views)} views, no two of which overlap",
            remedy="capture a raster with more points or a smaller field",
        )


def _overlap(a: "MosaicView", b: "MosaicView") -> bool:
    """Return whether two views overlap; boxes are left, top, right, bottom."""
    return a.box[0] < b.box[2] and b.box[0] < a.box[2] and a.box[1] < b.box[3] and b.box[1] < a.box[3]
