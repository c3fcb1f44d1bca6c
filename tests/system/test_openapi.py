"""The REST interface as a document: committed, and true to what the server does (schemathesis)."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, given, seed, settings
from jsonschema import Draft202012Validator
from openapi_spec_validator import validate
from pydantic import SecretStr
from schemathesis import Case
from schemathesis.core.result import Ok

from foveacam_server.app import create_app
from foveacam_server.foundation.settings import Settings
from tests.support.servers.running_server import PATIENCE_S, SELDOM_HZ, Running, running

pytestmark = pytest.mark.timeout(300)

COMMITTED = Path(__file__).parents[1] / "data" / "openapi.json"
CASES_PER_OPERATION = 2
"""The simplest case and one at random; `foveacam bench auth` tries many more."""
CHECKED = {
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_schema_conformance",
    "unsupported_method",
    "allow_header_conformance",
}
LEFT_OUT = r"stream\.mjpeg$|/events$|/simulation/faults$"
"""What never ends, and what breaks the rig for everybody else."""


def test_openapi_document_is_the_committed_one() -> None:
    found = create_app(Settings(viewer=False)).openapi()
    if os.environ.get("UPDATE_OPENAPI"):
        COMMITTED.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    assert found == json.loads(COMMITTED.read_text(encoding="utf-8")), (
        "the REST interface is no longer the committed one; when that is meant, write it anew with "
        "UPDATE_OPENAPI=1 .venv/bin/python -m pytest tests/system/test_openapi.py, "
        "and then the page's types with sh web/generate-types.sh"
    )


def schemas_in(node: object) -> Iterator[dict[str, Any]]:  # Any: JSON documents
    """Yield every JSON schema of the document."""
    if isinstance(node, dict):
        for name, value in node.items():
            if name == "schema":
                yield value
            elif name == "schemas":
                yield from value.values()
            else:
                yield from schemas_in(value)
    elif isinstance(node, list):
        for value in node:
            yield from schemas_in(value)


def test_the_committed_document_is_valid_openapi() -> None:
    document = json.loads(COMMITTED.read_text(encoding="utf-8"))
    validate(document)
    schemas = list(schemas_in(document))
    assert len(schemas) > 500
    different = {json.dumps(schema, sort_keys=True): schema for schema in schemas}
    for schema in different.values():  # OpenAPI's own schema says nothing of those inside
        Draft202012Validator.check_schema(schema)


def test_the_document_tells_of_the_token_and_what_the_way_in_answers() -> None:
    document = json.loads(COMMITTED.read_text(encoding="utf-8"))
    schemes = document["components"]["securitySchemes"]
    assert {(scheme["type"], scheme.get("in", scheme.get("scheme"))) for scheme in schemes.values()} == {
        ("http", "bearer"),
        ("apiKey", "header"),
        ("apiKey", "cookie"),
    }
    assert {tuple(way) for way in document["security"]} == {(), *((name,) for name in schemes)}
    operations = [operation for path in document["paths"].values() for operation in path.values()]
    answers = [set(operation["responses"]) for operation in operations]
    assert all({"400", "401", "403", "429"} <= statuses for statuses in answers)
    assert "503" in document["paths"]["/api/v1/views/{name}/snapshot.jpg"]["get"]["responses"]


def test_the_document_of_a_server_with_a_token_says_that_it_is_needed() -> None:
    document = create_app(Settings(viewer=False, token=SecretStr("a token of our own"))).openapi()
    assert {} not in document["security"]
    assert document["paths"]["/healthz"]["get"]["security"] == []


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A server whose views are seldom drawn: nobody looks at them."""
    with running(tmp_path_factory.mktemp("data"), live_hz=SELDOM_HZ) as found:
        yield found


def test_generated_requests_meet_no_server_error_and_answers_fit_their_description(server: Running) -> None:
    document = server.http.get("/openapi.json").json()  # its own loader waits for 10 s, whatever the machine
    schema = schemathesis.openapi.from_dict(document).exclude(path_regex=LEFT_OUT)
    schemathesis.checks.load_all_checks()
    every = schemathesis.checks.CHECKS
    left_out = [every.get_one(name) for name in every.get_all_names() if name not in CHECKED]
    tried, session = 0, requests.Session()
    for result in schema.get_all_operations():
        assert isinstance(result, Ok), result
        operation = result.ok()

        @seed(2)
        @settings(
            max_examples=CASES_PER_OPERATION,
            deadline=None,
            database=None,
            phases=(Phase.generate,),
            suppress_health_check=list(HealthCheck),
        )
        @given(case=operation.as_strategy())
        def ask(case: Case[Any]) -> None:  # Any: whatever the case carries
            nonlocal tried
            tried += 1
            answer = case.call(base_url=str(server.http.base_url), session=session, timeout=PATIENCE_S)
            if answer.status_code == 202:  # what it does with the rig is looked at by other tests
                server.post(f"/jobs/{answer.json()['id']}/cancel")
            case.validate_response(answer, excluded_checks=left_out)  # type: ignore[arg-type]  # its own registry's types

        ask()
    assert tried >= 100
