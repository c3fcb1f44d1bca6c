"""A server with viewers of every kind ends when it is told to, and complains about nothing."""

import asyncio
import json
import signal
import subprocess
import sys
import time

import httpx
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from foveacam_bench.stream.clients import StreamViewer

PATIENCE_S = 20.0


async def watch_and_stop(process: "subprocess.Popen[str]", *, port: int) -> float:
    """Open eight viewers, one that reads nothing and an MJPEG stream; return how long the end took."""
    root = f"127.0.0.1:{port}"
    viewers = [StreamViewer(f"ws://{root}/api/v1/views/ws", {"wide": 1, "left": 2}) for _ in range(8)]
    tasks = [asyncio.create_task(viewer.watch()) for viewer in viewers]
    async with (
        httpx.AsyncClient(trust_env=False, timeout=PATIENCE_S) as http,
        connect(f"ws://{root}/api/v1/views/ws", compression=None, proxy=None),
        http.stream("GET", f"http://{root}/api/v1/views/wide/stream.mjpeg") as mjpeg,
    ):
        parts = mjpeg.aiter_bytes()
        await http.post(f"http://{root}/bench/pace", params={"rate_hz": 10.0})
        await anext(parts)
        async with asyncio.timeout(PATIENCE_S):
            while not all(viewer.arrivals for viewer in viewers):
                await anext(parts)  # as much time as a picture takes
        begun_s = time.monotonic()
        process.send_signal(signal.SIGTERM)
        await asyncio.to_thread(process.wait, PATIENCE_S)
        took_s = time.monotonic() - begun_s
    ends = await asyncio.gather(*tasks, return_exceptions=True)
    assert all(end is None or isinstance(end, ConnectionClosed) for end in ends)
    return took_s


def test_a_server_with_viewers_ends_within_five_seconds_and_in_peace() -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "foveacam_bench.stream.server"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            port = json.loads(process.stdout.readline())["port"]
            took_s = asyncio.run(watch_and_stop(process, port=port))
            complaints = process.stderr.read()
        finally:
            process.kill()
    assert took_s < 5.0
    assert complaints == ""
