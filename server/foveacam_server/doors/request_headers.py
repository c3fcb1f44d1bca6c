"""ASGI middleware: normalizes the headers of a request for routes and the framework."""

import re

from starlette.types import ASGIApp, Receive, Scope, Send

_DIGITS = r"(\d{1,40})"
_ONE_RANGE = re.compile(rf"{_DIGITS}-{_DIGITS}?|-{_DIGITS}")


class RequestHeaders:
    """ASGI middleware: joins the lines of Prefer, and drops a Range not of bytes (RFC 9110, 14.2).

    The framework reads only the first line of a header, and refuses a Range that should be ignored.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] == "http":
            headers: list[tuple[bytes, bytes]] = list(scope["headers"])
            prefer = [value for name, value in headers if name == b"prefer"]
            ranges = [value for name, value in headers if name == b"range"]
            dropped = {b"prefer"} if len(prefer) > 1 else set()
            if ranges and not (len(ranges) == 1 and is_byte_range(ranges[0].decode("latin-1"))):
                dropped.add(b"range")
            if dropped:
                kept = [(name, value) for name, value in headers if name not in dropped]
                joined = [(b"prefer", b", ".join(prefer))] if b"prefer" in dropped else []
                scope = {**scope, "headers": kept + joined}
        await self._app(scope, receive, send)


def is_byte_range(text: str) -> bool:
    """Return whether a Range header names ranges of bytes, none of which ends before it begins."""
    unit, _, ranges = text.partition("=")
    if unit.strip().lower() != "bytes":
        return False
    found = [_ONE_RANGE.fullmatch(one.strip()) for one in ranges.split(",") if one.strip()]
    return bool(found) and all(
        one is not None and not (one[1] and one[2] and int(one[2]) < int(one[1])) for one in found
    )
