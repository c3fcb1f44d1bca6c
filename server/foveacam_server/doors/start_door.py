"""Answers requests while the program's modules are imported: a page that reloads itself, or 503.

It needs only the standard library, so that it answers within a second. The server takes over the listening
socket; connections not accepted yet wait in it.
"""

import json
import selectors
import socket
import ssl
import threading
from base64 import b64encode
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from hashlib import sha256
from types import TracebackType
from typing import Self

from foveacam_server.doors.listening_socket import listen, tls_context
from foveacam_server.foundation.settings import Settings

RENEWED_S = 1
"""Time after which the page reloads itself and a program retries, s."""
REQUEST_S = 1.0
"""Timeout of a request, after which it is not answered."""
REQUEST_BYTES = 16 * 1024
WORKERS = 4
LOADING = "the program is being loaded"

_SCRIPT = f"setTimeout(() => location.reload(), {1000 * RENEWED_S})"
_SCRIPT_HASH = b64encode(sha256(_SCRIPT.encode()).digest()).decode()
_POLICY = "; ".join(
    [
        "default-src 'none'",
        "style-src 'unsafe-inline'",
        f"script-src 'sha256-{_SCRIPT_HASH}'",
        "frame-ancestors 'none'",
    ]
)
"""The script reloads the page with the part of its address behind #, which a refresh by HTML alone takes for
a step within the page; without scripts that part is dropped."""
_PAGE = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>FoveaCam Duo starts</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<script>{_SCRIPT}</script>
<noscript><meta http-equiv="refresh" content="{RENEWED_S}; url=?"></noscript>
<style>
:root {{ color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif; }}
body {{ display: grid; place-items: center; align-content: center; min-height: 100vh; margin: 0;
  background: light-dark(#eef0f3, #0d1014); color: light-dark(#171c22, #e4e8ed); }}
main {{ display: grid; gap: .75rem; box-sizing: border-box; width: min(26rem, 88vw); padding: 1.5rem;
  border-radius: .5rem; border: 1px solid light-dark(#d5dae1, #2a323c);
  background: light-dark(#ffffff, #151a20); }}
h1 {{ font-size: 1.25rem; margin: 0; }}
ol {{ display: grid; gap: .25rem; margin: 0; padding: 0; list-style: none; }}
.now {{ color: light-dark(#8a5a00, #f0b84d); }}
p, .next {{ margin: 0; color: light-dark(#525d6b, #97a3b1); }}
</style></head>
<body><main role="status"><h1>FoveaCam Duo starts</h1>
<ol><li class="now">◐ Program: being loaded</li>
<li class="next">○ Rig file, calibration</li><li class="next">○ Renderer, mirrors, cameras</li></ol>
<p>The console opens here by itself. __HINT__</p></main></body></html>
"""
_SIMULATED = "The first start of a simulated rig compiles its renderer, which takes about half a minute."


class StartDoor:
    """Listens during the context; each connection is answered once and closed."""

    def __init__(self, settings: Settings) -> None:
        """Raise `Busy` or `InvalidInput` where the server cannot listen, as `listen` and `tls_context`."""
        self.tls = tls_context(settings.tls_cert, settings.tls_key)
        """For https; None for plain http."""
        simulated = settings.rig == "sim" and settings.replay is None
        self._page = _PAGE.replace("__HINT__", _SIMULATED if simulated else "")
        self._listener = listen(settings.host, settings.port)
        self._wake, self._woken = socket.socketpair()
        self._workers = ThreadPoolExecutor(WORKERS, "foveacam-start-door")
        self._thread = threading.Thread(target=self._run, name="foveacam-start-door", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.hand_over()
        self._listener.close()

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._listener.getsockname()[1])

    @property
    def listener(self) -> socket.socket:
        """The listening socket, which the context closes."""
        return self._listener

    def hand_over(self) -> None:
        """Accept no more connections; callable from any thread, idempotent."""
        if not self._thread.is_alive():
            return
        self._wake.send(b"x")
        self._thread.join()
        self._workers.shutdown(wait=False)
        self._wake.close()
        self._woken.close()

    def _run(self) -> None:
        with selectors.DefaultSelector() as selector:
            selector.register(self._listener, selectors.EVENT_READ)
            selector.register(self._woken, selectors.EVENT_READ)
            while not any(key.fileobj is self._woken for key, _ in selector.select()):
                with suppress(OSError):  # the client has left, or too many files are open
                    self._workers.submit(self._serve, self._listener.accept()[0])

    def _serve(self, connection: socket.socket) -> None:
        with suppress(OSError):  # the client has left, or sends nothing
            connection.settimeout(REQUEST_S)
            with connection if self.tls is None else self._encrypted(connection) as opened:
                if (request := _read_head(opened)) is not None:
                    opened.sendall(self._answer(request))

    def _encrypted(self, connection: socket.socket) -> ssl.SSLSocket:
        if self.tls is None:
            raise AssertionError("called for https alone")
        try:
            return self.tls.wrap_socket(connection, server_side=True)
        except OSError:
            connection.close()
            raise

    def _answer(self, head: str) -> bytes:
        """Return the whole answer to a request's head."""
        method, _, path = head.partition("\r\n")[0].rpartition(" ")[0].partition(" ")
        path = path.partition("?")[0]
        if path.endswith("/healthz"):
            return _response(method, 200, "application/json", json.dumps({"status": "ok"}))
        if path.endswith("/readyz"):
            problems = [{"device": "server", "detail": LOADING}]
            body = {"ready": False, "problems": problems, "start": None}
            return _response(method, 503, "application/json", json.dumps(body))
        if method == "GET" and "text/html" in head:
            return _response(method, 503, "text/html; charset=utf-8", self._page)
        return _response(method, 503, "application/problem+json", _problem(path))


def _read_head(connection: socket.socket) -> str | None:
    """Return the head of a request; None on timeout or when it is too long."""
    read = b""
    while b"\r\n\r\n" not in read:
        if len(read) > REQUEST_BYTES or not (more := connection.recv(4096)):
            return None
        read += more
    return read.partition(b"\r\n\r\n")[0].decode("latin-1")


def _problem(path: str) -> str:
    return json.dumps(
        {
            "type": "/problems/not-connected",
            "title": "Not connected",
            "status": 503,
            "detail": f"{LOADING}; try again in a moment",
            "instance": path,
            "found": LOADING,
            "remedy": "try again in a moment",
        }
    )


def _response(method: str, status: int, media_type: str, text: str) -> bytes:
    body = text.encode()
    reason = "OK" if status == 200 else "Service Unavailable"
    head = [
        f"HTTP/1.1 {status} {reason}",
        f"Content-Type: {media_type}",
        f"Content-Length: {len(body)}",
        "Cache-Control: no-store",
        f"Content-Security-Policy: {_POLICY}",
        "X-Content-Type-Options: nosniff",
        *([] if status == 200 else [f"Retry-After: {RENEWED_S}"]),
        "Connection: close",
    ]
    return "\r\n".join([*head, "", ""]).encode() + (b"" if method == "HEAD" else body)
