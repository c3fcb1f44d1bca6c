"""The single points of a capture: their documents, cells on the contact sheet, and pictures."""

import math

import numpy as np

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.pictures import png_bytes, sheet_cells
from foveacam_pipeline.capture.dataset.reader import DatasetPoint
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_server.foundation.store import Document
from foveacam_server.rig.encoder import encode_jpeg

QUALITY = 90


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
