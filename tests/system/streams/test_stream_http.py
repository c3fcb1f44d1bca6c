"""Snapshots, the list of views and MJPEG on a real server, fed by the test itself."""

import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import cv2
import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from foveacam_hardware.contract import MonotonicClock
from foveacam_server.doors import error_handlers
from foveacam_server.doors.middleware import UncollectedStreams
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.resources.operating.views import routes
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.stream import MJPEG_EACH, LiveStreams
from tests.support.servers.local_server import serving
from tests.support.servers.nginx_proxy import nginx_before
from tests.support.servers.persons import PERSON_HEADER, install_persons

PATIENCE_S = 10.0


@dataclass
class Live:
    """A running server and where its pictures come from."""

    port: int
    hub: FrameHub

    def publish(self, view: str, seq: int, *, size: tuple[int, int] = (60, 80)) -> None:
        image = np.random.default_rng(seq).integers(0, 256, size, dtype=np.uint8)
        self.hub.publish(view, image, t_ns=time.monotonic_ns(), seq=seq)

    def url(self, path: str) -> str:
        return f"http://127.0.0.1:{self.port}{path}"

    def get(self, path: str) -> httpx.Response:
        return httpx.get(self.url(path), trust_env=False, timeout=PATIENCE_S)


@pytest.fixture
def live() -> Iterator[Live]:
    hub = FrameHub(clock=MonotonicClock())
    streams = LiveStreams(hub, boot_id="boot-1")
    app = FastAPI()
    hardware = SimpleNamespace(status=SimpleNamespace(opened=True))
    app.state.provided = ServiceRegistry({LiveStreams: streams, HardwareThread: hardware})
    error_handlers.install(app)
    app.add_middleware(UncollectedStreams)
    app.include_router(routes.router, prefix="/api/v1")
    install_persons(app)
    with serving(app) as port:
        yield Live(port, hub)
    streams.close()


def test_a_snapshot_is_the_newest_picture(live: Live) -> None:
    live.publish("right", 12)
    answer = live.get("/api/v1/views/right/snapshot.jpg?scale=2")
    assert answer.headers["content-type"] == "image/jpeg"
    assert answer.headers["x-frame-seq"] == "12"
    picture_ = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture_ is not None
    assert picture_.shape[:2] == (30, 40)


def test_the_list_names_all_views(live: Live) -> None:
    live.publish("wide", 1)
    listed = {view["name"]: view for view in live.get("/api/v1/views").json()}
    assert list(listed) == [
        "wide",
        "left",
        "right",
        "anaglyph",
        "difference",
        "depth",
        "wide_depth",
        "wide_zoom",
    ]
    assert (listed["wide"]["width"], listed["wide"]["height"]) == (80, 60)
    assert listed["left"]["age_ms"] is None


@pytest.mark.parametrize(
    ("path", "status", "slug"),
    [
        ("/api/v1/views/back/snapshot.jpg", 404, "not-found"),
        ("/api/v1/views/wide/snapshot.jpg", 503, "not-connected"),
        ("/api/v1/views/wide/snapshot.jpg?scale=3", 422, "invalid-input"),
        ("/api/v1/views/back/stream.mjpeg", 404, "not-found"),
    ],
)
def test_what_cannot_be_shown_is_a_problem_document(live: Live, path: str, status: int, slug: str) -> None:
    answer = live.get(path)
    assert answer.status_code == status
    assert answer.json()["type"] == f"/problems/{slug}"


def test_mjpeg_carries_whole_pictures(live: Live) -> None:
    live.publish("wide", 3)
    with httpx.stream("GET", live.url("/api/v1/views/wide/stream.mjpeg"), trust_env=False) as answer:
        assert answer.headers["content-type"] == "multipart/x-mixed-replace; boundary=foveacam-frame"
        part = next(answer.iter_bytes())
    head, _, body = part.partition(b"\r\n\r\n")
    assert b"X-Frame-Seq: 3" in head
    assert body.startswith(b"\xff\xd8")
    assert body.endswith(b"\xff\xd9\r\n")


def test_nginx_collects_no_pictures_for_a_reader_that_pauses(live: Live, tmp_path: Path) -> None:
    published, pause = 40, threading.Event()
    with nginx_before(live.port, tmp_path / "nginx") as nginx, socket.socket() as reader:
        reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        reader.settimeout(PATIENCE_S)
        reader.connect(("127.0.0.1", nginx.stripping_port))
        path = "/foveacam/api/v1/views/wide/stream.mjpeg"
        reader.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        live.publish("wide", 1, size=(240, 320))
        begun = reader.recv(1024)
        assert begun.startswith(b"HTTP/1.1 200 ")
        for seq in range(2, published + 1):
            live.publish("wide", seq, size=(240, 320))
            pause.wait(0.02)
        seen = begun
        while f"X-Frame-Seq: {published}\r\n".encode() not in seen:
            seen = seen[-100:] + reader.recv(1 << 16)
    assert nginx.spooled == []


def test_a_third_mjpeg_stream_of_one_person_is_refused_until_one_ends(live: Live) -> None:
    url = live.url("/api/v1/views/wide/stream.mjpeg")
    live.publish("wide", 1)
    with httpx.Client(trust_env=False) as client, httpx.Client(trust_env=False) as second:
        with client.stream("GET", url) as one:
            first_parts = one.iter_bytes()
            next(first_parts)
            with second.stream("GET", url) as two:
                second_parts = two.iter_bytes()  # kept: when forgotten, it closes the stream
                next(second_parts)
                refused = httpx.get(url, trust_env=False)
                assert refused.status_code == 429
                assert refused.json()["type"] == "/problems/person-limit"
                assert refused.headers["Retry-After"] == "5"
                assert f"you hold {MJPEG_EACH} MJPEG streams" in refused.json()["detail"]
                with httpx.stream("GET", url, headers={PERSON_HEADER: "ben"}, trust_env=False) as other:
                    assert other.status_code == 200
        # The seats are free again once the server has noticed that both left
        deadline_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline_s:
            with client.stream("GET", url) as again:
                if again.status_code == 200:
                    return
    pytest.fail("the seats of streams that ended were never given back")
