"""HTML pages from Jinja templates: text is escaped, a missing value raises, and files are embedded."""

import base64
import math
import re
import struct
from dataclasses import astuple
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from foveacam_hardware.contract import InvalidInput

if TYPE_CHECKING:
    from jinja2 import Environment

_SHARED = Path(__file__).parent
"""Folder of `base.html.j2`, from which a report's template inherits, and of the macros in `parts.html.j2`."""
_NUMBER = re.compile(r"[+\-−±<≤]?\d(?!\d{3}-)|–$")
_PNG_SIZE, _BROAD = slice(16, 24), 1.5
_KINDS = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
_SVG_SAFE = " !$()*+,-./:;=?@[]{}|~"
"""Characters of an SVG that stand for themselves in its data URL."""


def fill_template(template: Path, **values: object) -> str:
    """Return the page of a template; the templates beside it can be included and imported."""
    return _environment(template.parent).get_template(template.name).render(values)


@cache
def _environment(folder: Path) -> "Environment":
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # a server's start has no use for it

    environment = Environment(
        loader=FileSystemLoader([folder, _SHARED]),
        autoescape=True,
        undefined=StrictUndefined,
        extensions=["jinja2.ext.do"],
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals.update(number=number, signed_deg=signed_deg)
    environment.filters.update(astuple=astuple, degrees=math.degrees, moment=moment, picture_url=picture_url)
    environment.tests.update(broad=is_broad, numeric=_NUMBER.match)
    return environment


def picture_url(picture: bytes | str, name: str) -> str:
    """Return a picture (PNG, JPEG, or SVG as text) as a data URL, in which scripts of an SVG never run."""
    if isinstance(picture, str) and picture.startswith("<svg"):
        return f"data:image/svg+xml,{quote(picture, safe=_SVG_SAFE)}"
    for start, kind in _KINDS.items():
        if isinstance(picture, bytes) and picture.startswith(start):
            return f"data:{kind};base64,{base64.b64encode(picture).decode('ascii')}"
    raise InvalidInput(f"report: picture {name!r} is neither PNG, JPEG nor SVG; draw it again")


def is_broad(picture: bytes) -> bool:
    """Return whether a PNG is so broad, with diagrams side by side, that it needs a row of its own."""
    if not picture.startswith(b"\x89PNG") or len(picture) < _PNG_SIZE.stop:
        return False
    width, height = struct.unpack(">II", picture[_PNG_SIZE])
    return bool(width > _BROAD * height)


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
