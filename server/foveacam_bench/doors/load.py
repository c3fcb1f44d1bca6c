"""The load of `bench doors` in a separate process: everything that unprivileged clients may request, at once.

`python -m foveacam_bench.doors.load URL [bodies]` runs until its stdin is closed, then prints one JSON
object: how many requests of each kind there were.
"""

import asyncio
import json
import random
import sys
from collections import Counter
from collections.abc import Awaitable, Callable
from itertools import cycle
from urllib.parse import urlsplit

import httpx

from foveacam_bench.stream.clients import StreamViewer, hold_unread_viewer
from foveacam_server.foundation.http.addresses import websocket_address

BODY_BYTES = 63_000_000
CHUNK_BYTES = 256 * 1024
ESTIMATES = 8
ESTIMATING_ADDRESSES = ("127.0.0.2", "127.0.0.3")
"""Addresses of the clients that request estimates: one person may run fewer at a time."""
ESTIMATE = {"plan": {"points": {"kind": "grid", "columns": 60, "rows": 60}}, "distance_m": 5.0}
VIEWERS = 12
"""Number of viewers; one of them never reads."""
BURST = 20
BURST_PAUSE_S, BODY_PAUSE_S, FIXATION_PAUSE_S = 0.25, 0.5, 2.0
GETS = (
    *("captures", "calibrations", "targets", "jobs", "rig", "mirrors", "recordings", "stills"),
    *("events/recent", "wide_depth", "clouds", "views", "fixations"),
)
SEED = 15
_PATIENCE_S = 120.0


class OutsiderLoad:
    """Runs clients of every kind and counts their requests."""

    def __init__(self, url: str) -> None:
        self._api = f"{url}api/v1/"
        self._url = url
        self._address = urlsplit(url)
        self._rng = random.Random(SEED)  # noqa: S311 - not a secret
        limits = httpx.Limits(max_connections=None)
        self._client = httpx.AsyncClient(timeout=_PATIENCE_S, trust_env=False, limits=limits)
        self._estimators = cycle([_client_at(address) for address in ESTIMATING_ADDRESSES])
        self.counts: Counter[str] = Counter()

    async def run(self, *, bodies: bool, ended: Awaitable[object]) -> None:
        """Send requests until `ended`."""
        kinds: list[Callable[[], Awaitable[None]]] = [self._burst, self._fixation, self._unread_viewer]
        kinds += [self._estimate] * ESTIMATES + [self._viewer] * (VIEWERS - 1) + [self._body] * bodies
        tasks = [asyncio.create_task(self._repeat(kind)) for kind in kinds]
        await ended
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._client.aclose()

    async def _repeat(self, kind: Callable[[], Awaitable[None]]) -> None:
        while True:
            try:
                await kind()
            except (httpx.HTTPError, OSError, EOFError):
                self.counts[f"{kind.__name__.strip('_')}_refused"] += 1
                await asyncio.sleep(BURST_PAUSE_S)

    async def _burst(self) -> None:
        asked = self._rng.choices(GETS, k=BURST)
        await asyncio.gather(*(self._client.get(self._api + path) for path in asked))
        self.counts["bursts"] += 1
        await asyncio.sleep(BURST_PAUSE_S)

    async def _estimate(self) -> None:
        answer = await next(self._estimators).post(self._api + "captures/estimates", json=ESTIMATE)
        self.counts[f"estimates_{answer.status_code}"] += 1
        if answer.is_error:
            await asyncio.sleep(BURST_PAUSE_S)

    async def _fixation(self) -> None:
        pixel = {"x_px": self._rng.uniform(300, 1100), "y_px": self._rng.uniform(250, 850)}
        answer = await self._client.post(self._api + "fixations", json={"pixel": pixel})
        self.counts[f"fixations_{answer.status_code}"] += 1
        await asyncio.sleep(FIXATION_PAUSE_S)

    async def _viewer(self) -> None:
        url = websocket_address(self._url, "/api/v1/views/ws")
        await StreamViewer(url, choice={"wide": 2, "left": 2, "right": 2}).watch()

    async def _unread_viewer(self) -> None:
        self.counts["unread_viewers"] += 1
        await hold_unread_viewer(self._address.hostname or "", self._address.port or 80)

    async def _body(self) -> None:
        """Send a much too large body completely, whatever the server answers in the meantime."""
        _, writer = await self._connect()
        writer.write(
            f"POST /api/v1/calibrations/import HTTP/1.1\r\nHost: {self._address.netloc}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {BODY_BYTES}\r\n\r\n".encode()
        )
        chunk = b"[" * CHUNK_BYTES
        for _ in range(BODY_BYTES // CHUNK_BYTES):
            writer.write(chunk)
            await writer.drain()
        self.counts["bodies"] += 1
        writer.close()
        await asyncio.sleep(BODY_PAUSE_S)

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        return await asyncio.open_connection(self._address.hostname, self._address.port)


def _client_at(own_address: str) -> httpx.AsyncClient:
    transport = httpx.AsyncHTTPTransport(local_address=own_address)
    return httpx.AsyncClient(timeout=_PATIENCE_S, trust_env=False, transport=transport)


def main() -> None:
    """Run until stdin is closed."""
    load = OutsiderLoad(sys.argv[1])

    async def whole() -> None:
        ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        await load.run(bodies="bodies" in sys.argv[2:], ended=ended)

    asyncio.run(whole())
    sys.stdout.write(json.dumps(load.counts))


if __name__ == "__main__":
    main()
