"""Everybody at once, in a process of its own: viewers, one that never reads, and four services.

`python -m foveacam_bench.soak.crowd URL` runs until its stdin is closed, then prints one JSON object: counts
of answers, identifiers of the accepted jobs, and how late events came.
"""

import asyncio
import contextlib
import json
import statistics
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from datetime import datetime
from urllib.parse import urlsplit

import httpx

from foveacam_bench.figures import Figures
from foveacam_bench.judging import percentile
from foveacam_bench.stream.clients import StreamViewer, hold_unread_viewer
from foveacam_server.foundation.http.addresses import websocket_address

VIEWERS = 12
LISTS = ("captures", "calibrations", "targets", "jobs", "rig", "mirrors", "events/recent", "engine")
CLICK_PAUSE_S, LIST_PAUSE_S, CAPTURE_PAUSE_S, REFUSED_PAUSE_S = 2.0, 0.5, 15.0, 0.5
PATIENCE_S = 60.0
GRID = {"kind": "grid", "columns": 2, "rows": 2, "half_width_deg": 2.0, "half_height_deg": 2.0}
PLAN = {"points": GRID, "verging": {"mode": "given", "distance_m": 2.0}}
PLACES_PX = ((812.0, 420.0), (500.0, 600.0), (900.0, 700.0))


class Crowd:
    """The clients, their answers, and what they saw."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._api = f"{url}api/v1/"
        self._address = urlsplit(url)
        self._http = httpx.AsyncClient(timeout=PATIENCE_S, trust_env=False)
        self._counts: Counter[str] = Counter()
        self._jobs: list[str] = []
        self._late_ms: list[float] = []

    async def run(self, *, ended: Awaitable[object]) -> Figures:
        """Use the server until `ended`; return what happened."""
        kinds: list[Callable[[], Awaitable[None]]] = [self._click, self._list, self._capture, self._listen]
        kinds += [self._view] * VIEWERS + [self._hold_unread]
        tasks = [asyncio.create_task(self._repeat(kind)) for kind in kinds]
        await ended
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._http.aclose()
        late_ms = self._late_ms or [0.0]
        return {
            "answers": dict(self._counts),
            "jobs": self._jobs,
            "events": len(self._late_ms),
            "event_p50_ms": statistics.median(late_ms),
            "event_p99_ms": percentile(late_ms, 0.99),
            "event_max_ms": max(late_ms),
        }

    async def _repeat(self, kind: Callable[[], Awaitable[None]]) -> None:
        while True:
            try:
                await kind()
            except (httpx.HTTPError, OSError, EOFError) as error:
                self._counts[f"{kind.__name__.strip('_')}: {type(error).__name__}"] += 1
                await asyncio.sleep(REFUSED_PAUSE_S)

    def _count(self, what: str, answer: httpx.Response) -> httpx.Response:
        self._counts[f"{what}: {answer.status_code}"] += 1
        return answer

    async def _click(self) -> None:
        for x_px, y_px in PLACES_PX:
            body = {"pixel": {"x_px": x_px, "y_px": y_px}}
            answer = await self._http.post(self._api + "fixations", json=body, headers={"Prefer": "wait=30"})
            self._count("click", answer)
            await asyncio.sleep(CLICK_PAUSE_S)

    async def _list(self) -> None:
        for path in LISTS:
            self._count("list", await self._http.get(self._api + path))
        await asyncio.sleep(LIST_PAUSE_S)

    async def _capture(self) -> None:
        """Capture four points, and delete them permanently after some time."""
        body = {"name": f"crowd {time.monotonic_ns()}", "plan": PLAN}
        answer = await self._http.post(self._api + "captures", json=body)
        if self._count("capture", answer).status_code == httpx.codes.ACCEPTED:
            self._jobs.append(answer.json()["id"])
        await asyncio.sleep(CAPTURE_PAUSE_S)
        for found in (await self._http.get(self._api + "captures")).json():
            await self._http.delete(f"{self._api}captures/{found['id']}")
        await self._http.delete(self._api + "captures/trash")

    async def _listen(self) -> None:
        """Measure how long after its time each event arrives; both clocks are this machine's."""
        async with self._http.stream("GET", self._api + "events") as stream:
            async for line in stream.aiter_lines():
                if line.startswith("data: "):
                    emitted = datetime.fromisoformat(json.loads(line.removeprefix("data: "))["t_utc"])
                    self._late_ms.append(1e3 * (time.time() - emitted.timestamp()))

    async def _view(self) -> None:
        url = websocket_address(self._url, "/api/v1/views/ws")
        viewer = StreamViewer(url, choice={"wide": 2, "left": 2, "right": 2})
        try:
            await viewer.watch()
        finally:
            self._counts["pictures"] += len(viewer.arrivals)

    async def _hold_unread(self) -> None:
        self._counts["unread viewers"] += 1
        await hold_unread_viewer(self._address.hostname or "", self._address.port or 80)


def main() -> None:
    """Run until stdin is closed."""

    async def whole() -> Figures:
        ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        return await Crowd(sys.argv[1]).run(ended=ended)

    with contextlib.suppress(KeyboardInterrupt):
        sys.stdout.write(json.dumps(asyncio.run(whole())))


if __name__ == "__main__":
    main()
