"""Writes sheets with a calibration pattern as PDF: black rectangles at their true size, lines and words.

The file asks its reader to print it unscaled, which the PDF of matplotlib cannot.
"""

from collections.abc import Sequence

from foveacam_pipeline.calibrate.sheets import Sheet, SheetText

POINTS_PER_M = 72.0 / 0.0254
LINE_M = 0.0002
_CATALOG, _PAGES, _FONT = 1, 2, 3
_HEADER = b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n"


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
    """Return the file of objects that are numbered from 1; the last one is its information."""
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
