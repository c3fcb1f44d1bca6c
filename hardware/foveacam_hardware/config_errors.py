"""Turns pydantic's errors about a hand-written file into sentences: key, value found, remedy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

MAX_REPORTED = 5
"""Largest number of errors listed; further ones often have the same cause and vanish with these."""
_MESSAGES = {
    "extra_forbidden": "not permitted here; correct its spelling, or take it out",
    "missing": "is missing; add it",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ConfigFault:
    """What is wrong with one key of a file; `key` is dotted, as in `cameras.left.serial`."""

    key: str
    message: str


class KeysConflict(ValueError):
    """Keys of one table that contradict each other; `keys`: those to correct, relative to the table."""

    def __init__(self, message: str, *, keys: Sequence[str]) -> None:
        super().__init__(message)
        self.keys = tuple(keys)


def list_faults(error: ValidationError, content: object) -> tuple[ConfigFault, ...]:
    """Return what is wrong with each faulty key; `content`: the file as parsed."""
    faults = [fault for detail in error.errors() for fault in _faults(detail, content)]
    return tuple(dict.fromkeys(faults))


def _faults(detail: Mapping[str, Any], content: object) -> list[ConfigFault]:  # Any: pydantic's own
    table = locate_key(detail["loc"], content)
    conflict = (detail.get("ctx") or {}).get("error")
    keys = conflict.keys if isinstance(conflict, KeysConflict) else ("",)
    return [
        ConfigFault(
            key=".".join(part for part in (table, key) if part), message=_message(detail) + _found(detail)
        )
        for key in keys
    ]


def explain_file(error: ValidationError, content: object) -> str:
    """Return one line that names every faulty key and its remedy; `content`: the file as parsed."""
    messages = list(dict.fromkeys(_describe(detail, content) for detail in error.errors()))
    more = [f"and {len(messages) - MAX_REPORTED} more like these"] if len(messages) > MAX_REPORTED else []
    return "; ".join([*messages[:MAX_REPORTED], *more])


def _describe(detail: Mapping[str, Any], content: object) -> str:  # Any: pydantic's own
    key = locate_key(detail["loc"], content)
    return f"{key + ': ' if key else ''}{_message(detail)}{_found(detail)}"


def _message(detail: Mapping[str, Any]) -> str:
    kind, context = detail["type"], detail.get("ctx") or {}
    if kind == "union_tag_not_found":
        tag = str(context["discriminator"]).strip("'")
        return f"its {tag} is missing; say which `{tag}` it is"
    if kind == "union_tag_invalid":
        tag = str(context["discriminator"]).strip("'")
        return f"{tag} {context['tag']!r} is not known; give one of {context['expected_tags']}"
    return _MESSAGES.get(kind) or str(detail["msg"]).removeprefix("Value error, ")


def _found(detail: Mapping[str, Any]) -> str:
    value = detail["input"]
    return "" if isinstance(value, dict | list | BaseModel) else f" (found {value!r})"


def locate_key(steps: tuple[int | str, ...], content: object) -> str:
    """Return an error's key path as the file writes it, list entries by their `name` where they have one.

    Pydantic inserts the tag of a discriminated union into the path; such steps are not keys of the file.
    """
    key = ""
    for number, step in enumerate(steps):
        if isinstance(content, dict):
            if step not in content and (number < len(steps) - 1 or step in content.values()):
                continue  # the tag of this table's union
            content = content.get(step)
            key += f".{step}" if key else str(step)
        elif isinstance(content, list) and isinstance(step, int) and step < len(content):
            content = content[step]
            name = content.get("name") if isinstance(content, dict) else None
            key += f"[{step if name is None else repr(name)}]"
    return key
