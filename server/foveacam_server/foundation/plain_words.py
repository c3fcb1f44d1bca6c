"""Validation errors in plain words: which field, what was sent, what is allowed, what to do."""

import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Context
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from foveacam_hardware.contract import InvalidInput

_NEEDED = {
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text",
    "string_unicode": "text of whole characters",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "model_type": "an object",
    "model_attributes_type": "an object",
    "dict_type": "an object",
    "list_type": "a list",
    "tuple_type": "a list",
}

_MOST_FAILURES = 5
"""Largest number of reported failures of a request; a list of a thousand wrong numbers has one cause."""
_NAME_LENGTH = 80
_TEXT_LENGTH = 40
_DIGITS = 6
_MORE_THAN_A_TIME_STAMP = re.compile(r"(?<![\w./\"'])\d{21,}(?:\.\d+)?(?!\w)")
_MORE_THAN_A_PATH = re.compile(r"\S{301,}")
_WORD_LENGTH = 80

Failure = Mapping[str, Any]  # Any: pydantic's own
"""One of pydantic's error dictionaries."""


_Model = TypeVar("_Model", bound=BaseModel)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainWords:
    """One validation failure in plain words."""

    detail: str
    asked: str | None
    found: str | None
    remedy: str | None


def validated(model: type[_Model], given: Mapping[str, object]) -> _Model:
    """Return a validated model; None means not given. Raise `InvalidInput` in plain words."""
    try:
        return model.model_validate({name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        words = explain_validation(error.errors())
        raise InvalidInput(words.detail, asked=words.asked, found=words.found, remedy=words.remedy) from error


def explain_validation(errors: Sequence[Failure], *, body: object = None) -> PlainWords:
    """Explain the failures of one request; asked, found and remedy are the first one's.

    `body`: text that is not JSON.
    """
    if not errors:
        return PlainWords(detail="The request cannot be used.", asked=None, found=None, remedy=None)
    explained = [_explain_failure(error, body=body) for error in errors[:_MOST_FAILURES]]
    details = list(dict.fromkeys(words.detail for words in explained))
    if len(errors) > _MOST_FAILURES:
        details.append(f"{len(errors) - _MOST_FAILURES} more failures follow.")
    first = explained[0]
    return PlainWords(detail=" ".join(details), asked=first.asked, found=first.found, remedy=first.remedy)


def explain_unreadable(cause: BaseException) -> PlainWords:
    """Explain why a body is not readable JSON."""
    if isinstance(cause, UnicodeDecodeError):
        found = f"byte 0x{cause.object[cause.start]:02x} at position {cause.start} is not {cause.encoding}"
    elif isinstance(cause, RecursionError):
        found = "its lists and objects are nested too deeply"
    elif isinstance(cause, ValueError) and "digits" in str(cause):
        found = f"it has a number of more than {sys.get_int_max_str_digits()} digits"
    else:
        found = "it cannot be parsed"
    return PlainWords(
        detail=f"The body cannot be read: {found}.",
        asked="a JSON body",
        found=found,
        remedy="Send JSON in UTF-8.",
    )


def _explain_failure(error: Failure, *, body: object) -> PlainWords:
    where = _path(error.get("loc", ()))
    kind = str(error.get("type", ""))
    context = error.get("ctx") or {}
    value = error.get("input")
    if kind == "missing":
        return PlainWords(
            detail=f"{where} is missing.", asked=where, found="nothing", remedy=f"Send {where}."
        )
    if kind == "extra_forbidden":
        return PlainWords(
            detail=f"{where} is not known here.",
            asked=where,
            found=_show(value),
            remedy=f"Leave {where} out, or check its spelling.",
        )
    if kind == "json_invalid":
        failure = str(context.get("error", "it cannot be parsed")).removesuffix(" at")
        reason = failure + _place(error.get("loc", ()), body)
        detail = f"The body is not JSON: {reason}."
        return PlainWords(detail=detail, asked="a JSON body", found=reason, remedy="Send JSON.")
    if isinstance(value, bytes):  # not parsed: its Content-Type is not JSON
        return PlainWords(
            detail="The body was not sent as JSON.",
            asked="a JSON body",
            found="another Content-Type",
            remedy="Send it with Content-Type: application/json.",
        )
    if kind == "value_error":  # a validator's own message, on how fields go together
        reason = str(error.get("msg", "")).removeprefix("Value error, ")
        return PlainWords(detail=f"{where}: {reason}.", asked=where, found=_show(value), remedy=None)
    needed = _needed(kind, context) or str(error.get("msg", "another value"))
    shown = _show(value)
    return PlainWords(
        detail=f"{where} is {shown}; needed is {needed}.",
        asked=f"{where}: {needed}",
        found=shown,
        remedy=f"Send {needed} as {where}.",
    )


def _needed(kind: str, context: Mapping[str, Any]) -> str | None:
    if kind in _NEEDED:
        return _NEEDED[kind]
    bounds = {
        "greater_than": ("gt", "a value above"),
        "greater_than_equal": ("ge", "a value of at least"),
        "less_than": ("lt", "a value below"),
        "less_than_equal": ("le", "a value of at most"),
        "string_too_long": ("max_length", "text no longer than"),
        "string_too_short": ("min_length", "text no shorter than"),
        "too_long": ("max_length", "a list no longer than"),
        "too_short": ("min_length", "a list no shorter than"),
    }
    if kind in bounds:
        key, words = bounds[kind]
        unit = " characters" if kind.startswith("string") else ""
        bound = context.get(key)
        return f"{words} {f'{bound:.12g}' if isinstance(bound, float) else bound}{unit}"
    tag = str(context.get("discriminator")).strip("'")
    if kind == "union_tag_invalid":
        return f"a {tag} that is one of {context.get('expected_tags')}"
    if kind == "union_tag_not_found":
        return f"an object that states its {tag}"
    if kind in ("literal_error", "enum"):
        return f"one of {context.get('expected')}"
    return None


def _place(location: Sequence[str | int], body: object) -> str:
    """Return the line and column of a body where parsing stopped; empty when unknown."""
    position = location[-1] if location else None
    if not isinstance(body, str) or not isinstance(position, int):
        return ""
    before = body[:position]
    return f" at line {before.count(chr(10)) + 1}, column {position - before.rfind(chr(10))}"


def _path(location: Sequence[str | int]) -> str:
    parts = [_cut(str(part), _NAME_LENGTH) for part in location]
    if parts and parts[0] in ("body", "query", "path", "header"):
        parts = parts[1:] or ["the body"] if parts[0] == "body" else parts[1:]
    return ".".join(parts) or "the request"


def _show(value: object) -> str:
    if isinstance(value, str):
        return f'the text "{_cut(value, _TEXT_LENGTH)}"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return "not a number" if math.isnan(value) else "infinite"
    if value is None:
        return "null"
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    shown = str(value)
    if len(shown) <= _TEXT_LENGTH:
        return shown
    return f"{_cut(shorten(shown), _TEXT_LENGTH)} ({len(shown)} characters)"


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else text[:length] + "…"


def shorten(text: str) -> str:
    """Return `text` with numbers over 20 digits as powers of ten, and words over 300 characters cut."""
    readable = _MORE_THAN_A_TIME_STAMP.sub(lambda number: _power(number[0]), text)
    return _MORE_THAN_A_PATH.sub(lambda word: word[0][:_WORD_LENGTH] + "…", readable)


def _power(number: str) -> str:
    return f"{Context(prec=_DIGITS).create_decimal(number).normalize():g}"
