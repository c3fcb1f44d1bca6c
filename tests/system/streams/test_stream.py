"""The views' WebSocket on a real server, fed by the test itself."""

import asyncio
import json
import time
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
from fastapi import FastAPI
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from foveacam_bench.stream.clients import StreamViewer, slow_connection
from foveacam_hardware.contract import MonotonicClock
from foveacam_server.doors import error_handlers
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.foundation.persons.person_quota import OWN_LIMIT
from foveacam_server.resources.operating.views import routes
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.schema import Direction, OverlayDocument
from foveacam_server.rig.stream import LiveStreams
from foveacam_server.rig.stream_messages import HEADER
from tests.support.servers.local_server import serving
from tests.support.servers.persons import PERSON_HEADER, install_persons

PATIENCE_S = 10.0
SOCKET = "/api/v1/views/ws"


@dataclass
class Client:
    """A viewer's end of the WebSocket; pictures that came while a text was waited for are kept."""

    connection: ClientConnection
    kept: deque[bytes] = field(default_factory=deque)

    async def recv(self) -> str | bytes:
        return self.kept.popleft() if self.kept else await self.connection.recv()

    async def send(self, message: str | bytes) -> None:
        await self.connection.send(message)


@dataclass
class Live:
    """A running server and its inside."""

    port: int
    hub: FrameHub
    streams: LiveStreams

    def publish(
        self, view: str, seq: int, *, height: int = 60, width: int = 80, meta: OverlayDocument | None = None
    ) -> None:
        image = np.random.default_rng(seq).integers(0, 256, (height, width), dtype=np.uint8)
        self.hub.publish(view, image, t_ns=time.monotonic_ns(), seq=seq, meta=meta)

    def url(self, path: str, *, scheme: str = "http") -> str:
        return f"{scheme}://127.0.0.1:{self.port}{path}"

    def get(self, path: str) -> httpx.Response:
        return httpx.get(self.url(path), trust_env=False, timeout=PATIENCE_S)

    @asynccontextmanager
    async def viewer(self, **scales: int) -> AsyncIterator["Client"]:
        async with connect(self.url(SOCKET, scheme="ws"), compression=None, proxy=None) as connection:
            socket = Client(connection)
            await text(socket, "hello")
            if scales:
                await subscribe(socket, **scales)
            yield socket


@pytest.fixture(params=[64])
def live(request: pytest.FixtureRequest) -> Iterator[Live]:
    hub = FrameHub(clock=MonotonicClock())
    streams = LiveStreams(hub, boot_id="boot-1", max_clients=request.param)
    app = FastAPI()
    hardware = SimpleNamespace(status=SimpleNamespace(opened=True))
    app.state.provided = ServiceRegistry({LiveStreams: streams, HardwareThread: hardware})
    error_handlers.install(app)
    app.include_router(routes.router, prefix="/api/v1")
    install_persons(app)
    with serving(app) as port:
        yield Live(port, hub, streams)
    streams.close()


async def subscribe(socket: Client, **scales: int) -> None:
    views_ = {view: {"scale": scale} for view, scale in scales.items()}
    await socket.send(json.dumps({"type": "subscribe", "views": views_}))
    # Answered in order: once the refusal of this nonsense is here, the subscription is in force
    await socket.send("{}")
    await text(socket, "problem")


async def text(socket: Client, kind: str) -> dict[str, Any]:  # Any: a JSON message
    """Return the next text message of a kind."""
    async with asyncio.timeout(PATIENCE_S):
        while True:
            message = await socket.connection.recv()
            if isinstance(message, bytes):
                socket.kept.append(message)
            elif json.loads(message)["type"] == kind:
                found: dict[str, Any] = json.loads(message)
                return found


@dataclass(frozen=True)
class Got:
    view: int
    scale: int
    flags: int
    seq: int
    t_us: int
    age_us: int
    jpeg: bytes

    @property
    def size(self) -> tuple[int, int]:
        picture = cv2.imdecode(np.frombuffer(self.jpeg, np.uint8), cv2.IMREAD_UNCHANGED)
        assert picture is not None
        return picture.shape[1], picture.shape[0]


async def picture(socket: Client) -> Got:
    """Return the next picture, not acknowledged."""
    async with asyncio.timeout(PATIENCE_S):
        while True:
            message = await socket.recv()
            if isinstance(message, bytes):
                view, scale, flags, seq, t_us, age_us, _binning = HEADER.unpack_from(message)
                return Got(view, scale, flags, seq, t_us, age_us, message[HEADER.size :])


