"""Shortens long numbers and words of messages."""

import re
from decimal import Context

_DIGITS = 6
_MORE_THAN_A_TIME_STAMP = re.compile(r"(?<![\w./\"'])\d{21,}(?:\.\d+)?(?!\w)")
_MORE_THAN_A_PATH = re.compile(r"\S{301,}")
_KEPT = 80


def shorten(text: str) -> str:
    """Return `text` with numbers over 20 digits as powers of ten, and words over 300 characters cut."""
    readable = _MORE_THAN_A_TIME_STAMP.sub(lambda number: _power(number[0]), text)
    return _MORE_THAN_A_PATH.sub(lambda word: word[0][:_KEPT] + "…", readable)


def _power(number: str) -> str:
    return f"{Context(prec=_DIGITS).create_decimal(number).normalize():g}"
