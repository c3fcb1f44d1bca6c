"""The server of `bench stream`: the streams of the product, fed with synthetic frames.

It runs in its own process, whose CPU time is measured, and ends when its standard input closes.
"""

import asyncio
import json
import socket
import sys
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np
import uvicorn
from fastapi import FastAPI, WebSocket, WebSocketDisconnect
from numpy.typing import NDArray

from foveacam_hardware.contract import MonotonicClock
from foveacam_server.doors.listening_socket import listen
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.resources.operating.views import routes
from foveacam_server.rig import stream_messages
from foveacam_server.rig.encoder import Scale
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.stream import LiveStreams

LIVE = ("wide", "left", "right")
NAIVE_CHOICE: tuple[tuple[str, Scale], ...] = (("wide", 1), ("left", 2), ("right", 2))
_WIDTH, _HEIGHT = 1440, 1080
_VARIANTS = 4
_NOISE_STEPS = 1.5


def synthetic_pictures(*, seed: int, count: int = _VARIANTS) -> list[NDArray[np.uint8]]:
    """Return grey pictures, (1080, 1440) uint8, with detail and noise: about 150 kB each as JPEG."""
    rng = np.random.default_rng(seed)
    scene = np.full((_HEIGHT, _WIDTH), 128.0)
    for cell_px, contrast in ((180, 30.0), (60, 20.0), (20, 12.0), (5, 6.0)):
        cells = rng.normal(0.0, contrast, (_HEIGHT // cell_px, _WIDTH // cell_px))
        scene += np.kron(cells, np.ones((cell_px, cell_px)))
    noisy = [scene + rng.normal(0.0, _NOISE_STEPS, scene.shape) for _ in range(count)]
    return [np.clip(picture, 0.0, 255.0).astype(np.uint8) for picture in noisy]


class Publisher(threading.Thread):
    """Publishes one picture of each view at a variable rate; 0 pauses."""

    def __init__(self, hub: FrameHub) -> None:
        super().__init__(name="publisher", daemon=True)
        self._hub = hub
        self._pictures = {view: synthetic_pictures(seed=index) for index, view in enumerate(LIVE)}
        self._changed = threading.Event()
        self._rate_hz = 0.0
        self._ended = False
        self.published = 0

    def pace(self, rate_hz: float) -> None:
        """Publish at `rate_hz` from now on."""
        self._rate_hz = rate_hz
        self._changed.set()

    def end(self) -> None:
        """End publishing."""
        self._ended = True
        self._changed.set()
        self.join()

    def run(self) -> None:
        """Publish until ended."""
        while not self._ended:
            if self._rate_hz > 0.0:
                self._publish()
            self._changed.wait(timeout=1.0 / self._rate_hz if self._rate_hz > 0.0 else None)
            self._changed.clear()

    def _publish(self) -> None:
        self.published += 1
        for view in LIVE:
            # a copy, like a new image of a camera
            image = self._pictures[view][self.published % _VARIANTS].copy()
            self._hub.publish(view, image, t_ns=time.monotonic_ns(), seq=self.published)


async def send_from_queue(streams: LiveStreams, websocket: WebSocket) -> None:
    """Queue every picture for the client without bound, and send them in order."""
    queue: asyncio.Queue[bytes] = asyncio.Queue()

    async def collect(view: str, scale: Scale) -> None:
        async for encoded in streams.pictures(view, scale):
            queue.put_nowait(stream_messages.frame(encoded, streams.hub))

    tasks = [asyncio.create_task(collect(view, scale)) for view, scale in NAIVE_CHOICE]
    try:
        while True:
            await websocket.send_bytes(await queue.get())
    except WebSocketDisconnect:
        return
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def bench_app() -> FastAPI:
    """Return an application with the product's own view routes, a naive one, and the bench's controls."""
    hub = FrameHub(clock=MonotonicClock())
    publisher = Publisher(hub)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        streams = LiveStreams(hub, boot_id="bench")
        app.state.provided = ServiceRegistry({LiveStreams: streams})
        publisher.start()
        yield
        await asyncio.to_thread(publisher.end)
        await asyncio.to_thread(streams.close)

    app = FastAPI(lifespan=lifespan)
    app.include_router(routes.router, prefix="/api/v1")

    @app.websocket("/bench/naive")
    async def naive(websocket: WebSocket) -> None:
        await websocket.accept()
        await send_from_queue(app.state.provided.get(LiveStreams), websocket)

    @app.post("/bench/pace")
    async def pace(rate_hz: float) -> None:
        publisher.pace(rate_hz)

    @app.get("/bench/counters")
    async def counters() -> dict[str, float]:
        streams: LiveStreams = app.state.provided.get(LiveStreams)
        return {
            "cpu_s": time.process_time(),
            "t_s": time.monotonic(),
            "published": publisher.published,
            "encodes": sum(streams.jpegs.encodes.values()),
            "frames_sent": streams.frames_sent,
            "clients": streams.clients,
        }

    return app


class _Server(uvicorn.Server):
    """Ends the streams first, as the product's server does."""

    def __init__(self, config: uvicorn.Config, *, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop."""
        self._app.state.provided.get(LiveStreams).end()
        await super().shutdown(sockets)


async def _serve() -> None:
    listener = listen("127.0.0.1", 0)
    app = bench_app()
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=3,
    )
    server = _Server(config, app=app)
    loop = asyncio.get_running_loop()

    def watch_parent() -> None:
        sys.stdin.read()
        loop.call_soon_threadsafe(setattr, server, "should_exit", True)

    threading.Thread(target=watch_parent, daemon=True).start()
    sys.stdout.write(json.dumps({"port": listener.getsockname()[1]}) + "\n")
    sys.stdout.flush()
    await server.serve(sockets=[listener])


if __name__ == "__main__":
    asyncio.run(_serve())
