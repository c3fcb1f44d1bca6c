"""ASGI middleware: compresses pages and large JSON documents by gzip.

Files are compressed where they are served (`console/static_files.py`). Pictures, streams, events, downloads,
parts of files and answers with an ETag are not compressed; nor are small documents and answers to changes,
which may contain a secret beside text of the request, so that the compressed length would reveal it (BREACH).
"""

import gzip
from functools import lru_cache

from anyio import to_thread
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_SMALLEST_BYTES = {"application/json": 4096, "text/html": 1024}
"""Least size of compressed answers by media type; other types are never compressed."""
_KEPT_BYTES = 100_000
"""Size from which compressed pages are cached: that of the 3D pane has 0.8 MB, and they do not change."""
_PAGES = 4
_LEVEL = 6
_BESIDE_BYTES = 64 * 1024
"""Size from which an answer is compressed on a thread instead of the event loop."""


class CompressedAnswers:
    """ASGI middleware that compresses whole answers for clients that accept gzip."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] == "http" and scope["method"] == "GET" and accepts_gzip(Headers(scope=scope)):
            send = _Compressor(send).send
        await self._app(scope, receive, send)


class _Compressor:
    """Sends one answer, compressed if it qualifies."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self._start: Message | None = None
        """The held-back start message of an answer that qualifies, until its body comes."""

    async def send(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            if _qualifies(message):
                self._start = message
                return
        elif message["type"] == "http.response.body" and self._start is not None:
            start, self._start = self._start, None
            if not message.get("more_body", False):
                message = await _compressed(start, message.get("body", b""))
            await self._send(start)
        await self._send(message)


def accepts_gzip(headers: Headers) -> bool:
    """Return whether a request accepts gzip."""
    for part in headers.get("accept-encoding", "").split(","):
        name, _, weight = part.partition(";")
        if name.strip().lower() == "gzip":
            return weight.replace(" ", "") not in {"q=0", "q=0.0", "q=0.00", "q=0.000"}
    return False


def _qualifies(start: Message) -> bool:
    headers = Headers(raw=start["headers"])
    smallest = _SMALLEST_BYTES.get(headers.get("content-type", "").partition(";")[0])
    if start["status"] != 200 or smallest is None:
        return False
    if any(name in headers for name in ("content-encoding", "etag", "set-cookie")):
        return False
    return int(headers.get("content-length", 0)) >= smallest


async def _compressed(start: Message, body: bytes) -> Message:
    """Compress a whole body, and change the headers of its beginning accordingly; return its message."""
    headers = MutableHeaders(raw=start["headers"])
    page = headers["content-type"].startswith("text/html") and len(body) >= _KEPT_BYTES
    pack = _packed_page if page else _packed
    packed = await to_thread.run_sync(pack, body) if len(body) >= _BESIDE_BYTES else pack(body)
    headers["Content-Encoding"] = "gzip"
    headers["Content-Length"] = str(len(packed))
    headers.add_vary_header("Accept-Encoding")
    start["headers"] = headers.raw
    return {"type": "http.response.body", "body": packed}


def _packed(body: bytes) -> bytes:
    return gzip.compress(body, _LEVEL, mtime=0)


_packed_page = lru_cache(maxsize=_PAGES)(_packed)
