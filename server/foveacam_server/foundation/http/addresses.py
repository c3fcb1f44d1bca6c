"""Addresses of servers: checks a given one, and joins a path to it.

A server may live below a path of a site (`--root-path`), so nothing else joins an address and a path.
"""

from urllib.parse import urlsplit, urlunsplit

from foveacam_hardware.contract import InvalidInput

EXAMPLE = "http://127.0.0.1:8000"


def server_address(given: str) -> str:
    """Return the address of a server, `http[s]://HOST[:PORT][/PATH]`, without a trailing slash.

    Raise `InvalidInput` for anything else.
    """
    try:
        parts = urlsplit(given.strip())
        named = parts.hostname and parts.port != 0
    except ValueError as error:  # port not a number, unclosed brackets
        raise _no_address(given, str(error)) from error
    if parts.scheme not in ("http", "https") or not named:
        raise _no_address(given, "it names no host by http:// or https://")
    if parts.query or parts.fragment:
        raise _no_address(given, "it has a query or a fragment")
    return urlunsplit((parts.scheme, parts.netloc, parts.path.rstrip("/"), "", ""))


def join_address(address: str, path: str) -> str:
    """Return the address of `path`, which may have a query, at the server or origin `address`."""
    return f"{address.rstrip('/')}/{path.lstrip('/')}"


def websocket_address(address: str, path: str) -> str:
    """Return the address of the WebSocket `path` at the server `address`: ws for http, wss for https."""
    return f"ws{join_address(address, path).removeprefix('http')}"


def _no_address(given: str, why: str) -> InvalidInput:
    return InvalidInput(
        f"{given!r} is no address of a server: {why}",
        asked=given,
        found=why,
        remedy=f"give the address that a browser opens it by, such as {EXAMPLE}",
    )
