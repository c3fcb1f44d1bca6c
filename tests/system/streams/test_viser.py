"""The 3D pane through our own origin: viser behind the relay and the guard, spoken to as a browser would."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import Any

import httpx
import msgspec
import pytest
import zstandard
from fastapi import FastAPI
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Origin, Subprotocol

from foveacam_server.console import security, viser_relay
from foveacam_server.doors import error_handlers
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.foundation.persons.person_quota import ServerPlaces
from foveacam_server.foundation.settings import Settings
from foveacam_server.rig.ports import SceneViewer
from foveacam_web.scene import ViewerScene
from foveacam_web.scene_values import FixationDrawing
from foveacam_web.viser_page import viser_subprotocol
from tests.support.servers.local_server import serving

PATIENCE_S = 10.0


def show(scene: ViewerScene, name: str) -> None:
    point = (0.0, 0.0, 3.0)
    drawing = FixationDrawing(label=name, point_rig_m=point, distance_m=3.0, distance_sigma_m=0.02)
    scene.show_fixation(name, drawing)


@pytest.fixture
def scene() -> Iterator[ViewerScene]:
    with ViewerScene() as opened:
        yield opened


def application(viewer: ViewerScene | None) -> FastAPI:
    app = FastAPI()
    app.state.provided = ServiceRegistry({SceneViewer | None: viewer})
    app.state.places = ServerPlaces()
    error_handlers.install(app)
    security.install(app, Settings())
    app.include_router(viser_relay.router)
    return app


@pytest.fixture
def port(scene: ViewerScene) -> Iterator[int]:
    with serving(application(scene)) as served:
        yield served


@asynccontextmanager
async def browser(
    port: int, *, path: str = "/viser", version: str | None = None, origin: str | None = None
) -> AsyncIterator[ClientConnection]:
    async with connect(
        f"ws://127.0.0.1:{port}{path}",
        subprotocols=[Subprotocol(version or viser_subprotocol())],
        origin=Origin(origin or f"http://127.0.0.1:{port}"),
        compression=None,
        max_size=None,
        proxy=None,
    ) as socket:
        yield socket


def unpacked(data: bytes) -> list[dict[str, Any]]:  # Any: viser's messages
    """Return viser's messages: two lengths of 8 bytes, then msgpack in zstd, then arrays."""
    size, packed_size = (int.from_bytes(data[start : start + 8], "little") for start in (0, 8))
    payload = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed_size], max_output_size=size)
    found: list[dict[str, Any]] = msgspec.msgpack.decode(payload)["messages"]
    return found


async def read_until(socket: ClientConnection, name: str) -> list[dict[str, Any]]:
    """Return all messages up to one about the scene node `name`."""
    messages: list[dict[str, Any]] = []
    async with asyncio.timeout(PATIENCE_S):
        while not any(message.get("name") == name for message in messages):
            data = await socket.recv()
            assert isinstance(data, bytes)
            messages += unpacked(data)
    return messages


def test_the_page_is_viser_s_own_and_never_cached(port: int) -> None:
    answer = httpx.get(
        f"http://127.0.0.1:{port}/viser", follow_redirects=True, trust_env=False, timeout=PATIENCE_S
    )
    assert answer.url.path == "/viser/"
    assert answer.headers["cache-control"] == "no-store"
    assert "document.hasFocus" in answer.text
    assert 'id="root"' in answer.text
    assert "frame-src 'self'" in answer.headers["content-security-policy"]


def test_inside_the_console_the_page_shows_no_second_copy_of_the_views(port: int) -> None:
    answer = httpx.get(f"http://127.0.0.1:{port}/viser/?embedded=1", trust_env=False, timeout=PATIENCE_S)
    assert "frame-src 'none'" in answer.headers["content-security-policy"]


