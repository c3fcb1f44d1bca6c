"""The figures of what is left of old sign-ins, on a server whose streams never end by themselves."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import httpx
import pytest
from argon2 import PasswordHasher
from fastapi import FastAPI, WebSocket
from fastapi.responses import StreamingResponse
from tests.support.servers.local_server import serving

from foveacam_bench.access import ended_sign_ins
from foveacam_bench.access.ended_sign_ins import API, STREAMS, WEBSOCKETS, ended_figures
from foveacam_bench.access.guarded import PASSWORD
from foveacam_server.accounts import passwords
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.rights import Right, UserRole
from foveacam_server.accounts.route_rights import needs
from foveacam_server.console import security
from foveacam_server.doors import error_handlers
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.operating.people import session_routes, token_routes, user_routes


@needs(Right.VIEW)
async def endless() -> StreamingResponse:
    async def parts() -> AsyncIterator[bytes]:
        while True:
            yield b"part"
            await asyncio.sleep(0.05)

    return StreamingResponse(parts())


@needs(Right.OPERATE)
async def listen(websocket: WebSocket) -> None:
    await websocket.accept()
    async for _ in websocket.iter_text():
        pass


@needs(Right.OPERATE)
async def answer() -> str:
    return "done"


@pytest.fixture
def url(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    monkeypatch.setattr(passwords, "_HASHER", PasswordHasher(time_cost=1, memory_cost=64))
    app = FastAPI()
    error_handlers.install(app)
    gate = security.install(app, Settings())
    for path in STREAMS:
        app.add_api_route(path, endless, methods=["GET"])
    for path in WEBSOCKETS:
        app.add_api_websocket_route(path, listen)
    app.add_api_route(f"{API}/rig", answer, methods=["GET"])
    app.add_api_route(f"{API}/stop", answer, methods=["POST"])
    for module in (session_routes, user_routes, token_routes):
        app.include_router(module.router, prefix=API)
    with Store(tmp_path) as store:
        accounts = Accounts(store)
        accounts.users.add("ada", UserRole.ADMIN, password=PASSWORD)
        gate.accounts = accounts
        app.state.provided = ServiceRegistry({Accounts: accounts})
        with serving(app) as port:
            yield f"http://127.0.0.1:{port}"
        accounts.close()


@pytest.fixture
def admin(url: str) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=url, trust_env=False) as found:
        body = {"name": "ada", "password": PASSWORD}
        assert found.post(f"{API}/session", json=body).status_code == 200
        yield found


def test_nothing_is_left_after_a_link_a_new_password_a_removal_or_a_disabling(
    url: str, admin: httpx.Client
) -> None:
    figures = ended_figures(url, admin)
    assert figures["sessions_alive_after_reset_which"] == []
    assert figures["sessions_tried_after_reset"] == 24


def test_what_is_left_alive_is_found(url: str, admin: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Accounts, "sign_out_user", lambda *_names, **_keep: None)
    monkeypatch.setattr(ended_sign_ins, "LONGEST_S", 0.1)
    monkeypatch.setattr(ended_sign_ins, "_CHANGES", {"a used link": ended_sign_ins._use_link})
    figures = ended_figures(url, admin)
    assert figures["sessions_alive_after_reset"] == figures["sessions_tried_after_reset"] == 6
