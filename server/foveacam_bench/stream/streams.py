"""`foveacam bench stream`: one encode per frame for any number of viewers, and the delay of a slow viewer.

A client on a slow connection receives the same views by the product's credits and from an unbounded queue.
"""

import asyncio
import json
import statistics
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass

import httpx
import numpy as np

from foveacam_bench.stream.clients import StreamViewer, slow_connection
from foveacam_bench.stream.server import LIVE
from foveacam_hardware.contract import DeviceFault
from foveacam_server.rig.encoder import Scale

RATE_HZ = 20.0
SLOW_BYTES_PER_S = 1e6
FAST_CLIENTS = 7
_CHOICES: tuple[dict[str, Scale], ...] = (
    {"wide": 1, "left": 2, "right": 2},
    {"wide": 2, "left": 4, "right": 4},
    {"wide": 1, "left": 1, "right": 2},
)
_IDLE_S = 2.0
_SETTLE_FRACTION = 0.2
"""Share of each phase that is left out, while connections open and queues fill."""
_DRAIN_ROUNDS = 100
_DRAIN_STEP_S = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class _Phase:
    """The server's counters before and after one phase."""

    before: dict[str, float]
    after: dict[str, float]
    settled_s: float
    ended_s: float

    def gained(self, name: str) -> float:
        """Return the growth of one counter."""
        return self.after[name] - self.before[name]

    @property
    def cpu_share(self) -> float:
        """The server's CPU time in cores."""
        return self.gained("cpu_s") / self.gained("t_s")


def run(*, quick: bool = False) -> dict[str, float]:
    """Measure and return the figures; about 35 s, quick about 12 s."""
    phase_s = 4.5 if quick else 14.0
    with _server() as port:
        return asyncio.run(_measure(port, phase_s=phase_s))


@contextmanager
def _server() -> Iterator[int]:
    command = [sys.executable, "-m", "foveacam_bench.stream.server"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)  # noqa: S603  # our own module
    if process.stdin is None or process.stdout is None:
        raise DeviceFault("the bench's server has no pipes")
    try:
        line = process.stdout.readline()
        if not line:
            raise DeviceFault("the bench's server ended before it began; see its message above")
        yield int(json.loads(line)["port"])
    finally:
        process.stdin.close()
        try:
            process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


async def _measure(port: int, *, phase_s: float) -> dict[str, float]:
    root = f"ws://127.0.0.1:{port}"
    async with (
        httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}", trust_env=False) as control,
        slow_connection(port=port, bytes_per_s=SLOW_BYTES_PER_S) as slow_port,
    ):
        await _wait_until_up(control)
        idle = await _phase(control, [], duration_s=_IDLE_S)
        path = "/api/v1/views/ws"
        fast = [StreamViewer(root + path, dict(_CHOICES[index % 3])) for index in range(FAST_CLIENTS)]
        slow = StreamViewer(f"ws://127.0.0.1:{slow_port}{path}", dict(_CHOICES[0]))
        ours = await _phase(control, [*fast, slow], duration_s=phase_s)
        naive = StreamViewer(f"ws://127.0.0.1:{slow_port}/bench/naive")
        queued = await _phase(control, [naive], duration_s=phase_s, drain=False)
    pictures = {(a.view, a.scale, a.seq) for viewer in (*fast, slow) for a in viewer.arrivals}
    slow_age_s = _age_p95_s(slow, phase=ours)
    naive_age_s = _age_p95_s(naive, phase=queued)
    rates = [_rate_fraction(viewer, published=ours.gained("published")) for viewer in fast]
    return {
        "clients": len(fast) + 1,
        "views": len(LIVE),
        "source_rate_hz": round(ours.gained("published") / ours.gained("t_s"), 2),
        "encodes_per_frame": ours.gained("encodes") / len(pictures),
        "idle_encodes": idle.gained("encodes"),
        "slow_age_p95_s": round(slow_age_s, 4),
        "slow_frames": len(slow.arrivals),
        "naive_age_p95_s": round(naive_age_s, 4),
        "naive_over_ours": round(naive_age_s / slow_age_s, 2),
        "fast_age_p95_s": round(statistics.median(_age_p95_s(viewer, phase=ours) for viewer in fast), 4),
        "fast_rate_fraction": round(statistics.median(rates), 3),
        "fast_rate_fraction_min": round(min(rates), 3),
        "stream_cpu_share": round(ours.cpu_share - idle.cpu_share, 3),
        "server_cpu_share": round(ours.cpu_share, 3),
    }


