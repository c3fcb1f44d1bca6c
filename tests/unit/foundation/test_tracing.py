import logging
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import copy_context

import httpx
import pytest
from fastapi import FastAPI
from tests.support.servers.collector import Collector, collecting
from tests.support.servers.local_server import serving

from foveacam_hardware.contract import DeviceFault, InvalidInput
from foveacam_hardware.contract.spans import CURRENT_SPAN, note_span, span, untraced
from foveacam_server.doors.request_tracing import RequestIds, RequestTraces
from foveacam_server.foundation.watching import otlp, tracing
from foveacam_server.foundation.watching.tracing import Traces, open_traces

TRACE, CALLER = "0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331"
SAMPLED = {"traceparent": f"00-{TRACE}-{CALLER}-01"}


@pytest.fixture
def collector() -> Iterator[Collector]:
    with collecting() as found:
        yield found


@contextmanager
def client(collector: Collector) -> Iterator[httpx.Client]:
    """Serve the traced application; its spans are sent when the context ends."""
    with (
        open_traces(collector.endpoint) as traces,
        serving(traced(traces)) as port,
        httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as http,
    ):
        yield http


def traced(traces: Traces | None) -> FastAPI:
    """Return an application whose one route works on a thread of its own after the answer."""
    app = FastAPI()
    app.state.traces = traces
    app.add_middleware(RequestTraces)
    app.add_middleware(RequestIds)

    def work() -> None:
        with span("job fixation"), span("look", settle_us=13_000):
            note_span("queue", took_s=0.25)

    @app.post("/fixations/{name}")
    async def fixate(name: str) -> None:
        thread = threading.Thread(target=copy_context().run, args=(work,))
        thread.start()
        thread.join()

    @app.get("/rig")
    async def rig() -> bool:
        return CURRENT_SPAN.get() is not None

    return app


def test_one_trace_goes_from_the_request_to_the_other_thread(collector: Collector) -> None:
    with client(collector) as http:
        answer = http.post("/fixations/first?code=hidden")
    found = collector.wait_for("POST /fixations/{name}", "job fixation", "look", "queue")
    request, job, look, queue = found.values()
    assert collector.paths[0] == "/v1/traces"
    assert {one.trace_id for one in found.values()} == {request.trace_id}
    assert request.parent_span_id == b""
    assert job.parent_span_id == request.span_id
    assert look.parent_span_id == job.span_id
    assert queue.parent_span_id == look.span_id
    assert queue.end_time_unix_nano - queue.start_time_unix_nano == pytest.approx(250e6, rel=0.2)
    told = {one.key: one.value for one in request.attributes}
    assert told["foveacam.request_id"].string_value == answer.headers["X-Request-ID"]
    assert told["http.response.status_code"].int_value == 200
    assert {one.key: one.value.int_value for one in look.attributes} == {"settle_us": 13_000}
    assert "hidden" not in str(collector.spans)


def test_the_trace_of_the_caller_goes_on(collector: Collector) -> None:
    with client(collector) as http:
        http.post("/fixations/first", headers=SAMPLED)
    request = collector.wait_for("POST /fixations/{name}")["POST /fixations/{name}"]
    assert (request.trace_id.hex(), request.parent_span_id.hex()) == (TRACE, CALLER)


def test_a_caller_that_asks_for_no_trace_gets_none(collector: Collector) -> None:
    with client(collector) as http:
        http.post("/fixations/first", headers={"traceparent": f"00-{TRACE}-{CALLER}-00"})
    assert collector.spans == []


def test_reading_is_traced_for_who_traces_it(collector: Collector) -> None:
    with client(collector) as http:
        assert http.get("/rig", headers=SAMPLED).json() is True
        assert http.get("/rig").json() is False
    assert [one.name for one in collector.spans] == ["GET /rig"]


