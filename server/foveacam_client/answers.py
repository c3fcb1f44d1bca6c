"""Reads the document of an answer."""

from functools import cache
from typing import Any, TypeVar

import httpx
from pydantic import TypeAdapter, ValidationError

from foveacam_client.problems import UnexpectedAnswer

AnswerT = TypeVar("AnswerT")


def read_answer(answer: httpx.Response, kind: type[AnswerT]) -> AnswerT:
    """Return the document of an answer; additional fields of a newer server are ignored."""
    try:
        adapter = _adapter(kind)  # type: ignore[arg-type]  # mypy finds no hash of a type variable's class
        found: AnswerT = adapter.validate_json(answer.content, extra="ignore")
    except ValidationError as error:
        raise UnexpectedAnswer(
            f"{answer.request.method} {answer.request.url}: the answer is not what this client knows; it is"
            f" of another version than the server, or no server of a rig answers there: {error}"
        ) from error
    return found


@cache  # building one takes milliseconds
def _adapter(kind: Any) -> TypeAdapter[Any]:  # noqa: ANN401 - a class, or a list of one
    return TypeAdapter(kind)
