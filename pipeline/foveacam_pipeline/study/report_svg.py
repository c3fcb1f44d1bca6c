"""Vector graphics for a page that holds several: ids of each its own, no rules that reach beyond it."""

import re
from html import escape

from foveacam_hardware.contract import InvalidInput

_ID = re.compile(r'\bid="([^"]+)"')
_LINK = re.compile(r'(\b(?:xlink:)?href="|url\()#')
_METADATA = re.compile(r"<metadata>.*?</metadata>\s*", re.DOTALL)
_STYLE = re.compile(r"<defs>\s*<style[^>]*>.*?</style>\s*</defs>\s*", re.DOTALL)
_OPENING = re.compile(r"<svg\b[^>]*>")
_VIEW = re.compile(r'viewBox="[^"]+"')
_ACTIVE = re.compile(r"<script\b|<foreignObject\b|\son\w+\s*=|javascript:", re.IGNORECASE)
_NAME = re.compile(r"[a-z0-9-]+")


def inline_svg(svg: str, *, name: str, label: str) -> str:
    """Return a drawing as part of a page: `name` goes before its ids, `label` is what a screen reader says.

    Its size is the page's to choose. The rule that matplotlib gives to all elements of the document becomes
    the drawing's own, its metadata go. Raise InvalidInput for a name of other characters than a-z, 0-9 and
    -, and for what is no drawing or acts.
    """
    opening, view = _OPENING.search(svg), _VIEW.search(svg)
    if opening is None or view is None or _ACTIVE.search(svg):
        raise InvalidInput(f"picture {name!r}: an SVG drawing without scripts is needed; draw it again")
    if not _NAME.fullmatch(name):
        raise InvalidInput(f"picture {name!r}: its name is made of a-z, 0-9 and -; choose such a name")
    inside = svg[opening.end() :]
    inside = _STYLE.sub("", _METADATA.sub("", inside))
    inside = _LINK.sub(rf"\1#{name}-", _ID.sub(rf'id="{name}-\1"', inside))
    return (
        f'<svg class="plot" {view.group(0)} role="img" aria-label="{escape(label, quote=True)}" '
        'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'stroke-linejoin="round" stroke-linecap="butt">{inside}'
    )
