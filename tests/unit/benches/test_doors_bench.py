"""Parts of `bench doors` that need no server: timed callbacks, and the requests of the first use."""

import asyncio
import io
import json
import time
from pathlib import Path

import httpx
import pytest

from foveacam_bench.doors import timed_server
from foveacam_bench.doors.first_use import PAGES, first_requests
from foveacam_server.foundation.watching.work_ids import REQUEST_ID

DOCUMENT = Path(__file__).parents[2] / "data" / "openapi.json"


def test_a_callback_that_holds_the_loop_is_written_down_with_its_request(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(asyncio.Handle, "_run", asyncio.Handle._run)  # restored after the test
    log = io.StringIO()
    timed_server.time_callbacks(log)

    async def compute() -> None:
        REQUEST_ID.set("first-7")
        end_s = time.thread_time() + 2 * timed_server.LEAST_MS / 1e3
        while time.thread_time() < end_s:
            pass

    async def main() -> None:
        await asyncio.create_task(compute())

    asyncio.run(main())
    lines = [line.split() for line in log.getvalue().splitlines()]
    (mine,) = [line for line in lines if line[2] == "first-7"]
    assert float(mine[0]) >= float(mine[1]) >= timed_server.LEAST_MS


def test_every_operation_that_reads_is_asked() -> None:
    document = json.loads(DOCUMENT.read_text())

    def answer(_request: httpx.Request) -> httpx.Response:
        return httpx.Response(200, json=document)

    with httpx.Client(transport=httpx.MockTransport(answer), base_url="http://rig") as http:
        asked = [(method, path) for method, path, _ in first_requests(http)]
    reading = sum("get" in operations for operations in document["paths"].values())
    assert sum(path.startswith("/api/") for method, path in asked if method == "GET") >= reading - len(PAGES)
    assert asked.index(("GET", "/openapi.json")) == len(PAGES)
    assert not [path for _, path in asked if "{" in path]
