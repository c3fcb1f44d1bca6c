import asyncio
import logging
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager

import httpx
import pytest
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from foveacam_server.accounts.route_rights import RouteTable
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.console.security import SecurityMiddleware
from foveacam_server.doors.listening_socket import listen
from foveacam_server.doors.server import WatchedServer, server_config

FORWARDED = {"X-Forwarded-For": "203.0.113.7", "X-Forwarded-Proto": "https"}
UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}


async def _who(request: Request) -> Response:
    return JSONResponse([request.client.host if request.client else None, request.url.scheme])


async def _socket(websocket: WebSocket) -> None:
    await websocket.accept()
    await websocket.close()


@asynccontextmanager
async def serving(proxies: Sequence[str] = ()) -> AsyncIterator[httpx.AsyncClient]:
    routes = [Route("/who", _who, methods=["GET", "POST"]), WebSocketRoute("/socket", _socket)]
    gate = AccessRules(
        routes=RouteTable(routes), token=None, origins=frozenset(), loopback=True, hosts=frozenset()
    )
    app = Starlette(routes=routes, middleware=[Middleware(SecurityMiddleware, gate=gate)])
    server = WatchedServer(server_config(app, trusted_proxies=proxies))
    with listen("127.0.0.1", 0) as listener:
        task = asyncio.create_task(server.serve(sockets=[listener]))
        url = f"http://127.0.0.1:{listener.getsockname()[1]}"
        async with httpx.AsyncClient(base_url=url, trust_env=False, timeout=20.0) as client:
            yield client
        server.should_exit = True
        await task


@pytest.mark.parametrize(
    ("proxies", "seen"),
    [
        ((), ["127.0.0.1", "http"]),
        (("192.0.2.1",), ["127.0.0.1", "http"]),
        (("127.0.0.1",), ["203.0.113.7", "https"]),
        (("127.0.0.0/8",), ["203.0.113.7", "https"]),
    ],
)
def test_only_a_named_proxy_is_believed_who_asks(proxies: Sequence[str], seen: list[str]) -> None:
    async def ask() -> object:
        async with serving(proxies) as client:
            return (await client.get("/who", headers=FORWARDED)).json()

    assert asyncio.run(ask()) == seen


def test_a_page_by_https_is_our_own_only_behind_a_named_proxy() -> None:
    async def statuses(proxies: Sequence[str]) -> int:
        async with serving(proxies) as client:
            origin = {"Origin": str(client.base_url).rstrip("/").replace("http:", "https:")}
            return (await client.post("/who", headers=FORWARDED | origin)).status_code

    assert asyncio.run(statuses(())) == 403
    assert asyncio.run(statuses(("127.0.0.1",))) == 200


def test_a_refused_websocket_logs_no_error(caplog: pytest.LogCaptureFixture) -> None:
    async def ask() -> httpx.Response:
        async with serving() as client:
            logging.getLogger("uvicorn.error").addHandler(caplog.handler)  # uvicorn's own do not propagate
            return await client.get("/socket", headers=UPGRADE | {"Origin": "http://evil.example"})

    try:
        answer = asyncio.run(ask())
    finally:
        logging.getLogger("uvicorn.error").removeHandler(caplog.handler)

    assert (answer.status_code, answer.json()["type"]) == (403, "/problems/forbidden-origin")
    assert [record.getMessage() for record in caplog.records if record.levelno >= logging.ERROR] == []
