"""One trace from the click to the answer, on a whole server with a simulated rig."""

import time
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
from opentelemetry.proto.trace.v1.trace_pb2 import Span

from tests.support.scenes.marker_room import make_grey
from tests.support.servers.capture_plans import begin, plan
from tests.support.servers.collector import Collector, collecting
from tests.support.servers.running_server import CENTRE, PATIENCE_S, Running, running

TRACE, CALLER = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"

FLAT = {**CENTRE, "depth": False}
LONGEST_END_S = 8.0
"""A server that parks its mirrors ends within five seconds, on a busy machine."""


@pytest.fixture(scope="module")
def collector() -> Iterator[Collector]:
    with collecting() as found:
        yield found


@pytest.fixture(scope="module")
def until_end() -> Iterator[ExitStack]:
    """What runs until the file ends, or until a test ends it."""
    with ExitStack() as found:
        yield found


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory, collector: Collector, until_end: ExitStack) -> Running:
    data = tmp_path_factory.mktemp("data")
    found = until_end.enter_context(running(data, otlp_endpoint=collector.endpoint))
    rig = found.rig
    found.services.hardware.submit(lambda _: make_grey(rig)).result(PATIENCE_S)
    return found


def above(span: Span, spans: list[Span]) -> list[str]:
    """Return the names from a span's parent up to the request's span."""
    by_id = {one.span_id: one for one in spans}
    names = []
    while (span := by_id.get(span.parent_span_id, span)).name not in names:
        names.append(span.name)
    return names


def test_a_click_is_one_trace_from_the_request_to_its_shape(server: Running, collector: Collector) -> None:
    caller = {"traceparent": f"00-{TRACE}-{CALLER}-01", "Prefer": "wait=60"}
    answer = server.post("/fixations", CENTRE, **caller)
    assert answer.status_code == 200, answer.text
    request = "POST /fixations"
    names = (request, "job fixation", "verge", "queue", "look", "mirrors move, settle, expose", "frames")
    found = collector.wait_for(*names, "match", "answer", "shape", "depth", "job queue")
    spans = [one for one in collector.spans if one.trace_id.hex() == TRACE]
    assert found[request].parent_span_id.hex() == CALLER
    assert {name for name, one in found.items() if one.trace_id.hex() != TRACE} == set()
    assert above(found["look"], spans)[-3:] == ["verge", "job fixation", request]
    assert above(found["mirrors move, settle, expose"], spans)[:1] == ["look"]
    assert above(found["frames"], spans)[:1] == ["look"]
    assert "verge" in above(found["match"], spans) and "verge" in above(found["queue"], spans)
    assert above(found["depth"], spans) == ["shape", "answer", "job fixation", request]
    looks = [one for one in spans if one.name == "look"]
    assert len(looks) == len(answer.json()["steps"])
    job = {one.key: one.value.string_value for one in found["job fixation"].attributes}
    assert job["foveacam.job_id"] == answer.json()["job_id"]


def test_a_capture_has_a_part_for_each_point_and_a_recording_few(
    server: Running, collector: Collector
) -> None:
    _, job = begin(server, "traced", plan(columns=2, rows=2))
    server.ended(job)
    taken = collector.wait_for("job capture", "point")
    trace = taken["job capture"].trace_id
    points = [one for one in collector.spans if one.trace_id == trace and one.name == "point"]
    assert [one.attributes[0].value.int_value for one in points] == [0, 1, 2, 3]

    server.ended(server.post("/recordings", {"name": "traced", "duration_s": 1.0}).json())
    recorded = collector.wait_for("job recording")["job recording"]
    assert len([one for one in collector.spans if one.trace_id == recorded.trace_id]) <= 6


def test_what_the_server_does_by_itself_has_no_trace(server: Running, collector: Collector) -> None:
    roots = {one.name for one in collector.spans if not one.parent_span_id}
    assert roots <= {f"POST /{noun}" for noun in ("fixations", "captures", "recordings")}


def test_a_collector_that_answers_no_more_neither_delays_a_click_nor_the_end(
    server: Running, collector: Collector, until_end: ExitStack
) -> None:
    collector.behaviour = "hangs"
    collector.paths.clear()
    server.fixate(FLAT)
    collector.wait_for_request()
    assert server.fixate(FLAT)["state"] == "verged"
    began_s = time.monotonic()
    until_end.close()
    assert time.monotonic() - began_s < LONGEST_END_S
