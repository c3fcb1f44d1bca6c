"""A collector of traces on this machine: takes OTLP over HTTP, refuses it, or never answers."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Literal

from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.proto.trace.v1.trace_pb2 import Span

Behaviour = Literal["takes", "refuses", "hangs"]
PATIENCE_S = 20.0


@dataclass
class Collector:
    """What has come, and how it answers."""

    behaviour: Behaviour
    port: int = 0
    paths: list[str] = field(default_factory=list)
    spans: list[Span] = field(default_factory=list)
    changed: threading.Condition = field(default_factory=threading.Condition)
    release: threading.Event = field(default_factory=threading.Event)

    @property
    def endpoint(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def wait_for(self, *names: str) -> dict[str, Span]:
        """Return the first span of each name once all have come."""
        with self.changed:
            done = self.changed.wait_for(
                lambda: set(names) <= {span.name for span in self.spans}, timeout=PATIENCE_S
            )
            assert done, f"wanted {names}, came {[span.name for span in self.spans]}"
            return {name: next(span for span in self.spans if span.name == name) for name in names}

    def wait_for_request(self) -> None:
        with self.changed:
            assert self.changed.wait_for(lambda: bool(self.paths), timeout=PATIENCE_S)

    def take(self, path: str, body: bytes) -> None:
        request = ExportTraceServiceRequest.FromString(body)
        with self.changed:
            self.paths.append(path)
            for resource in request.resource_spans:
                for scope in resource.scope_spans:
                    self.spans.extend(scope.spans)
            self.changed.notify_all()


@contextmanager
def collecting(behaviour: Behaviour = "takes") -> Iterator[Collector]:
    """Be a collector until the context ends."""
    found = Collector(behaviour)

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            found.take(self.path, self.rfile.read(int(self.headers["Content-Length"])))
            if found.behaviour == "hangs":
                found.release.wait(PATIENCE_S)
            self.send_response(400 if found.behaviour == "refuses" else 200)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    found.port = server.server_address[1]
    thread = threading.Thread(target=server.serve_forever, name="collector", daemon=True)
    thread.start()
    try:
        yield found
    finally:
        found.release.set()
        server.shutdown()
        thread.join()
        server.server_close()
