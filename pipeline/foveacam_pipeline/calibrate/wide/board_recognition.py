"""Which ChArUco board a picture shows, where it is not the one that was described."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.wide.boards import DICTIONARIES, Charuco

LEAST_MARKERS = 4
"""Fewer markers of one dictionary may be read by chance."""
EXAMINED = "250"
"""Number of markers of the dictionaries that are tried: with 1000 of each it takes four times as long."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeenMarkers:
    """Markers in a picture: the smallest dictionary that has all of them, and their ids, (n,) int64."""

    dictionary: str
    ids: NDArray[np.int64]


def seen_markers(gray: NDArray[np.uint8]) -> SeenMarkers | None:
    """Return the markers of the dictionary that a grey picture (h, w) has most of; None for fewer than 4."""
    found = {name: _ids(gray, name) for name in DICTIONARIES if name.endswith(EXAMINED)}
    largest = max(found, key=lambda name: len(found[name]))
    ids = found[largest]
    if len(ids) < LEAST_MARKERS:
        return None
    cells = largest.removesuffix(EXAMINED)
    sizes = (int(name.removeprefix(cells)) for name in DICTIONARIES if name.startswith(cells))
    return SeenMarkers(dictionary=f"{cells}{next(size for size in sizes if size > ids.max())}", ids=ids)


def alternatives(board: Charuco, seen: SeenMarkers) -> Iterator[Charuco]:
    """Yield boards of the markers seen: turned by a quarter, or drawn as OpenCV did before 4.6, or both."""
    for turned, legacy in product((False, True), (board.legacy_pattern, not board.legacy_pattern)):
        columns, rows = (board.rows, board.columns) if turned else (board.columns, board.rows)
        try:
            other = replace(
                board, columns=columns, rows=rows, dictionary=seen.dictionary, legacy_pattern=legacy
            )
        except InvalidInput:  # the dictionary has too few markers for it
            continue
        if other != board:
            yield other


def _ids(gray: NDArray[np.uint8], name: str) -> NDArray[np.int64]:
    ids = _detector(name).detectMarkers(gray)[1]
    return np.empty(0, dtype=np.int64) if ids is None else np.asarray(ids, dtype=np.int64).ravel()


@cache
def _detector(name: str) -> cv2.aruco.ArucoDetector:
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(DICTIONARIES[name]))
