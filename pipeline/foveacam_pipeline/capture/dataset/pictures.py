"""Overview pictures of a dataset: contact sheet, coverage of the wide view, anaglyph.

All are (h, w, 3) uint8 RGB; `png_bytes` encodes one as a file.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.models.footprint import fovea_footprint_px
from foveacam_pipeline.stereo import pictures
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.rectify import to_uint8

Picture = NDArray[np.uint8]
BACKGROUND = (17, 20, 26)
GAP_PX = 2
EYE_COLOURS = {Role.LEFT: (255, 92, 92), Role.RIGHT: (64, 200, 255)}
"""Colours of the footprints: left red, right cyan, as in an anaglyph."""
SMALLEST_PX, LARGEST_PX = 16, 4096


def contact_sheet(dataset: Dataset, *, role: Role = Role.LEFT, tile_px: int = 120) -> Picture:
    """Return the frames of one camera, `tile_px` wide each, in the order of the grid, scan below scan."""
    points = list(dataset)
    _check_size("a tile", tile_px)
    if not points:
        return np.full((tile_px, tile_px, 3), BACKGROUND, dtype=np.uint8)
    tiles = [_tile(point, role, tile_px) for point in points]
    cells = sheet_cells(points)
    height = max(tile.shape[0] for tile in tiles)
    rows, columns = (max(cell[axis] for cell in cells) + 1 for axis in (0, 1))
    size = rows * (height + GAP_PX) - GAP_PX, columns * (tile_px + GAP_PX) - GAP_PX
    if max(size) > 4 * LARGEST_PX:
        raise InvalidInput(f"a sheet of {size[1]} x {size[0]} px is too large; ask for smaller tiles")
    sheet: Picture = np.full((*size, 3), BACKGROUND, dtype=np.uint8)
    for tile, (row, column) in zip(tiles, cells, strict=True):
        y, x = row * (height + GAP_PX), column * (tile_px + GAP_PX)
        sheet[y : y + tile.shape[0], x : x + tile_px] = tile
    return sheet


def coverage_picture(dataset: Dataset, *, width_px: int = 720) -> Picture:
    """Return the wide view nearest the middle point with all fovea outlines, left red, right cyan."""
    _check_size("a picture", width_px)
    if len(dataset) == 0:
        return np.full((width_px * 3 // 4, width_px, 3), BACKGROUND, dtype=np.uint8)
    middle = len(dataset) // 2
    seen = [number for number, point in enumerate(dataset) if _has(point, Role.WIDE)]
    nearest = min(seen, key=lambda number: abs(number - middle), default=middle)
    role = Role.WIDE if seen else Role.LEFT
    picture = _tile(dataset[nearest], role, width_px)
    if role is Role.WIDE and dataset.calibration is not None:
        _draw_footprints(picture, dataset, scale=width_px / dataset.calibration.wide.width)
    return picture


def thumbnail(dataset: Dataset, *, width_px: int = 320) -> Picture:
    """Return a small coverage picture."""
    return coverage_picture(dataset, width_px=width_px)


def point_anaglyph(point: DatasetPoint, *, bracket: int = 0) -> Picture:
    """Return both foveae of a point, rectified at half size: left in red, right in green and blue."""
    return pictures.anaglyph(point.rectified(scale=0.5, bracket=bracket))


def png_bytes(picture: Picture) -> bytes:
    """Return a picture as the content of a PNG file."""
    return bytes(encode(picture, ImageCodec.PNG))


def _draw_footprints(picture: Picture, dataset: Dataset, *, scale: float) -> None:
    calibration = dataset.calibration
    for point in dataset:
        volts = point.pose.volts
        if calibration is None or volts is None:
            continue
        distance_m = point.place.distance_m or math.inf
        for role, colour in EYE_COLOURS.items():
            drive = volts.left if role is Role.LEFT else volts.right
            corners = fovea_footprint_px(calibration, role, drive, distance_m)
            places = np.rint((corners + 0.5) * scale * 16).astype(np.int32)
            cv2.polylines(picture, [places], True, colour, 1, cv2.LINE_AA, shift=4)


def _tile(point: DatasetPoint, role: Role, width_px: int) -> Picture:
    if not _has(point, role):
        return np.full((width_px * 3 // 4, width_px, 3), BACKGROUND, dtype=np.uint8)
    image = to_uint8(point.frame(role))
    height = max(1, round(image.shape[0] * width_px / image.shape[1]))
    small = cv2.resize(image, (width_px, height), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(rgb(np.asarray(small, dtype=np.uint8)))


def sheet_cells(points: list[DatasetPoint]) -> list[tuple[int, int]]:
    """Return (row, column) of every point on a sheet: its grid cell if all points have one, else in order."""
    scans = sorted({point.place.scan for point in points})
    grid = [(p.place.row, p.place.column, p.place.scan) for p in points]
    if len({place for place in grid if None not in place}) == len(points):
        rows = 1 + max(row for row, _, _ in grid if row is not None)
        return [((r or 0) + rows * scans.index(scan), c or 0) for r, c, scan in grid]
    across = math.ceil(math.sqrt(len(points)))
    return [divmod(number, across) for number in range(len(points))]


def _has(point: DatasetPoint, role: Role) -> bool:
    return any(frame.role is role and frame.bracket == 0 and frame.stack == 0 for frame in point.frames)


def _check_size(what: str, size_px: int) -> None:
    if not SMALLEST_PX <= size_px <= LARGEST_PX:
        raise InvalidInput(f"{what} {size_px} px wide: {SMALLEST_PX} to {LARGEST_PX} px are made")
