"""Export of traces: OpenTelemetry's SDK queues ended spans and sends them on a separate thread.

No global tracer is set: FastAPI's own spans would contain the queries of addresses.
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
"""Length of the queue of spans; the oldest are dropped for newer ones."""
BATCH_SPANS = 512
PERIOD_MS = 1000.0
EXPORT_S = 3.0
"""Timeout of one request to the collector, including retries."""
STOP_S = 0.5
"""Timeout of sending the last spans when the server stops."""


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
        """Send the queued spans, for `STOP_S` at most; skip that where the collector is failing."""
        ending = threading.Thread(target=self._provider.shutdown, name="foveacam-traces", daemon=True)
        ending.start()
        ending.join(0.0 if self._exporter.failing else STOP_S)
        if ending.is_alive():
            self._exporter.shutdown()


class _ReportingExporter(SpanExporter):
    """Sends spans; logs once when the collector fails, and once when it recovers."""

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
            _log.warning("traces are lost: %s does not accept them; all else continues", self._endpoint)
        elif self.failing and not failed:
            _log.warning("traces are accepted again by %s", self._endpoint)
        self.failing = failed
        return result

    def shutdown(self) -> None:
        """Stop sending."""
        self._exporter.shutdown()  # type: ignore[no-untyped-call]  # the library gives it no types
