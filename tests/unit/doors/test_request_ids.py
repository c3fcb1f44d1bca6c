import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import pytest
from fastapi import FastAPI, WebSocket
from tests.support.servers.local_server import serving
from websockets.sync.client import connect

from foveacam_hardware.contract import InvalidInput
from foveacam_server.doors import error_handlers
from foveacam_server.doors.request_tracing import RequestIds
from foveacam_server.foundation.watching.work_ids import REQUEST_HEADER, REQUEST_ID


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()
    error_handlers.install(app)
    app.add_middleware(RequestIds)

    @app.get("/at_once")
    async def at_once() -> str | None:
        return REQUEST_ID.get()

    @app.get("/on_a_thread")
    def on_a_thread() -> str | None:
        return REQUEST_ID.get()

    @app.post("/refused")
    async def refused() -> None:
        raise InvalidInput("no")

    @app.get("/broken")
    async def broken() -> None:
        raise ZeroDivisionError("nobody foresaw it")

    @app.websocket("/socket")
    async def socket(socket: WebSocket) -> None:
        await socket.accept()
        await socket.send_text(REQUEST_ID.get() or "")
        await socket.close()

    return app


@contextmanager
def client(app: FastAPI) -> Iterator[httpx.Client]:
    with serving(app) as port, httpx.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as http:
        yield http


@pytest.mark.parametrize("path", ["/at_once", "/on_a_thread"])
def test_a_request_and_its_answer_have_one_id(app: FastAPI, path: str) -> None:
    with client(app) as http:
        found, again = http.get(path), http.get(path)
    assert re.fullmatch(r"req-[0-9a-f]{10}", found.headers[REQUEST_HEADER])
    assert found.json() == found.headers[REQUEST_HEADER] != again.headers[REQUEST_HEADER]


def test_a_safe_id_of_the_client_is_kept(app: FastAPI) -> None:
    with client(app) as http:
        found = http.get("/at_once", headers={REQUEST_HEADER: "proxy-7.a_B"})
    assert found.json() == found.headers[REQUEST_HEADER] == "proxy-7.a_B"


@pytest.mark.parametrize("asked", ["", "a b", "x" * 65, "-rf", "a\tb", "é", '"quoted"', "a;b", "%0a"])
def test_any_other_id_is_replaced(app: FastAPI, asked: str) -> None:
    with client(app) as http:
        found = http.get("/at_once", headers={REQUEST_HEADER.encode(): asked.encode()})
    assert found.headers[REQUEST_HEADER].startswith("req-")


def test_a_refused_and_a_failed_request_have_theirs(app: FastAPI, caplog: pytest.LogCaptureFixture) -> None:
    ids = {REQUEST_HEADER: "mine"}
    with client(app) as http:
        assert http.post("/refused", headers=ids).headers[REQUEST_HEADER] == "mine"
        assert http.get("/nowhere", headers=ids).headers[REQUEST_HEADER] == "mine"
        broken = http.get("/broken", headers=ids)
    assert (broken.status_code, broken.headers[REQUEST_HEADER]) == (500, "mine")


def test_a_websocket_has_one(app: FastAPI) -> None:
    with serving(app) as port, connect(f"ws://127.0.0.1:{port}/socket") as socket:
        assert socket.response is not None
        assert socket.recv() == socket.response.headers[REQUEST_HEADER]


def test_changes_are_logged_without_their_query(app: FastAPI, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO), client(app) as http:
        http.get("/at_once")
        http.post("/refused?code=hidden")
        http.post("/a%0Ab")
    told = [record.getMessage() for record in caplog.records if record.name.startswith("foveacam")]
    assert [re.sub(r"[\d.]+ ms", "N ms", line) for line in told] == [
        "POST /refused: 422 after N ms",
        "POST /a%0Ab: 404 after N ms",
    ]
