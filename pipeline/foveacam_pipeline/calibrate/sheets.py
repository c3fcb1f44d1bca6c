"""Layout of a calibration pattern on sheets of paper at its true size, and their PDF.

A pattern larger than the paper is divided among several sheets, with crop marks where they are cut and
joined. Each sheet has a ruler of 100 mm to check the print, and a line of text that describes it. The PDF
requests unscaled printing, which matplotlib's PDF cannot.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.pattern import Pattern, Rows

PAPERS_M = {"A4": (0.210, 0.297), "A3": (0.297, 0.420), "Letter": (0.2159, 0.2794)}
"""Width and height of each paper size, in portrait orientation."""
LARGEST_PAPER = "A3"
MOST_SHEETS = 9
RULER_M = 0.100
FOOT_M = 0.015
"""Height of a sheet's footer, which holds the ruler and the line of text."""
BLEED_M = 0.003
"""Bleed: how far the pattern is printed beyond a cut, so that an inexact cut leaves no gap."""
MARK_M = (0.004, 0.008)
"""Start and end of a crop mark, as distances from the edge of the sheet's part of the pattern."""
TEXT_M = 0.0028
"""Font size."""
LETTER_WIDTH = 0.55
"""Mean width of a letter of Helvetica as a share of the font size, estimated generously."""
TOLERANCE_M = 1e-6
POINTS_PER_M = 72.0 / 0.0254
LINE_M = 0.0002
_CATALOG, _PAGES, _FONT = 1, 2, 3
_HEADER = b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n"


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetText:
    """One line of text: the start of its baseline and its font size, metres."""

    x_m: float
    y_m: float
    size_m: float
    words: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sheet:
    """One page.

    `black_m`: (n, 4) float64, left, top, right and bottom of each rectangle. `lines_m`: (k, 4) float64, both
    ends of each line of ruler and crop marks. All metres from the page's upper left corner, +y down.
    """

    width_m: float
    height_m: float
    black_m: Rows
    lines_m: Rows
    texts: tuple[SheetText, ...]

    @property
    def landscape(self) -> bool:
        """Whether the page is wider than high."""
        return self.width_m > self.height_m


@dataclass(frozen=True, slots=True, kw_only=True)
class _Page:
    """A page of one orientation, and where a pattern is cut for it: both ends and the cuts between them."""

    size_m: tuple[float, float]
    margin_m: float
    across_m: list[float]
    down_m: list[float]

    @property
    def rows(self) -> int:
        return len(self.down_m) - 1

    @property
    def columns(self) -> int:
        return len(self.across_m) - 1

    @property
    def sheets(self) -> int:
        return self.columns * self.rows


def lay_out(pattern: Pattern, *, paper: str, margin_m: float, words: str) -> list[Sheet]:
    """Return the sheets of a pattern, row by row, in the orientation that needs fewer of them.

    `margin_m`: white on all sides of the paper. The pattern's white edge is left out: the paper is white.
    """
    if paper not in PAPERS_M:
        raise InvalidInput(f"paper {paper!r} is not known; use one of {', '.join(PAPERS_M)}")
    page = _page(pattern, paper=paper, margin_m=margin_m)
    parts = [
        (row, column, np.array([left, top, right, bottom]))
        for row, (top, bottom) in enumerate(pairwise(page.down_m), start=1)
        for column, (left, right) in enumerate(pairwise(page.across_m), start=1)
    ]
    if page.sheets == 1:
        return [_sheet(pattern, page, part_m=parts[0][2], words=words)]
    return [
        _sheet(
            pattern,
            page,
            part_m=part_m,
            words=f"{words}; sheet {number} of {page.sheets}, row {row}, column {column}",
        )
        for number, (row, column, part_m) in enumerate(parts, start=1)
    ]


def _page(pattern: Pattern, *, paper: str, margin_m: float) -> _Page:
    """Return the page of a paper; raise `InvalidInput` when the pattern needs too many sheets."""
    page = _turned_page(pattern, paper=paper, margin_m=margin_m)
    if page.sheets <= MOST_SHEETS:
        return page
    width_mm, height_mm = (1e3 * (ends_m[-1] - ends_m[0]) for ends_m in (page.across_m, page.down_m))
    on_largest = _turned_page(pattern, paper=LARGEST_PAPER, margin_m=margin_m)
    larger = f"{LARGEST_PAPER}, or " if on_largest.sheets <= MOST_SHEETS else ""
    raise InvalidInput(
        f"the pattern of {width_mm:g} x {height_mm:g} mm needs {page.sheets} sheets of {paper}, at most "
        f"{MOST_SHEETS} are printed; choose {larger}smaller squares or markers, or fewer squares"
    )


