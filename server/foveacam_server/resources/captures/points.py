"""The single points of a capture: their documents, cells on the contact sheet, and pictures."""

import math

import numpy as np

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.pictures import png_bytes, sheet_cells
from foveacam_pipeline.capture.dataset.reader import DatasetPoint
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_server.foundation.store import Document
from foveacam_server.resources.captures.collection import StoredCapture
from foveacam_server.rig.encoder import encode_jpeg

QUALITY = 90


def readable_dataset(stored: StoredCapture) -> Dataset:
    """Return the dataset of a capture; raise `InvalidInput` for a damaged one."""
    if stored.dataset is None:
        raise InvalidInput(f"capture {stored.name} cannot be read: {stored.trouble}")
    return stored.dataset


def brackets_of(dataset: Dataset | None) -> list[int]:
    """Return the numbers of the exposures that any camera has frames of."""
    return sorted({frame.bracket for point in dataset or () for frame in point.frames})


def point_of(stored: StoredCapture, index: int) -> DatasetPoint:
    """Return a point by its number in the plan; raise `InvalidInput` when it was not captured."""
    dataset = readable_dataset(stored)
    point = next((point for point in dataset if point.index == index), None)
    if point is None:
        raise InvalidInput(
            f"capture {stored.name}: point {index} was asked for, it has {len(dataset)} points of"
            f" {dataset.document.header.points}; ask for one that was taken"
        )
    return point


def points_document(dataset: Dataset) -> Document:
    """Return the captured points in order, and the skipped ones with the reason, as a document."""
    points = list(dataset)
    cells = sheet_cells(points)
    return {
        "rows": max((row + 1 for row, _ in cells), default=0),
        "columns": max((column + 1 for _, column in cells), default=0),
        "points": [_point(point, cell) for point, cell in zip(points, cells, strict=True)],
        "skipped": [{"index": index, "why": why} for index, why in dataset.skipped.items()],
    }


def point_picture(point: DatasetPoint, role: Role, *, bracket: int, form: str) -> bytes:
    """Return one camera's 8-bit picture of a point, a stack's mean, as a file's bytes; `form`: jpg or png."""
    image = np.ascontiguousarray(rgb(to_uint8(point.stacked(role, bracket=bracket))))
    return png_bytes(image) if form == "png" else encode_jpeg(image, quality=QUALITY)


def _point(point: DatasetPoint, cell: tuple[int, int]) -> Document:
    place = point.place
    aim_deg = (None, None) if place.aim_rad is None else tuple(map(math.degrees, place.aim_rad))
    return {
        "index": point.index,
        "scan": place.scan,
        "sheet_row": cell[0],
        "sheet_column": cell[1],
        "aim_ax_deg": aim_deg[0],
        "aim_ay_deg": aim_deg[1],
        "distance_m": place.distance_m,
        "rail_mm": None if place.rail_m is None else 1e3 * place.rail_m,
        "cameras": sorted({frame.role.value for frame in point.frames}),
        "brackets": len(point.brackets),
    }
