"""What is wrong in a file that a person wrote, in its own words: which key, what is there, what to do."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

MOST = 5
"""So many are told; who mends them finds the rest, which often come of the same mistake."""
_WORDS = {
    "extra_forbidden": "not permitted here; correct its spelling, or take it out",
    "missing": "is missing; add it",
}


def explain_file(error: ValidationError, content: object) -> str:
    """Say in one line what is wrong where; `content`: the file as it was read."""
    told = list(dict.fromkeys(_told(detail, content) for detail in error.errors()))
    more = [f"and {len(told) - MOST} more like these"] if len(told) > MOST else []
    return "; ".join([*told[:MOST], *more])


def _told(detail: Mapping[str, Any], content: object) -> str:  # Any: pydantic's own
    key = locate_key(detail["loc"], content)
    return f"{key + ': ' if key else ''}{_what(detail)}{_found(detail)}"


def _what(detail: Mapping[str, Any]) -> str:
    kind, context = detail["type"], detail.get("ctx") or {}
    if kind == "union_tag_not_found":
        tag = str(context["discriminator"]).strip("'")
        return f"its {tag} is missing; say which `{tag}` it is"
    if kind == "union_tag_invalid":
        tag = str(context["discriminator"]).strip("'")
        return f"{tag} {context['tag']!r} is not known; give one of {context['expected_tags']}"
    return _WORDS.get(kind) or str(detail["msg"]).removeprefix("Value error, ")


def _found(detail: Mapping[str, Any]) -> str:
    value = detail["input"]
    return "" if isinstance(value, dict | list | BaseModel) else f" (found {value!r})"


def locate_key(steps: tuple[int | str, ...], content: object) -> str:
    """Return a place as the file names it, entries of a list by their name where they have one.

    Pydantic names the kind of a table or of a value as well, where there are several: those are no keys.
    """
    key = ""
    for number, step in enumerate(steps):
        if isinstance(content, dict):
            if step not in content and (number < len(steps) - 1 or step in content.values()):
                continue  # the kind of this table
            content = content.get(step)
            key += f".{step}" if key else str(step)
        elif isinstance(content, list) and isinstance(step, int) and step < len(content):
            content = content[step]
            name = content.get("name") if isinstance(content, dict) else None
            key += f"[{step if name is None else repr(name)}]"
    return key