async def _phase(
    control: httpx.AsyncClient, viewers: list[StreamViewer], *, duration_s: float, drain: bool = True
) -> _Phase:
    first = await _counters(control)
    async with _watching(viewers):
        await _wait_for_clients(control, len(viewers) if drain else 0)
        before = await _counters(control)
        await control.post("/bench/pace", params={"rate_hz": RATE_HZ})
        await asyncio.sleep(duration_s)
        after = await _counters(control)
        await control.post("/bench/pace", params={"rate_hz": 0.0})
        if drain:
            await _drain(control, viewers)
    final = await _counters(control)
    # Viewers also receive the newest picture when they connect, and those on their way at the end
    before |= {"encodes": first["encodes"]}
    after |= {"encodes": final["encodes"], "published": final["published"]}
    settled_s = before["t_s"] + _SETTLE_FRACTION * duration_s
    return _Phase(before=before, after=after, settled_s=settled_s, ended_s=after["t_s"])


@asynccontextmanager
async def _watching(viewers: list[StreamViewer]) -> AsyncIterator[None]:
    tasks = [asyncio.create_task(viewer.watch()) for viewer in viewers]
    try:
        yield
        for task in tasks:
            if task.done():
                task.result()  # raises the error of a viewer that ended early
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _drain(control: httpx.AsyncClient, viewers: list[StreamViewer]) -> None:
    """Wait until all sent pictures have arrived and no more are sent."""
    last = -1.0
    for _ in range(_DRAIN_ROUNDS):
        sent = (await _counters(control))["frames_sent"]
        arrived = sum(len(viewer.arrivals) for viewer in viewers)
        if sent == last and arrived >= sent:
            return
        last = sent
        await asyncio.sleep(_DRAIN_STEP_S)
    raise DeviceFault(f"the bench's server sent {last:.0f} pictures, and not all of them arrived within 10 s")


async def _wait_for_clients(control: httpx.AsyncClient, count: int) -> None:
    for _ in range(_DRAIN_ROUNDS):
        if (await _counters(control))["clients"] >= count:
            return
        await asyncio.sleep(_DRAIN_STEP_S)
    raise DeviceFault(f"not all of {count} viewers could connect within 10 s")


async def _wait_until_up(control: httpx.AsyncClient) -> None:
    for _ in range(_DRAIN_ROUNDS):
        try:
            await _counters(control)
        except httpx.TransportError:
            await asyncio.sleep(_DRAIN_STEP_S)
        else:
            return
    raise DeviceFault("the bench's server did not answer within 10 s")


async def _counters(control: httpx.AsyncClient) -> dict[str, float]:
    answer = await control.get("/bench/counters")
    answer.raise_for_status()
    counters: dict[str, float] = answer.json()
    return counters


def _age_p95_s(viewer: StreamViewer, *, phase: _Phase) -> float:
    ages_s = [a.age_s for a in viewer.arrivals if phase.settled_s <= a.t_s <= phase.ended_s]
    if not ages_s:
        raise DeviceFault("a viewer got no picture at all; the machine is too busy for this measurement")
    return float(np.percentile(ages_s, 95))


def _rate_fraction(viewer: StreamViewer, *, published: float) -> float:
    return len(viewer.arrivals) / (published * len(viewer.choice))
