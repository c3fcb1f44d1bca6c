"""Reads the pages of a PDF with a pattern back, and draws them as a printer of 300 dpi does."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MM_PER_POINT = 25.4 / 72.0
PX_PER_MM = 300.0 / 25.4
_NUMBER = rb"(-?\d+\.\d+)"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PrintedPage:
    """One page in millimetres from its upper left corner: rectangles (n, 4), lines (k, 4) and words."""

    width_mm: float
    height_mm: float
    black_mm: NDArray[np.float64]
    lines_mm: NDArray[np.float64]
    words: list[str]

    def image(self) -> NDArray[np.uint8]:
        """Return the printed page, (h, w), its words and lines left out."""
        size = round(self.height_mm * PX_PER_MM), round(self.width_mm * PX_PER_MM)
        image = np.full(size, 255, dtype=np.uint8)
        for left, top, right, bottom in np.rint(self.black_mm * PX_PER_MM).astype(int).tolist():
            image[top:bottom, left:right] = 0
        return image


def printed_pages(content: bytes) -> list[PrintedPage]:
    """Return the pages of a PDF whose streams are not compressed."""
    boxes = re.findall(rb"/MediaBox \[0 0 " + _NUMBER + b" " + _NUMBER + rb"\]", content)
    streams = re.findall(rb"stream\n(.*?)\nendstream", content, re.DOTALL)
    return [_page(box, stream) for box, stream in zip(boxes, streams, strict=True)]


def _page(box: tuple[bytes, bytes], stream: bytes) -> PrintedPage:
    width, height = (float(side) * MM_PER_POINT for side in box)
    x, y, wide, high = _rows(rb" ".join([_NUMBER] * 4) + b" re", stream).T
    black = np.column_stack([x, height - y - high, x + wide, height - y])
    lines = _rows(_NUMBER + b" " + _NUMBER + b" m " + _NUMBER + b" " + _NUMBER + b" l", stream)
    lines[:, [1, 3]] = height - lines[:, [1, 3]]
    words = [re.sub(rb"\\(.)", rb"\1", found).decode() for found in re.findall(rb"\((.*)\) Tj", stream)]
    return PrintedPage(width_mm=width, height_mm=height, black_mm=black, lines_mm=lines, words=words)


def _rows(pattern: bytes, stream: bytes) -> NDArray[np.float64]:
    return np.array(re.findall(pattern, stream), dtype=np.float64) * MM_PER_POINT
