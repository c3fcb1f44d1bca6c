"""Every operation of the API is a method of the client, and what is generated is current."""

import asyncio
import inspect
import json
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from foveacam_client.call import Call
from foveacam_client.document import Document
from foveacam_client.generated import models
from foveacam_client.generated.async_operations import AsyncOperations
from foveacam_client.generated.operations import Operations

ROOT = Path(__file__).parents[3]
DOCUMENT = json.loads((ROOT / "tests" / "data" / "openapi.json").read_text())
DESCRIBED = {(verb.upper(), path) for path, item in DOCUMENT["paths"].items() for verb in item}


class RecordingTransport:
    """Takes every call and sends none."""

    def __init__(self) -> None:
        self.calls: list[Call] = []

    def _take(self, call: Call, kind: object = None, **_: object) -> None:
        self.calls.append(call)

    answer = start = order = download = events = _take


class AsyncRecordingTransport(RecordingTransport):
    """The same for methods that are awaited."""

    async def _take_awaited(self, call: Call, kind: object = None) -> None:
        self.calls.append(call)

    answer = start = order = _take_awaited  # type: ignore[assignment]  # awaited instead


def call_all(operations: object) -> None:
    """Call every method of every noun with a text for each argument that it needs."""
    for group in vars(operations).values():
        for name, method in inspect.getmembers(group, inspect.ismethod):
            if not name.startswith("_"):
                needed = [
                    found
                    for found in inspect.signature(method).parameters.values()
                    if found.default is inspect.Parameter.empty
                ]
                answered = method(
                    *["x" for found in needed if found.kind is found.POSITIONAL_OR_KEYWORD],
                    **{found.name: "x" for found in needed if found.kind is found.KEYWORD_ONLY},
                )
                if inspect.iscoroutine(answered):
                    asyncio.run(answered)


@pytest.mark.parametrize(
    ("operations", "transport"),
    [(Operations, RecordingTransport()), (AsyncOperations, AsyncRecordingTransport())],
    ids=["sync", "async"],
)
def test_every_operation_of_the_document_is_one_method(
    operations: Callable[[RecordingTransport], object],
    transport: RecordingTransport,
) -> None:
    call_all(operations(transport))

    called = [(call.method, call.path) for call in transport.calls]
    assert DESCRIBED - set(called) == set()
    assert sorted(called) == sorted(DESCRIBED)
    assert all("{" not in call.address for call in transport.calls)


def test_every_schema_of_the_document_is_a_model() -> None:
    missing = [name for name in DOCUMENT["components"]["schemas"] if not hasattr(models, name)]

    assert missing == []


def test_every_model_is_built_when_it_is_imported() -> None:
    """Else pydantic would build it at its first use, which threads must not do at once."""
    classes = [found for found in vars(models).values() if inspect.isclass(found)]
    documents = [found for found in classes if issubclass(found, Document)]

    assert len(documents) > 300
    assert [found.__name__ for found in documents if not found.__pydantic_complete__] == []


@pytest.mark.slow
def test_the_generated_modules_are_current() -> None:
    checked = subprocess.run(
        [sys.executable, ROOT / ".ci" / "generate_client.py", "--check"], capture_output=True, text=True
    )

    assert checked.returncode == 0, checked.stderr


def test_the_client_alone_has_the_version_and_the_bounds_of_the_whole() -> None:
    whole, alone = (
        tomllib.loads((ROOT / folder / "pyproject.toml").read_text())["project"]
        for folder in (".", "server/foveacam_client")
    )

    assert alone["version"] == whole["version"]
    assert set(alone["dependencies"]) <= {need.partition(" ")[0] for need in whole["dependencies"]}
