"""Sends traces of requests and of their jobs to a collector by OTLP, and never waits for it.

OpenTelemetry's SDK is imported only when an endpoint is set (`otlp.py`).
"""

import itertools
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from opentelemetry import trace
from opentelemetry.trace import SpanKind, Status, StatusCode
from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

from foveacam_hardware.contract import InvalidInput, install_command
from foveacam_hardware.contract.spans import Attribute
from foveacam_server.foundation.watching.log_lines import without_secrets

SPANS_A_TRACE = 5000
"""Most spans of a trace, enough for a capture of a thousand points; further ones are left out."""


class TracedSpan:
    """A span of a trace; implements `Span` of the hardware's contract."""

    def __init__(self, tracer: trace.Tracer, otel: trace.Span, numbers: Iterator[int]) -> None:
        """`numbers`: counts the spans of the whole trace."""
        self._tracer, self._otel, self._numbers = tracer, otel, numbers
        self._left_out = 0

    def child(
        self, name: str, attributes: Mapping[str, Attribute], *, began_s_ago: float = 0.0
    ) -> "TracedSpan | None":
        """Begin a child span; None when the trace is not sampled or has too many spans."""
        if not self._otel.get_span_context().trace_flags.sampled:
            return None
        if next(self._numbers) >= SPANS_A_TRACE:
            self._left_out += 1
            return None
        began = self._tracer.start_span(
            name,
            context=trace.set_span_in_context(self._otel),
            attributes=attributes,
            start_time=time.time_ns() - round(1e9 * began_s_ago),
        )
        return TracedSpan(self._tracer, began, self._numbers)

    def describe(self, name: str, attributes: Mapping[str, Attribute]) -> None:
        """Set the span's name and further attributes, once they are known."""
        self._otel.update_name(name)
        self._otel.set_attributes(attributes)

    def end(self, error: BaseException | None = None) -> None:
        """End the span; an error is recorded with its class and message."""
        if self._left_out:
            self._otel.set_attribute("spans_left_out", self._left_out)
        if error is not None:
            description = without_secrets(str(error))
            self._otel.set_attribute("error.type", type(error).__name__)
            self._otel.set_status(Status(StatusCode.ERROR, description))
        self._otel.end()


class Traces:
    """Begins the traces of requests."""

    def __init__(self, tracer: trace.Tracer) -> None:
        self._tracer = tracer
        self._callers = TraceContextTextMapPropagator()

    def begin(self, name: str, headers: Mapping[str, str], attributes: Mapping[str, Attribute]) -> TracedSpan:
        """Begin the trace of a request, or continue that of its `traceparent`."""
        caller = self._callers.extract(headers)
        began = self._tracer.start_span(name, context=caller, kind=SpanKind.SERVER, attributes=attributes)
        return TracedSpan(self._tracer, began, itertools.count(1))


@contextmanager
def open_traces(endpoint: str | None) -> Iterator[Traces | None]:
    """Send traces to the collector at `endpoint` until the context ends; None: send none.

    Raise `InvalidInput` where OpenTelemetry's SDK is not installed.
    """
    if endpoint is None:
        yield None
        return
    try:
        from foveacam_server.foundation.watching.otlp import TracePipeline
    except ImportError as error:
        raise InvalidInput(
            f"traces are to be sent to {endpoint}, and OpenTelemetry is not installed",
            asked=endpoint,
            found="no OpenTelemetry",
            remedy=install_command("telemetry"),
        ) from error
    pipeline = TracePipeline(endpoint)
    try:
        yield Traces(pipeline.tracer)
    finally:
        pipeline.close()