@pytest.mark.parametrize("path", ["/viser", "/viser/"])
def test_a_late_viewer_sees_everything(scene: ViewerScene, port: int, path: str) -> None:
    show(scene, "fix-1")
    show(scene, "fix-2")
    scene.remove_fixation("fix-1")

    async def scenario() -> None:
        async with browser(port, path=path) as socket:
            assert socket.subprotocol == viser_subprotocol()
            messages = await read_until(socket, "/fixations/fix-2/label")
            names = {message.get("name") for message in messages}
            assert "/floor" in names
            assert "/fixations/fix-1/label" not in names
            texts = [message["props"]["text"] for message in messages if message["type"] == "LabelMessage"]
            assert "fix-2  3.00 ± 0.02 m" in texts

    asyncio.run(scenario())


def test_what_comes_later_reaches_a_viewer(scene: ViewerScene, port: int) -> None:
    async def scenario() -> None:
        async with browser(port) as socket:
            await read_until(socket, "/floor")
            await asyncio.to_thread(show, scene, "fix-9")
            await read_until(socket, "/fixations/fix-9/label")

    asyncio.run(scenario())


def test_a_viewers_request_for_a_public_tunnel_is_refused(
    scene: ViewerScene, port: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    opened = threading.Event()

    def tunnel(*_args: object) -> None:
        opened.set()

    monkeypatch.setattr("viser._viser.ViserTunnel", tunnel)

    async def scenario() -> None:
        async with browser(port) as socket:
            await read_until(socket, "/floor")
            await socket.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
            async with asyncio.timeout(PATIENCE_S):
                while "share tunnel" not in caplog.text:  # noqa: ASYNC110  # a log has no event to wait for
                    await asyncio.sleep(0.01)

    asyncio.run(scenario())
    assert not opened.is_set()


def test_a_foreign_page_gets_no_relay(port: int) -> None:
    async def scenario() -> None:
        async with browser(port, origin="http://evil.example"):
            pytest.fail("connected")

    with pytest.raises(InvalidStatus) as refused:
        asyncio.run(scenario())
    assert refused.value.response.status_code == 403


def test_a_page_of_another_viser_version_is_told_to_reload(port: int) -> None:
    async def scenario() -> None:
        async with browser(port, version="viser-v0.0.1") as socket:
            await socket.recv()

    with pytest.raises(ConnectionClosed) as closed:
        asyncio.run(scenario())
    assert closed.value.rcvd is not None
    assert (closed.value.rcvd.code, "reload" in closed.value.rcvd.reason) == (1002, True)


def test_when_the_pane_stops_its_viewers_are_told(scene: ViewerScene, port: int) -> None:
    async def scenario() -> None:
        async with browser(port) as socket:
            await read_until(socket, "/floor")
            await asyncio.to_thread(scene.stop)
            async with asyncio.timeout(PATIENCE_S):
                while True:
                    await socket.recv()

    with pytest.raises(ConnectionClosed) as closed:
        asyncio.run(scenario())
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1001


def test_the_server_stops_at_once_while_somebody_watches(scene: ViewerScene) -> None:
    watching, left = threading.Event(), threading.Event()

    async def watch(served: int) -> None:
        async with browser(served) as socket:
            await read_until(socket, "/floor")
            watching.set()
            try:
                while True:
                    await socket.recv()
            except ConnectionClosed:
                left.set()

    with serving(application(scene)) as served:
        viewer = threading.Thread(target=lambda: asyncio.run(watch(served)))
        viewer.start()
        assert watching.wait(PATIENCE_S)
        begun_s = time.monotonic()
    assert time.monotonic() - begun_s < 5.0
    assert left.wait(PATIENCE_S)
    viewer.join()


def test_without_the_pane_the_page_says_so() -> None:
    with serving(application(None)) as served:
        answer = httpx.get(f"http://127.0.0.1:{served}/viser/", trust_env=False, timeout=PATIENCE_S)
        assert answer.status_code == 503
        assert answer.json()["type"] == "/problems/not-connected"

        async def scenario() -> None:
            async with browser(served) as socket:
                await socket.recv()

        with pytest.raises(ConnectionClosed) as closed:
            asyncio.run(scenario())
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1013