def _turned_page(pattern: Pattern, *, paper: str, margin_m: float) -> _Page:
    """Return the page in the orientation that needs fewer sheets; the pattern's own if both need as many."""
    left, top = pattern.black_m[:, :2].min(axis=0).tolist()
    right, bottom = pattern.black_m[:, 2:].max(axis=0).tolist()
    upright = PAPERS_M[paper]
    turned = upright[1], upright[0]
    either = (turned, upright) if right - left > bottom - top else (upright, turned)
    ends_m = (left, right), (top, bottom)
    pages = [_divided(pattern, ends_m, page_m=page_m, margin_m=margin_m) for page_m in either]
    return min(pages, key=lambda page: page.sheets)


def _divided(
    pattern: Pattern,
    ends_m: tuple[tuple[float, float], tuple[float, float]],
    *,
    page_m: tuple[float, float],
    margin_m: float,
) -> _Page:
    """Return a page of one orientation with the cuts that the pattern needs; crop marks need room too."""
    room_x_m, room_y_m = page_m[0] - 2.0 * margin_m, page_m[1] - 2.0 * margin_m - FOOT_M
    across_m, down_m = (list(ends) for ends in ends_m)
    if across_m[1] - across_m[0] > room_x_m + TOLERANCE_M or down_m[1] - down_m[0] > room_y_m + TOLERANCE_M:
        marks_m = 2.0 * MARK_M[1]
        across_m = _cuts(ends_m[0], room_m=room_x_m - marks_m, seams_m=pattern.seams_x_m)
        down_m = _cuts(ends_m[1], room_m=room_y_m - marks_m, seams_m=pattern.seams_y_m)
    return _Page(size_m=page_m, margin_m=margin_m, across_m=across_m, down_m=down_m)


def _cuts(ends_m: tuple[float, float], *, room_m: float, seams_m: NDArray[np.float64]) -> list[float]:
    """Return both ends and the cuts between parts that fit into the room, at seams where one is in reach."""
    start_m, end_m = ends_m
    cuts = [start_m]
    while end_m - cuts[-1] > room_m + TOLERANCE_M:
        farthest_m = cuts[-1] + room_m
        seams = seams_m[(seams_m > cuts[-1] + TOLERANCE_M) & (seams_m <= farthest_m)]
        cuts.append(float(seams.max()) if seams.size else farthest_m)
    return [*cuts, end_m]


def _sheet(pattern: Pattern, page: _Page, *, part_m: NDArray[np.float64], words: str) -> Sheet:
    """Return the sheet of one part of a pattern, in the middle of its page. `part_m`: (4,)."""
    width_m, height_m = page.size_m
    x_m = 0.5 * (width_m - (part_m[2] - part_m[0]))
    y_m = 0.5 * (height_m - FOOT_M - (part_m[3] - part_m[1]))
    to_page = np.array([x_m, y_m, x_m, y_m]) - part_m[[0, 1, 0, 1]]
    shown_m = part_m + BLEED_M * np.array([-1.0, -1.0, 1.0, 1.0])
    corners = np.clip(pattern.black_m, shown_m[[0, 1, 0, 1]], shown_m[[2, 3, 2, 3]])
    black_m = corners[(corners[:, 2] > corners[:, 0]) & (corners[:, 3] > corners[:, 1])]
    marks_m = _crop_marks(part_m + to_page) if page.sheets > 1 else np.empty((0, 4))
    foot_m = height_m - page.margin_m
    return Sheet(
        width_m=width_m,
        height_m=height_m,
        black_m=black_m + to_page,
        lines_m=np.vstack([marks_m, _ruler(page.margin_m, foot_m - 0.006)]),
        texts=_texts(words, x_m=page.margin_m, foot_m=foot_m, width_m=width_m - 2.0 * page.margin_m),
    )


def _crop_marks(part_m: NDArray[np.float64]) -> Rows:
    """Return the lines that continue the four edges of a sheet's part beyond its corners."""
    left, top, right, bottom = part_m.tolist()
    near, far = MARK_M
    upright = [
        (x, y + side * near, x, y + side * far)
        for x in (left, right)
        for y, side in ((top, -1.0), (bottom, 1.0))
    ]
    level = [
        (x + side * near, y, x + side * far, y)
        for y in (top, bottom)
        for x, side in ((left, -1.0), (right, 1.0))
    ]
    return np.array([*upright, *level])


