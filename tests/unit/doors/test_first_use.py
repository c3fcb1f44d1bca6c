"""What a first request would have to wait for is done before, or beside the event loop."""

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest
from fastapi import FastAPI, Request, routing
from starlette.routing import Match

from foveacam_server.app import create_app, prepare_routes
from foveacam_server.console import openapi_document
from foveacam_server.doors.deferred_routes import DeferredRoute, Inclusion
from foveacam_server.foundation.http.declared_routes import DeclaringRouter
from foveacam_server.foundation.settings import Settings


def test_no_route_completes_itself_at_its_first_request(monkeypatch: pytest.MonkeyPatch) -> None:
    app = create_app(Settings(viewer=False))
    prepare_routes(app)
    monkeypatch.setattr(
        routing._IncludedRouter, "_build_effective_context", lambda *_args: pytest.fail("it does so now")
    )
    scope = {"type": "http", "method": "GET", "path": "/api/v1/rig", "root_path": "", "headers": []}
    assert any(route.matches(dict(scope))[0] is not Match.NONE for route in app.router.routes)


def test_a_route_is_built_at_its_first_request_once_and_beside_the_event_loop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    router = DeclaringRouter(prefix="/greetings")

    @router.get("/{name}", summary="Greet")
    async def greet(name: str, request: Request) -> dict[str, str]:
        return {"name": name, "route": request.scope["route"].path}

    app, threads = FastAPI(openapi_url=None), list[str]()
    Inclusion(prefix="/api/v1", responses={}, max_body_size=100).add(app, router)
    build = DeferredRoute.build

    def noted(route: DeferredRoute) -> routing.APIRoute:
        threads.append(threading.current_thread().name)
        return build(route)

    monkeypatch.setattr(DeferredRoute, "build", noted)

    async def ask() -> list[httpx.Response]:
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url="http://rig") as http:
            first = await http.get("/api/v1/greetings/ada")
            return [first, await http.get("/api/v1/greetings/bob"), await http.post("/api/v1/greetings/bob")]

    first, second, refused = asyncio.run(ask())
    assert first.json() == {"name": "ada", "route": "/greetings/{name}"}
    assert second.json()["name"] == "bob"
    assert (refused.status_code, refused.headers["Allow"]) == (405, "GET")
    assert len(threads) == 1
    assert threads[0] != threading.main_thread().name


def test_two_routes_are_never_built_at_once() -> None:
    began: list[str] = []
    other_began, alone = threading.Event(), dict[str, bool]()

    class Route(routing.APIRoute):
        def __init__(self, path: str, endpoint: Callable[..., object], **its: Any) -> None:  # noqa: ANN401 - APIRoute's
            began.append(path)
            if len(began) == 2:
                other_began.set()
            alone[path] = len(began) == 2 or not other_began.wait(0.2)
            super().__init__(path, endpoint, **its)

    router = DeclaringRouter(route_class=Route)
    for name in ("ada", "bob"):
        router.add_api_route(f"/{name}", lambda: None, methods=["GET"])
    app = FastAPI(openapi_url=None)
    Inclusion(prefix="/api/v1", responses={}, max_body_size=100).add(app, router)
    routes = [route for route in app.routes if isinstance(route, DeferredRoute)]
    with ThreadPoolExecutor() as threads:
        list(threads.map(DeferredRoute.build, routes))
    assert alone == {"/api/v1/ada": True, "/api/v1/bob": True}


def test_the_document_is_built_once_and_beside_the_event_loop() -> None:
    app = FastAPI(openapi_url=None)
    threads: list[str] = []
    openapi_document.install(app, token_needed=False, root_path="")

    def build() -> dict[str, object]:
        threads.append(threading.current_thread().name)
        return {"paths": {}}

    app.openapi = build  # type: ignore[method-assign]

    async def ask() -> list[httpx.Response]:
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url="http://rig") as http:
            return list(await asyncio.gather(*(http.get("/openapi.json") for _ in range(3))))

    answers = asyncio.run(ask())
    assert [answer.json() for answer in answers] == [{"paths": {}}] * 3
    assert len(threads) == 1
    assert threads[0] != threading.main_thread().name
