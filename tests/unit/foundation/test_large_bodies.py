"""Which requests count as large bodies, against the route itself."""

import asyncio
from collections.abc import AsyncIterator

import httpx
import pytest
from fastapi import APIRouter, FastAPI, Request

from foveacam_server.foundation.http.answers import BODY_BYTES
from foveacam_server.foundation.http.large_bodies import LargeBodyRoute
from foveacam_server.foundation.persons.person_quota import ServerPlaces

SMALL, LARGE = b"[1]", b" " * BODY_BYTES + b"[1]"


@pytest.fixture
def app(monkeypatch: pytest.MonkeyPatch) -> FastAPI:
    """A route that answers how many large bodies are held while it does."""
    places = ServerPlaces()

    async def of_server(_request: Request) -> ServerPlaces:
        return places

    monkeypatch.setattr("foveacam_server.foundation.http.large_bodies.server_places", of_server)
    router = APIRouter(route_class=LargeBodyRoute)

    @router.api_route("/held", methods=["GET", "POST"])
    async def held() -> int:
        return places.large_bodies.taken

    app = FastAPI()
    app.include_router(router)
    return app


async def chunks(body: bytes) -> AsyncIterator[bytes]:
    yield body


def counted(app: FastAPI, method: str, content: bytes | AsyncIterator[bytes] | None) -> int:
    async def asking() -> int:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://server") as client:
            return int((await client.request(method, "/held", content=content)).json())

    return asyncio.run(asking())


def test_a_request_without_a_body_or_with_a_small_one_counts_as_none(app: FastAPI) -> None:
    assert counted(app, "GET", None) == 0
    assert counted(app, "POST", SMALL) == 0


def test_a_large_body_and_one_of_unknown_size_count(app: FastAPI) -> None:
    assert counted(app, "POST", LARGE) == 1
    assert counted(app, "POST", chunks(SMALL)) == 1
