"""Lets the server live below a path of a site, such as https://lab.example/foveacam/, behind a proxy.

The proxy may forward the path or strip it. Inside, and in JSON, all addresses are those of a server at a
root; those that browsers follow by themselves get the path here.
"""

import re

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

ANSWER_START = "http.response.start"
LINK = re.compile(rb'\b(href|src|action)="/(?!/)')


class RootPath:
    """ASGI middleware: removes `root` from requests, and adds it to redirects, cookies and pages."""

    def __init__(self, app: ASGIApp, *, root: str) -> None:
        self._app = app
        self._root = root

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        path: str = scope["path"]
        if path == self._root or path.startswith(f"{self._root}/"):
            path = path[len(self._root) :] or "/"
            scope = {**scope, "path": path, "raw_path": path.encode()}
        outward = _Outward(self._root, send)
        await self._app(scope, receive, outward.send)


class _Outward:
    """Sends one answer with the root added; a page is buffered until it is complete."""

    def __init__(self, root: str, send: Send) -> None:
        self._root = root
        self._send = send
        self._start: Message | None = None
        self._body = b""

    async def send(self, message: Message) -> None:
        if message["type"] == ANSWER_START:
            headers = MutableHeaders(scope=message)
            self._add_root(headers)
            if headers.get("content-type", "").startswith("text/html"):
                self._start = message
                return
        if self._start is None:
            await self._send(message)
            return
        self._body += message.get("body", b"")
        if not message.get("more_body", False):
            await self._send_page(self._start)

    async def _send_page(self, start: Message) -> None:
        body = LINK.sub(rb'\1="' + self._root.encode() + b"/", self._body)
        headers = MutableHeaders(scope=start)
        if "content-length" in headers and self._body:
            headers["content-length"] = str(len(body))
        await self._send(start)
        await self._send({"type": "http.response.body", "body": body})

    def _add_root(self, headers: MutableHeaders) -> None:
        location = headers.get("location", "")
        if location.startswith("/") and not location.startswith("//"):
            headers["location"] = self._root + location
        cookies = headers.getlist("set-cookie")
        if cookies:
            del headers["set-cookie"]
            for cookie in cookies:
                headers.append("set-cookie", re.sub(r"(?i)\bpath=/", f"Path={self._root}/", cookie))
