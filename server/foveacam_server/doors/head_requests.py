"""HEAD wherever GET is served: the headers of GET, no body, and streams that are closed before they begin."""

from starlette.types import ASGIApp, Message, Receive, Scope, Send


class HeadRequests:
    """ASGI middleware: asks for a GET, sends its headers alone, and lets nothing of the rest be made."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return

        async def send_headers(message: Message) -> None:
            await send(message)
            if message["type"] == "http.response.start":
                await send({"type": "http.response.body", "body": b"", "more_body": False})
                raise _HeadersSent

        try:
            await self._app({**scope, "method": "GET"}, receive, send_headers)
        except* _HeadersSent:
            pass  # from within a task group of a stream, or alone


class _HeadersSent(Exception):
    """What a GET would go on with is not asked for."""