def test_an_error_is_told_without_its_secrets(collector: Collector) -> None:
    with open_traces(collector.endpoint) as traces:
        assert traces is not None
        root = traces.begin("POST", {}, {})
        CURRENT_SPAN.set(root)
        with pytest.raises(DeviceFault), span("look"):
            raise DeviceFault("no frame came; GET /join?code=hidden")
        root.end()
    look = collector.wait_for("look")["look"]
    assert (look.status.code, look.status.message) == (2, "no frame came; GET /join?code=***")


def test_a_long_trace_leaves_out_its_further_parts(
    collector: Collector, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracing, "SPANS_A_TRACE", 3)
    with open_traces(collector.endpoint) as traces:
        assert traces is not None
        CURRENT_SPAN.set(traces.begin("POST", {}, {}))
        with span("job capture"):
            for _ in range(5):
                with span("point"), span("look"):
                    pass
    job = collector.wait_for("job capture")["job capture"]
    assert [one.name for one in collector.spans].count("point") == 1
    assert {one.key: one.value.int_value for one in job.attributes} == {"spans_left_out": 4}


def test_what_goes_on_for_hours_is_kept_out(collector: Collector) -> None:
    with open_traces(collector.endpoint) as traces:
        assert traces is not None
        CURRENT_SPAN.set(traces.begin("POST", {}, {}))
        with untraced(), span("look"):
            assert CURRENT_SPAN.get() is None
        with span("job following"):
            pass
    collector.wait_for("job following")
    assert "look" not in {one.name for one in collector.spans}


def send_many(traces: Traces | None, count: int) -> float:
    """Make spans; return how long that took."""
    assert traces is not None
    CURRENT_SPAN.set(traces.begin("POST", {}, {}))
    began_s = time.perf_counter()
    for _ in range(count):
        with span("look"):
            pass
    return time.perf_counter() - began_s


def test_a_collector_that_refuses_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    with collecting("refuses") as collector, open_traces(collector.endpoint) as traces:
        for _ in range(3):
            send_many(traces, 600)
        collector.wait_for_request()
    told = [record.getMessage() for record in caplog.records if record.name == otlp.__name__]
    assert told == [
        f"traces are lost: {collector.endpoint}/v1/traces does not accept them; all else continues"
    ]
    assert [record for record in caplog.records if record.name.startswith("opentelemetry")] == []


@pytest.mark.parametrize("gone", [False, True], ids=["hangs", "is away"])
def test_a_collector_that_does_not_answer_delays_nothing(gone: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(otlp, "PERIOD_MS", 10.0)
    monkeypatch.setattr(tracing, "SPANS_A_TRACE", 10**9)
    with collecting("hangs") as collector:
        endpoint = "http://127.0.0.1:9" if gone else collector.endpoint
        with open_traces(endpoint) as traces:
            spent_s = send_many(traces, 3 * otlp.WAITING_SPANS)
            if not gone:
                collector.wait_for_request()
            stopping_s = time.perf_counter()
        stopping_s = time.perf_counter() - stopping_s
        waiting = [one for one in threading.enumerate() if one.name.startswith("Otel")]
        collector.release.set()
        for thread in waiting:
            thread.join(10.0)
    assert spent_s < 10.0
    assert stopping_s < otlp.STOP_S + 1.0


def test_without_an_endpoint_a_mark_does_nothing() -> None:
    with open_traces(None) as traces:
        assert traces is None
    CURRENT_SPAN.set(None)
    assert span("look", settle_us=1) is span("another")


def test_where_the_library_is_missing_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foveacam_server.foundation.watching.otlp", None)
    with pytest.raises(InvalidInput, match=r"foveacam-duo\[telemetry\]"), open_traces("http://127.0.0.1:9"):
        pass


def test_fastapi_sends_nothing_by_itself(collector: Collector, monkeypatch: pytest.MonkeyPatch) -> None:
    from foveacam_server.app import create_app
    from foveacam_server.foundation.settings import Settings

    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", collector.endpoint)
    app = create_app(Settings())
    told = vars(app)["_telemetry"]
    assert not any(told[name] for name in ("tracing", "metrics", "logs", "auto_configure"))
    assert logging.getLogger("fastapi").handlers == []