def _ruler(x_m: float, y_m: float) -> Rows:
    """Return a ruler with a line every 10 mm, longer ones at its ends and in its middle."""
    ticks = [
        (x_m + RULER_M * tick / 10, y_m, x_m + RULER_M * tick / 10, y_m - (0.003 if tick % 5 else 0.005))
        for tick in range(11)
    ]
    return np.array([(x_m, y_m, x_m + RULER_M, y_m), *ticks])


def _texts(words: str, *, x_m: float, foot_m: float, width_m: float) -> tuple[SheetText, ...]:
    """Return the ruler's label and the sheet's description, in letters as large as its width allows."""
    beside = "measures 100 mm"
    size_m = min(TEXT_M, width_m / (LETTER_WIDTH * len(words)))
    return (
        SheetText(x_m=x_m + RULER_M + 0.002, y_m=foot_m - 0.006, size_m=TEXT_M, words=beside),
        SheetText(x_m=x_m, y_m=foot_m - 0.001, size_m=size_m, words=words),
    )


def sheets_words(sheets: Sequence[Sheet], *, paper: str) -> str:
    """Return the number of sheets in words, such as `2 sheets of A4, landscape`."""
    number = "1 sheet" if len(sheets) == 1 else f"{len(sheets)} sheets"
    return f"{number} of {paper}, {'landscape' if sheets[0].landscape else 'portrait'}"


def pattern_pdf(sheets: Sequence[Sheet], *, title: str) -> bytes:
    """Return the sheets as PDF, one page each; equal sheets give equal bytes."""
    first = _FONT + 1
    pages = range(first, first + 2 * len(sheets), 2)
    kids = " ".join(f"{page} 0 R" for page in pages)
    objects = [
        f"<< /Type /Catalog /Pages {_PAGES} 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(sheets)} >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
    ]
    for page, sheet in zip(pages, sheets, strict=True):
        drawing = _drawing(sheet)
        box = f"[0 0 {_points(sheet.width_m)} {_points(sheet.height_m)}]"
        objects.append(
            f"<< /Type /Page /Parent {_PAGES} 0 R /MediaBox {box} /Contents {page + 1} 0 R "
            f"/Resources << /Font << /F1 {_FONT} 0 R >> >> >>"
        )
        objects.append(f"<< /Length {len(drawing.encode('cp1252'))} >>\nstream\n{drawing}\nendstream")
    return _file([*objects, f"<< /Title ({_escaped(title)}) >>"])


def _drawing(sheet: Sheet) -> str:
    """Return the page's operators; all rectangles are one path, so that no seam shows between them."""
    height_m = sheet.height_m
    rectangles = [
        f"{_points(left)} {_points(height_m - bottom)} {_points(right - left)} {_points(bottom - top)} re"
        for left, top, right, bottom in sheet.black_m.tolist()
    ]
    lines = [
        f"{_points(x)} {_points(height_m - y)} m {_points(to_x)} {_points(height_m - to_y)} l"
        for x, y, to_x, to_y in sheet.lines_m.tolist()
    ]
    texts = [_text(text, height_m=height_m) for text in sheet.texts]
    return "\n".join(["0 g", *rectangles, "f", f"{_points(LINE_M)} w", *lines, "S", *texts])


def _text(text: SheetText, *, height_m: float) -> str:
    place = f"{_points(text.x_m)} {_points(height_m - text.y_m)}"
    return f"BT /F1 {_points(text.size_m)} Tf {place} Td ({_escaped(text.words)}) Tj ET"


def _file(objects: Sequence[str]) -> bytes:
    """Return the PDF file of objects numbered from 1; the last one is the document information."""
    content, offsets = bytearray(_HEADER), []
    for number, body in enumerate(objects, start=1):
        offsets.append(len(content))
        content += f"{number} 0 obj\n{body}\nendobj\n".encode("cp1252")
    table = "".join(f"{offset:010d} 00000 n \n" for offset in offsets)
    size, start = len(objects) + 1, len(content)
    trailer = f"trailer\n<< /Size {size} /Root {_CATALOG} 0 R /Info {len(objects)} 0 R >>\n"
    content += f"xref\n0 {size}\n0000000000 65535 f \n{table}{trailer}startxref\n{start}\n%%EOF\n".encode()
    return bytes(content)


def _escaped(words: str) -> str:
    return words.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")


def _points(value_m: float) -> str:
    """Return a length in points, to 0.04 micrometres."""
    return f"{POINTS_PER_M * value_m:.4f}"
