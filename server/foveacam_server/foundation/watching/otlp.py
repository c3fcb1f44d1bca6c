"""The pipeline of traces: OpenTelemetry's SDK keeps ended spans and sends them on a thread of its own.

Nothing is made known to the whole process: what FastAPI would send by itself holds the queries of addresses.
"""

import logging
import threading
from collections.abc import Sequence

from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import ReadableSpan, TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor, SpanExporter, SpanExportResult

from foveacam_server import __version__

_log = logging.getLogger(__name__)

SERVICE = "foveacam"
TRACES_PATH = "/v1/traces"
WAITING_SPANS = 4096
"""Spans that may wait; the oldest are dropped for newer ones."""
BATCH_SPANS = 512
PERIOD_MS = 1000.0
EXPORT_S = 3.0
"""Longest time of one request to the collector, its repetitions included."""
STOP_S = 0.5
"""Longest time in which the last spans are sent when the server stops."""


class TracePipeline:
    """Sends the spans of its tracer to one collector, until closed."""

    def __init__(self, endpoint: str) -> None:
        logging.getLogger("opentelemetry").setLevel(logging.CRITICAL)  # it would log every failed attempt
        self._exporter = _ReportingExporter(endpoint)
        self._provider = TracerProvider(
            resource=Resource.create({"service.name": SERVICE, "service.version": __version__}),
            shutdown_on_exit=False,
        )
        self._provider.add_span_processor(
            BatchSpanProcessor(
                self._exporter,
                max_queue_size=WAITING_SPANS,
                max_export_batch_size=BATCH_SPANS,
                schedule_delay_millis=PERIOD_MS,
            )
        )
        self.tracer = self._provider.get_tracer(SERVICE, __version__)

    def close(self) -> None:
        """Send what waits, for `STOP_S` at most; nothing where the collector takes nothing anyway."""
        ending = threading.Thread(target=self._provider.shutdown, name="foveacam-traces", daemon=True)
        ending.start()
        ending.join(0.0 if self._exporter.failing else STOP_S)
        if ending.is_alive():
            self._exporter.shutdown()


class _ReportingExporter(SpanExporter):
    """Sends spans; logs once that the collector does not take them, and once that it takes them again."""

    def __init__(self, endpoint: str) -> None:
        url = endpoint.removesuffix("/")
        self._endpoint = url if url.endswith(TRACES_PATH) else url + TRACES_PATH
        self._exporter = OTLPSpanExporter(endpoint=self._endpoint, timeout=EXPORT_S)
        self.failing = False

    def export(self, spans: Sequence[ReadableSpan]) -> SpanExportResult:
        """Send spans."""
        result = self._exporter.export(spans)
        failed = result is not SpanExportResult.SUCCESS
        if failed and not self.failing:
            _log.warning("traces are lost: %s does not take them; all else goes on", self._endpoint)
        elif self.failing and not failed:
            _log.warning("traces are taken again by %s", self._endpoint)
        self.failing = failed
        return result

    def shutdown(self) -> None:
        """Send no more."""
        self._exporter.shutdown()  # type: ignore[no-untyped-call]  # the library gives it no types
