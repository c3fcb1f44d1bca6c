"""Measure the cost of a trace's spans, without and with a collector, and how long it delays the stop.

The collector is the worst one: it accepts the connection and never answers.
"""

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager

from foveacam_bench.figures import Figures
from foveacam_hardware.contract.spans import CURRENT_SPAN, Span, span
from foveacam_server.foundation.watching import otlp, tracing
from foveacam_server.foundation.watching.tracing import open_traces

MARKS, QUICK_MARKS = 200_000, 20_000
REPETITIONS = 5
RECORDED = tracing.SPANS_A_TRACE - 1
"""Number of spans of one trace that are sent."""


def run(*, quick: bool = False) -> Figures:
    """Measure and return the figures; a few seconds."""
    count = QUICK_MARKS if quick else MARKS
    with _part_of(None):
        off_ns = _mark_ns(count)
    with _silent_collector() as endpoint:
        with open_traces(endpoint) as traces:
            if traces is None:
                raise AssertionError("an endpoint gives traces")
            on_ns = min(_traced_ns(traces.begin("POST", {}, {})) for _ in range(REPETITIONS))
            began_s = time.perf_counter()
        stop_ms = 1e3 * (time.perf_counter() - began_s)
    return {
        "mark_off_ns": off_ns,
        "mark_on_ns": on_ns,
        "spans_kept": otlp.WAITING_SPANS,
        "stop_with_silent_collector_ms": stop_ms,
    }


def _mark_ns(count: int) -> float:
    """Return the time of one span, in the fastest of several runs."""
    return min(_run_ns(count) for _ in range(REPETITIONS))


def _run_ns(count: int) -> float:
    began_ns = time.perf_counter_ns()
    for _ in range(count):
        with span("look", settle_us=13_000):
            pass
    return (time.perf_counter_ns() - began_ns) / count


def _traced_ns(root: Span) -> float:
    with _part_of(root):
        return _run_ns(RECORDED)


@contextmanager
def _part_of(root: Span | None) -> Iterator[None]:
    token = CURRENT_SPAN.set(root)
    try:
        yield
    finally:
        CURRENT_SPAN.reset(token)


@contextmanager
def _silent_collector() -> Iterator[str]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
