"""Reads the header Prefer (RFC 7240)."""

import re

_QUOTED = r'"(?:[^"\\]|\\.)*"'
_ONE = re.compile(rf'(?:[^,"]|{_QUOTED})+')
"""A preference with its parameters, up to a comma that is not quoted."""
_NAME_VALUE = re.compile(rf'\s*([^\s=;"]+)\s*(?:=\s*({_QUOTED}|[^\s;"]*))?\s*(?:;.*)?', re.DOTALL)
_SECONDS = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,3})?")


def preferences_of(prefer: str) -> dict[str, str]:
    """Return the preferences of a header, or of its lines joined by commas, by their names in small letters.

    Values are unquoted; the first of a repeated name counts; parameters and malformed parts are left out.
    """
    found: dict[str, str] = {}
    for one in _ONE.findall(prefer):
        if (match := _NAME_VALUE.fullmatch(one)) is not None:
            name, value = match[1].lower(), match[2] or ""
            unquoted = re.sub(r"\\(.)", r"\1", value[1:-1]) if value.startswith('"') else value
            found.setdefault(name, unquoted)
    return found


def preferred_wait_s(prefer: str | None, *, longest_s: float) -> float:
    """Return the time that a client is willing to wait, s, at most `longest_s`; 0 without `wait`."""
    wish = preferences_of(prefer or "").get("wait", "")
    return min(longest_s, float(wish)) if _SECONDS.fullmatch(wish) else 0.0