async def ack(socket: Client, got: Got) -> None:
    await socket.send(json.dumps({"type": "ack", "view": got.view, "seq": got.seq}))


def play(scenario: Callable[[], Awaitable[None]]) -> None:
    async def limited() -> None:
        async with asyncio.timeout(3 * PATIENCE_S):
            await scenario()

    asyncio.run(limited())


def test_the_server_says_who_it_is_and_what_it_shows(live: Live) -> None:
    async def scenario() -> None:
        async with connect(live.url(SOCKET, scheme="ws"), proxy=None) as connection:
            socket = Client(connection)
            hello = await text(socket, "hello")
            stats = await text(socket, "stats")
        assert hello["server"] == "boot-1"
        assert [view["name"] for view in hello["views"]][:3] == ["wide", "left", "right"]
        assert hello["views"][0] == {"index": 0, "name": "wide", "width": 1440, "height": 1080}
        left = {"rate_hz": 0.0, "age_ms": None, "frozen_since_ms": None}
        assert stats["views"]["left"] == left | {"expected_hz": None, "slow_reason": None}

    play(scenario)


def test_a_subscriber_gets_the_newest_picture_at_once(live: Live) -> None:
    async def scenario() -> None:
        live.publish("left", 41)
        before_us = time.monotonic_ns() // 1000
        async with live.viewer(left=2) as socket:
            got = await picture(socket)
        assert (got.view, got.scale, got.flags, got.seq) == (1, 2, 0, 41)
        assert got.size == (40, 30)
        assert 0 <= got.t_us <= before_us
        assert got.age_us <= time.monotonic_ns() // 1000 - got.t_us

    play(scenario)


