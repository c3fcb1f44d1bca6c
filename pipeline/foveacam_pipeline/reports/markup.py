"""HTML elements of a report: tables, figures, and notes on missing parts. All text is escaped here."""

import base64
import re
import struct
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from html import escape

from foveacam_hardware.contract import InvalidInput

_NUMBER = re.compile(r"[+\-−±<≤]?\d(?!\d{3}-)|–$")
_PNG_SIZE, _BROAD = slice(16, 24), 1.5
_KINDS = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}


def section(anchor: str, title: str, *parts: str) -> str:
    """Return a section with its heading."""
    body = "\n".join(part for part in parts if part)
    return f'<section id="{anchor}">\n<h2>{escape(title)}</h2>\n{body}\n</section>'


def paragraph(text: str) -> str:
    """Return a paragraph."""
    return f"<p>{escape(text)}</p>"


def not_measured(what: str, how: str) -> str:
    """Return the note that a part was not measured, and how to measure it."""
    return f'<p class="absent"><b>Not measured:</b> {escape(what)}. <span>{escape(how)}</span></p>'


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], *, caption: str = "") -> str:
    """Return a table; a column whose first cell is a number is right-aligned."""
    cells = [tuple(row) for row in rows]
    kinds = [' class="n"' if cells and _NUMBER.match(cells[0][k]) else "" for k in range(len(heads))]
    head = "".join(
        f'<th scope="col"{kind}>{escape(text)}</th>' for text, kind in zip(heads, kinds, strict=True)
    )
    body = "\n".join(_row(row, kinds) for row in cells)
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    inside = f"{title}<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>"
    return f'<div class="scroll"><table>{inside}</table></div>'


def facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Return names and values as a definition list."""
    rows = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in pairs)
    return f'<dl class="facts">{rows}</dl>'


def figure(picture: bytes, caption: str) -> str:
    """Return a picture (PNG or JPEG) embedded in the page."""
    kind = next((kind for start, kind in _KINDS.items() if picture.startswith(start)), None)
    if kind is None:
        raise InvalidInput(f"report: picture {caption!r} is neither PNG nor JPEG; draw it again")
    data = base64.b64encode(picture).decode("ascii")
    alt = escape(caption, quote=True)
    broad = ' class="broad"' if _is_broad(picture) else ""
    image = f'<img alt="{alt}" src="data:{kind};base64,{data}">'
    return f"<figure{broad}>{image}<figcaption>{alt}</figcaption></figure>"


def _is_broad(picture: bytes) -> bool:
    """Return whether a PNG is so broad, with diagrams side by side, that it needs a row of its own."""
    if not picture.startswith(b"\x89PNG") or len(picture) < _PNG_SIZE.stop:
        return False
    width, height = struct.unpack(">II", picture[_PNG_SIZE])
    return bool(width > _BROAD * height)


def figures(pictures: Mapping[str, bytes], captions: Mapping[str, str]) -> str:
    """Return the available pictures, side by side where there is room."""
    shown = [figure(pictures[name], caption) for name, caption in captions.items() if name in pictures]
    return f'<div class="figures">{"".join(shown)}</div>' if shown else ""


def drawing(svg: str, caption: str) -> str:
    """Return a drawing with its caption; the drawing must be escaped."""
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


def number(value: float | None, digits: int, unit: str = "") -> str:
    """Return a number with its unit, or a dash."""
    return "–" if value is None else f"{value:.{digits}f}{unit}"


def signed_deg(value_deg: float) -> str:
    """Return an angle with its sign; one that rounds to zero has none."""
    rounded = round(value_deg, 4)
    return f"{rounded:+.4f}°" if rounded else "0.0000°"


def moment(created_utc: str) -> str:
    """Return an ISO 8601 date as a short text, UTC."""
    return f"{datetime.fromisoformat(created_utc).astimezone(UTC):%Y-%m-%d %H:%M} UTC"


def named_figures(figures_by_name: Mapping[str, object]) -> list[tuple[str, str]]:
    """Return the scalar figures of a document, and lists of them, as names and texts."""
    pairs = []
    for name, value in figures_by_name.items():
        text = _plain(value)
        if text is not None:
            pairs.append((name.replace("_", " "), text))
    return pairs


def _plain(value: object) -> str | None:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | str):
        return str(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        texts = [_plain(item) for item in value]
        return None if None in texts else ", ".join(str(text) for text in texts)
    return None


def _row(cells: Sequence[str], kinds: Sequence[str]) -> str:
    inside = "".join(f"<td{kind}>{escape(text)}</td>" for text, kind in zip(cells, kinds, strict=True))
    return f"<tr>{inside}</tr>"
