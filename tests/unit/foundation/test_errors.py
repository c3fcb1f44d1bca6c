import asyncio
import errno
import os
from pathlib import Path
from typing import Annotated, Literal

import httpx
import pytest
from fastapi import FastAPI
from pydantic import BaseModel, Field, ValidationError, create_model

from foveacam_hardware.contract import FoveaError, OutOfRange, Timeout, errors
from foveacam_server.doors.error_handlers import install
from foveacam_server.foundation.errors import KINDS, problem_of
from foveacam_server.foundation.plain_words import explain_validation


def test_every_branch_of_the_error_tree_has_its_own_problem_type() -> None:
    branches = {
        found
        for found in vars(errors).values()
        if isinstance(found, type) and issubclass(found, FoveaError) and found is not FoveaError
    }
    assert branches <= KINDS.keys()
    slugs = [KINDS[branch].slug for branch in branches]
    assert len(set(slugs)) == len(slugs)


@pytest.mark.parametrize(
    ("slug", "status"),
    [
        ("invalid-input", 422),
        ("out-of-range", 422),
        ("not-calibrated", 409),
        ("not-connected", 503),
        ("busy", 409),
        ("stopped", 409),
        ("cancelled", 409),
        ("timeout", 504),
        ("device-fault", 502),
        ("storage-full", 507),
        ("not-found", 404),
    ],
)
def test_statuses_are_those_that_programs_rely_on(slug: str, status: int) -> None:
    assert [kind.status for kind in KINDS.values() if kind.slug == slug] == [status]


def test_problem_carries_what_the_error_knows() -> None:
    error = OutOfRange("too far", asked="11 degrees", found="10 degrees", remedy="look elsewhere")
    assert problem_of(error).document(instance="/here").model_dump() == {
        "type": "/problems/out-of-range",
        "title": "Out of range",
        "status": 422,
        "detail": "too far; look elsewhere",
        "instance": "/here",
        "asked": "11 degrees",
        "found": "10 degrees",
        "remedy": "look elsewhere",
    }


def test_unknown_parts_are_left_out() -> None:
    assert problem_of(Timeout("late")).document().model_fields_set == {"type", "title", "status", "detail"}


def test_subclass_of_an_error_is_its_parents_problem() -> None:
    class Slow(Timeout):
        pass

    assert problem_of(Slow("late")).kind.slug == "timeout"


def test_builtin_error_shows_nothing_of_itself() -> None:
    problem = problem_of(KeyError("password"))
    assert problem.kind.status == 500
    assert "password" not in str(problem.document())


def test_long_text_is_shortened_in_the_explanation() -> None:
    failure = {
        "loc": ("body", "label"),
        "type": "string_too_long",
        "ctx": {"max_length": 80},
        "input": "x" * 500,
    }
    words = explain_validation([failure])
    assert words.remedy == "Send text no longer than 80 characters as label."
    assert len(words.detail) < 120


def test_all_failures_of_a_request_are_told() -> None:
    failures = [{"loc": ("body", name), "type": "missing", "input": {}} for name in ("x_px", "y_px")]
    assert explain_validation(failures).detail == "x_px is missing. y_px is missing."


class _Corner(BaseModel):
    kind: Literal["corner"]


class _Edge(BaseModel):
    kind: Literal["edge"]


class _Request(BaseModel):
    cameras: Annotated[tuple[str, ...], Field(min_length=1, max_length=2)] = ("left",)
    place: Annotated[_Corner | _Edge, Field(discriminator="kind")] = _Edge(kind="edge")


@pytest.mark.parametrize(
    ("sent", "message"),
    [
        ({"cameras": []}, "cameras is a list of 0; needed is a list no shorter than 1."),
        ({"cameras": ["a"] * 3}, "cameras is a list of 3; needed is a list no longer than 2."),
        ({"cameras": 5}, "cameras is 5; needed is a list."),
        (
            {"place": {"kind": "middle"}},
            "place is an object; needed is a kind that is one of 'corner', 'edge'.",
        ),
        ({"place": {}}, "place is an object; needed is an object that states its kind."),
    ],
)
def test_lists_and_kinds_are_told_without_the_words_of_the_library(
    sent: dict[str, object], message: str
) -> None:
    with pytest.raises(ValidationError) as refused:
        _Request.model_validate(sent)
    assert explain_validation(refused.value.errors()).detail == message


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS])
def test_a_disk_that_takes_no_more_is_no_mistake_of_the_server_wherever_it_is_met(
    number: int, tmp_path: Path
) -> None:
    problem = problem_of(OSError(number, os.strerror(number), str(tmp_path / "new.json"))).document()

    assert (problem.type, problem.status) == ("/problems/storage-full", 507)
    assert problem.detail.startswith(f"new.json in {tmp_path}: the ")
    assert problem.remedy is not None
    assert problem.remedy.endswith(", then try again")


def test_a_full_disk_is_told_where_nobody_knows_the_file() -> None:
    problem = problem_of(OSError(errno.ENOSPC, "No space left on device")).document()

    assert problem.status == 507
    assert "No space left on device; free some space" in problem.detail


@pytest.mark.parametrize("number", [errno.EACCES, errno.EIO, errno.ENOENT])
def test_another_error_of_the_system_shows_no_details(number: int) -> None:
    assert problem_of(OSError(number, "secret", "/secret")).document().status == 500


def test_a_long_number_is_told_shortly() -> None:
    model = create_model("Asked", count=(Annotated[int, Field(le=9)], ...))
    with pytest.raises(ValidationError) as refused:
        model.model_validate({"count": 10**400})
    words = explain_validation(refused.value.errors())

    assert "401 characters" in words.detail
    assert len(words.detail) < 120


@pytest.mark.parametrize(("number", "status"), [(errno.ENOSPC, 507), (errno.EIO, 500)])
def test_an_error_of_the_system_that_leaves_a_route_is_a_problem(number: int, status: int) -> None:
    app = FastAPI()
    install(app)

    @app.get("/files")
    def write() -> None:
        raise OSError(number, os.strerror(number))

    async def asked() -> httpx.Response:
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://here") as client:
            return await client.get("/files")

    answer = asyncio.run(asked())

    assert (answer.status_code, answer.json()["status"]) == (status, status)
    assert answer.json()["instance"] == "/files"
