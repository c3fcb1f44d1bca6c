"""Canonical JSON text of a value, as written by ECMAScript with sorted keys.

A record's id is a hash of this text, so every digit counts: 600.0 is written 600, 1e-7 keeps its exponent.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

from foveacam_hardware.contract import InvalidInput

Json: TypeAlias = Mapping[str, "Json"] | Sequence["Json"] | str | float | int | bool | None
"""A value of a JSON document."""
ID_DIGITS = 32
"""Hexadecimal digits of the SHA-256 that name a record (FEATURES: authors' files)."""
_LONGEST_PLAIN = 21  # ECMA-262, Number::toString: from 1e21 on with an exponent
_SMALLEST_PLAIN = -6  # and below 1e-6


def number_text(value: float) -> str:
    """Return a finite number as ECMAScript prints it (ECMA-262, Number::toString with radix 10)."""
    number = float(value)  # JavaScript has doubles only
    if not math.isfinite(number):
        raise InvalidInput(f"number {value!r} has no JSON text; give finite numbers")
    if number == 0.0:
        return "0"  # minus zero too
    sign = "-" if number < 0.0 else ""
    digits, point = _shortest_digits(abs(number))
    count = len(digits)
    if count <= point <= _LONGEST_PLAIN:
        return sign + digits + "0" * (point - count)
    if 0 < point <= _LONGEST_PLAIN:
        return f"{sign}{digits[:point]}.{digits[point:]}"
    if _SMALLEST_PLAIN < point <= 0:
        return f"{sign}0.{'0' * -point}{digits}"
    fraction = f".{digits[1:]}" if count > 1 else ""
    return f"{sign}{digits[0]}{fraction}e{point - 1:+d}"


def string_text(value: str) -> str:
    """Return a string as JSON.stringify writes it, with the fewest escapes."""
    text = json.dumps(value, ensure_ascii=False)
    return "".join(f"\\u{ord(c):04x}" if "\ud800" <= c <= "\udfff" else c for c in text)


def canonical_text(value: Json) -> str:
    """Return the canonical JSON text of a value: no spaces, keys in the order of their UTF-16 units."""
    if isinstance(value, str):
        return string_text(value)
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return number_text(value)
    if isinstance(value, Mapping):
        keys = sorted(value, key=lambda key: key.encode("utf-16-be", "surrogatepass"))
        return "{" + ",".join(f"{string_text(key)}:{canonical_text(value[key])}" for key in keys) + "}"
    return "[" + ",".join(canonical_text(item) for item in value) + "]"


def record_id(inner: Json) -> str:
    """Return the id of a record with this inner document."""
    return hashlib.sha256(canonical_text(inner).encode("utf-8")).hexdigest()[:ID_DIGITS]


def _shortest_digits(number: float) -> tuple[str, int]:
    """Return the fewest digits that read back as `number` > 0, and the position of the decimal point."""
    mantissa, _, exponent = repr(number).partition("e")
    whole, _, fraction = mantissa.partition(".")
    digits = whole + fraction
    point = len(whole) + int(exponent or "0")
    leading = len(digits) - len(digits.lstrip("0"))
    return digits.strip("0"), point - leading