def test_without_acknowledgement_no_second_picture_and_then_the_newest(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(wide=1) as socket:
            live.publish("wide", 1)
            first = await picture(socket)
            for seq in range(2, 8):
                live.publish("wide", seq)
            # Two rounds of statistics: time enough for a picture that must not come
            kinds = [type(await socket.recv()) for _ in range(2)]
            assert kinds == [str, str]
            await ack(socket, first)
            assert (await picture(socket)).seq == 7

    play(scenario)


def test_the_wrong_acknowledgement_brings_nothing(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(wide=1) as socket:
            live.publish("wide", 1)
            first = await picture(socket)
            live.publish("wide", 2)
            await socket.send(json.dumps({"type": "ack", "view": 0, "seq": 99}))
            kinds = [type(await socket.recv()) for _ in range(2)]
            assert kinds == [str, str]
            await ack(socket, first)
            assert (await picture(socket)).seq == 2

    play(scenario)


def test_the_overlay_comes_before_its_picture(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(wide=1) as socket:
            drawn = OverlayDocument(gaze={"left": Direction(ax_deg=1.5, ay_deg=0.0)})
            live.publish("wide", 5, meta=drawn)
            overlay = await text(socket, "overlay")
            assert overlay == {"type": "overlay", "seq": 5, "gaze": {"left": {"ax_deg": 1.5, "ay_deg": 0.0}}}
            following = await socket.recv()
            assert isinstance(following, bytes)
            assert HEADER.unpack_from(following)[3] == 5

    play(scenario)


def test_a_subscription_change_takes_effect_at_once(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(wide=1) as socket:
            live.publish("wide", 1)
            await ack(socket, await picture(socket))
            await subscribe(socket, wide=2, right=1)
            assert live.hub.watched("right")
            smaller = await picture(socket)
            assert (smaller.view, smaller.scale, smaller.seq, smaller.size) == (0, 2, 1, (40, 30))
            await subscribe(socket, right=1)
            assert not live.hub.watched("wide")
            live.publish("wide", 2)
            live.publish("right", 3)
            assert (await picture(socket)).view == 2

    play(scenario)


def test_eight_viewers_cost_one_encode_a_picture_and_size(live: Live) -> None:
    async def scenario() -> None:
        async with AsyncExitStack() as stack:
            full = [await stack.enter_async_context(live.viewer(wide=1)) for _ in range(5)]
            half = [await stack.enter_async_context(live.viewer(wide=2)) for _ in range(3)]
            for seq in range(1, 11):
                live.publish("wide", seq)
                for socket in (*full, *half):
                    got = await picture(socket)
                    assert got.seq == seq
                    await ack(socket, got)
        assert live.streams.jpegs.encodes == {("wide", 1): 10, ("wide", 2): 10}

    play(scenario)


def test_a_view_that_nobody_wants_is_not_encoded(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(wide=1) as socket:
            for seq in range(1, 6):
                live.publish("left", seq)
            live.publish("wide", 1)
            await picture(socket)
        assert live.streams.jpegs.encodes == {("wide", 1): 1}

    play(scenario)


def test_a_viewer_that_never_answers_holds_nobody_up(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(wide=1), live.viewer(wide=1) as lively:
            for seq in range(1, 51):
                live.publish("wide", seq, height=1080, width=1440)
                got = await picture(lively)
                assert got.seq == seq
                await ack(lively, got)

    play(scenario)


def test_a_thin_line_shows_late_pictures_but_never_old_ones(live: Live) -> None:
    rate_hz, bytes_per_s = 20.0, 1e6

    async def scenario() -> None:
        async with slow_connection(port=live.port, bytes_per_s=bytes_per_s) as port:
            viewer = StreamViewer(f"ws://127.0.0.1:{port}{SOCKET}", {"wide": 1, "left": 2, "right": 2})
            task = asyncio.create_task(viewer.watch())
            picture_bytes, late_s = 0, []
            for seq in range(1, round(4 * rate_hz)):
                for view in ("wide", "left", "right"):
                    live.publish(view, seq, height=360, width=480)
                picture_bytes = (
                    len(live.get("/api/v1/views/wide/snapshot.jpg").content) if seq == 1 else picture_bytes
                )
                due_s = time.monotonic() + 1.0 / rate_hz
                await asyncio.sleep(1.0 / rate_hz)
                late_s.append(time.monotonic() - due_s)
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        # Published at 20 Hz the three views are more than the line carries, so that a queue would grow
        assert rate_hz * 1.5 * picture_bytes > 1.5 * bytes_per_s
        settled = viewer.arrivals[len(viewer.arrivals) // 4 :]
        assert len(settled) > 10
        # What this machine stood still makes pictures older, the line's queue does not
        age_s, stood_s = (float(np.percentile(of, 95)) for of in ([one.age_s for one in settled], late_s))
        assert age_s <= 0.5 + 5.0 * stood_s

    play(scenario)


def test_nonsense_is_answered_and_the_stream_goes_on(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(wide=1) as socket:
            for nonsense, complaint in (
                ("not json", "Invalid JSON"),
                ('{"type":"subscribe","views":{"back":{}}}', "'back'"),
                ('{"type":"subscribe","views":{"wide":{"scale":3}}}', "scale"),
                ('{"type":"ack","view":0,"seq":"1"}', "seq"),
                ('{"type":"ack","view":77,"seq":1}', "77"),
                ("x" * 5000, "4096"),
            ):
                await socket.send(nonsense)
                assert complaint in (await text(socket, "problem"))["detail"]
            live.publish("wide", 1)
            assert (await picture(socket)).seq == 1

    play(scenario)


@pytest.mark.parametrize("live", [2], indirect=True)
def test_one_viewer_too_many_is_told_so(live: Live) -> None:
    async def scenario() -> None:
        async with live.viewer(), live.viewer():
            async with connect(live.url(SOCKET, scheme="ws"), proxy=None) as third:
                with pytest.raises(ConnectionClosed) as closed:
                    await third.recv()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1013
            assert "2 places" in closed.value.rcvd.reason

    play(scenario)


def test_a_viewer_too_many_of_one_person_is_told_so_and_another_is_served(live: Live) -> None:
    async def scenario() -> None:
        live.streams.seats.most_each = 2
        async with live.viewer(), live.viewer():
            async with connect(live.url(SOCKET, scheme="ws"), proxy=None) as third:
                with pytest.raises(ConnectionClosed) as closed:
                    await third.recv()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == OWN_LIMIT
            assert closed.value.rcvd.reason.startswith("you hold 2 connections of live views")
            url, ben = live.url(SOCKET, scheme="ws"), {PERSON_HEADER: "ben"}
            async with connect(url, additional_headers=ben, proxy=None) as other:
                await text(Client(other), "hello")

    play(scenario)


def test_a_frozen_camera_is_flagged(live: Live) -> None:
    async def scenario() -> None:
        image = np.random.default_rng(0).integers(0, 256, (60, 80), dtype=np.uint8)
        live.hub.publish("wide", image, t_ns=time.monotonic_ns() - 5_000_000_000)
        async with live.viewer(wide=1) as socket:
            got = await picture(socket)
            stats = await text(socket, "stats")
        assert got.flags == 1
        assert stats["views"]["wide"]["frozen_since_ms"] >= 5000.0

    play(scenario)
