"""A sender of MJPEG over HTTP on loopback, that can be stopped, held, and started again on the same port."""

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType

import cv2
import numpy as np

PERIOD_S = 0.04
BOUNDARY = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n"


class MjpegServer:
    """Sends grey pictures, each brighter than the one before, at 25 Hz: so fast OpenCV takes MJPEG to be."""

    def __init__(self) -> None:
        self.sent = 0
        self._port = 0
        self._end = threading.Event()
        self._held = threading.Event()
        self._server: ThreadingHTTPServer | None = None
        self._thread: threading.Thread | None = None

    @property
    def url(self) -> str:
        """Where it sends."""
        return f"http://127.0.0.1:{self._port}/video.mjpeg"

    def start(self) -> None:
        """Begin to answer, on the port of before."""
        self._end.clear()
        self._held.clear()
        sender = self

        class Handler(BaseHTTPRequestHandler):
            """One viewer."""

            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
                self.end_headers()
                sender.send_to(self)

            def log_message(self, format: str, *args: object) -> None:
                """Say nothing."""

        self._server = ThreadingHTTPServer(("127.0.0.1", self._port), Handler)
        self._server.daemon_threads = True
        self._port = self._server.server_address[1]
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.02,), daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Close every connection, and answer nobody."""
        self._end.set()
        if self._server is not None and self._thread is not None:
            self._server.shutdown()
            self._server.server_close()
            self._thread.join()
        self._server = None

    def hold(self) -> None:
        """Send nothing more, and leave the connections open."""
        self._held.set()

    def send_to(self, viewer: BaseHTTPRequestHandler) -> None:
        """Send pictures until stopped or left."""
        due_s = time.monotonic()
        while not self._end.wait(max(0.0, due_s - time.monotonic())):
            due_s = max(due_s + PERIOD_S, time.monotonic())
            if self._held.is_set():
                continue
            picture = np.full((120, 160, 3), 40 + self.sent % 200, dtype=np.uint8)
            jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
            try:
                viewer.wfile.write(BOUNDARY % (len(jpeg), jpeg))
            except OSError:
                return
            self.sent += 1

    def __enter__(self) -> "MjpegServer":
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
