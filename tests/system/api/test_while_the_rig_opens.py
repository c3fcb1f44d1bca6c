"""A server whose rig never finishes opening: what needs the rig says so, and when to ask again."""

import json
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import httpx
import pytest

from foveacam_hardware.contract import NotConnected
from foveacam_server.app import create_app
from foveacam_server.assembly import first_services
from foveacam_server.foundation.errors import StillOpening
from foveacam_server.foundation.settings import Settings
from foveacam_server.rig.refusals import not_open
from foveacam_server.rig.schema import DeviceProblemDocument
from foveacam_server.rig.status import RigStatus
from tests.support.servers.local_server import serving

Schema = Mapping[str, Any]  # Any: JSON

OPENAPI = json.loads((Path(__file__).parents[2] / "data" / "openapi.json").read_text(encoding="utf-8"))
PATIENCE_S = 30.0
PIXEL = {"pixel": {"x_px": 720, "y_px": 540}}
BODIES = {
    ("post", "/fixations"): PIXEL,
    ("post", "/follows"): PIXEL,
    ("post", "/loop"): PIXEL,
    ("post", "/pan_tilt/moves"): {"pan_deg": 0.0, "tilt_deg": 0.0},
    ("post", "/rail/moves"): {"position_mm": 0.0},
    ("put", "/mirrors/volts"): {"left": {"x_v": 0.0, "y_v": 0.0}},
}
NAMES = {"role": "wide", "name": "wide", "eye": "left"}
ENDLESS = ("/events", "/views/{name}/stream.mjpeg")
LEFT_OUT = ("/lease", "/stop", "/session", "/users", "/service_tokens", "/rig/setup/")
"""The first change who may ask; to set a rig up no rig is needed, and its search takes seconds."""
WITHOUT_WORK = "the vergence loop does not run", "no target is followed now", "the lease is free"
"""Refusals that stay true when the rig is open."""
NEEDING_THE_RIG = [
    "delete /cameras/wide/settings",
    "delete /settle_time",
    "delete /simulation/faults",
    "get /calibrations/current",
    "get /cameras/wide",
    "get /depth",
    "get /reach",
    "get /rig/binning",
    "get /settle_time",
    "get /simulation/faults",
    "get /suggestions",
    "get /views/wide/snapshot.jpg",
    "get /wide_depth",
    "get /wide_depth.ply",
    "get /wide_depth.png",
    "patch /cameras/wide",
    "post /calibration_sessions",
    "post /calibrations/import",
    "post /cameras/self_tests",
    "post /captures",
    "post /captures/estimates",
    "post /acceptances",
    "post /drift_checks",
    "post /fixations",
    "post /follows",
    "post /loop",
    "post /measurements",
    "post /mirrors/disable",
    "post /mirrors/enable",
    "post /mirrors/park",
    "post /mirrors/recover",
    "post /mirrors/steer",
    "post /suggestions/checks",
    "post /pan_tilt/holds",
    "post /pan_tilt/homings",
    "post /pan_tilt/moves",
    "post /pan_tilt/zero_confirmations",
    "post /rail/holds",
    "post /rail/homings",
    "post /rail/moves",
    "post /rail/zero_confirmations",
    "post /recordings",
    "post /stills",
    "post /wide_depth/surveys",
    "put /cameras/presets/wide",
    "put /loop/eyes/left",
    "put /mirrors/volts",
    "put /rig/binning",
    "put /simulation/faults",
]


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, httpx.Response]]:
    """The answer of every operation."""
    ended = threading.Event()

    def open_never(*_: object, **__: object) -> None:
        ended.wait()
        raise NotConnected("the test has ended")

    settings = Settings(data=tmp_path_factory.mktemp("data"), viewer=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(first_services, "open_rig", open_never)
        with serving(create_app(settings)) as port:
            base = f"http://127.0.0.1:{port}/api/v1"
            with httpx.Client(base_url=base, timeout=PATIENCE_S, trust_env=False) as http:
                try:
                    yield dict(asked(http))
                finally:
                    ended.set()


def asked(http: httpx.Client) -> Iterator[tuple[str, httpx.Response]]:
    for whole, operations in OPENAPI["paths"].items():
        path = whole.removeprefix("/api/v1")
        if path.startswith(LEFT_OUT) or path in ENDLESS:
            continue
        for method, operation in operations.items():
            if "{" in (url := path.format_map(_Names(NAMES))):
                continue  # about one of the things that the server keeps
            query: dict[str, Any] = {}  # Any: JSON
            for parameter in operation.get("parameters", ()):
                if parameter["in"] == "query" and parameter.get("required"):
                    query[parameter["name"]] = example(parameter["schema"])
            content = operation.get("requestBody", {}).get("content", {})
            schema = content.get("application/json", {}).get("schema")
            body = BODIES.get((method, path)) or (None if schema is None else example(schema))
            answer = http.request(method, url, params=query, json=body, headers={"Prefer": "wait=5"})
            yield f"{method} {url}", answer


class _Names(dict[str, str]):
    """Leaves names that it does not know in their braces."""

    def __missing__(self, name: str) -> str:
        return f"{{{name}}}"


def example(schema: Schema) -> object:
    """Return the smallest value that a schema takes; not all patterns are kept."""
    if "$ref" in schema:
        return example(OPENAPI["components"]["schemas"][schema["$ref"].rpartition("/")[2]])
    for several in ("anyOf", "oneOf", "allOf"):
        if several in schema:
            return example(schema[several][0])
    if "const" in schema or "enum" in schema:
        return schema.get("const", schema.get("enum", [None])[0])
    if schema.get("type") == "object":
        properties = schema.get("properties", {})
        return {name: example(properties[name]) for name in schema.get("required", ())}
    if schema.get("type") == "array":
        return [example(schema["items"])] * schema.get("minItems", 1)
    if schema.get("type") in ("integer", "number"):
        low = max(schema.get("minimum", 0), schema.get("exclusiveMinimum", 0))
        return low if schema.get("maximum", 1) < 1 else max(low, 1)
    texts = {"string": "x" * max(1, schema.get("minLength", 0)), "boolean": False}
    return texts.get(schema.get("type", ""))


@pytest.mark.parametrize("operation", NEEDING_THE_RIG)
def test_what_needs_the_rig_is_not_connected_for_now(
    operation: str, answers: dict[str, httpx.Response]
) -> None:
    answer = answers[operation]
    assert (answer.status_code, answer.json()["type"]) == (503, "/problems/not-connected"), answer.text
    assert answer.json()["remedy"] == "try again in a moment"
    assert answer.headers["retry-after"] == "2"


def test_no_other_operation_blames_the_calibration_or_fails(answers: dict[str, httpx.Response]) -> None:
    others = {name: answer for name, answer in answers.items() if name not in NEEDING_THE_RIG}
    assert len(others) > 60
    for name, answer in others.items():
        refused = answer.status_code == 409 and not any(why in answer.text for why in WITHOUT_WORK)
        assert not refused and answer.status_code < 500, (name, answer.status_code, answer.text)


def test_every_refusal_is_a_problem_document(answers: dict[str, httpx.Response]) -> None:
    refused = [answer for answer in answers.values() if answer.status_code >= 400]
    assert len(refused) > len(NEEDING_THE_RIG)
    assert {answer.headers["content-type"] for answer in refused} == {"application/problem+json"}


def test_a_device_that_is_missing_already_is_no_reason_before_the_end_of_the_start() -> None:
    problem = DeviceProblemDocument(device="left", detail="it is unplugged", remedy="plug it in")
    early, late = (RigStatus(problems=(problem,), opened=opened) for opened in (False, True))
    assert isinstance(not_open(early), StillOpening)
    assert not isinstance(not_open(late), StillOpening)
    assert "unplugged" in str(not_open(late))
