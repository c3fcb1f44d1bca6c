"""A whole server on the simulated rig, in this process or in one of its own."""

import asyncio
import json
import os
import queue
import re
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from foveacam_hardware.contract import Frame
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.truth import Truth
from foveacam_server.app import create_app
from foveacam_server.assembly.services import Services
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Document
from foveacam_server.resources.capturing.captures.job_watcher import CaptureJobWatcher
from tests.support.servers import server_state
from tests.support.servers.local_server import serving

PATIENCE_S = 120.0
"""Enough for a renderer that is compiled first, on a busy machine."""
EVENT_PATIENCE_S = 90.0
"""Less than the two minutes that a test has: it says what it missed, instead of ending the whole run."""
CENTRE = {"pixel": {"x_px": 720.0, "y_px": 540.0}}
API = server_state.API
POLL_S = 0.05
LIVE_WIDE_HZ, LIVE_FOVEA_HZ = 1.5, 1.0
"""Slow live views: two cores are shared with a browser and another server."""
SELDOM_HZ = 0.1, 0.1
"""Of live views at which nobody looks."""


@dataclass
class Running:
    """A server in this process, its inside, and a client of it."""

    port: int
    services: Services
    http: httpx.Client

    def get(self, path: str, **params: str | float) -> httpx.Response:
        return self.http.get(API + path, params=params)

    def post(self, path: str, body: object = None, **headers: str) -> httpx.Response:
        names = {name.replace("_", "-"): value for name, value in headers.items()}
        return self.http.post(API + path, json=body, headers=names)

    def fixate(self, body: object = CENTRE) -> dict[str, Any]:  # Any: a JSON document
        """Look there and return the fixation's document."""
        answer = self.post("/fixations", body, Prefer="wait=60")
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    @property
    def rig(self) -> Rig:
        found = self.services.hardware.submit(lambda rig: rig).result(PATIENCE_S)
        assert isinstance(found, Rig)
        return found

    @property
    def truth(self) -> Truth:
        found = self.rig.truth
        assert found is not None
        return found

    @property
    def captures(self) -> Path:
        """The folder of the captures."""
        return self.services.settings.data / "captures"

    def poll(self, path: str, enough: Callable[[Document], bool], *, every_s: float = POLL_S) -> Document:
        """Return the document at a path once it is enough."""
        waiting = threading.Event()
        for _ in range(round(PATIENCE_S / every_s)):
            found: Document = self.get(path).json()
            if enough(found):
                return found
            waiting.wait(every_s)
        raise AssertionError(found)

    def ended(self, job: Document) -> Document:
        """Return a job once it has ended: the jobs themselves tell, asking again and again costs time."""
        asyncio.run(self.services.jobs.ended(job["id"], timeout_s=PATIENCE_S))
        return self.poll(f"/jobs/{job['id']}", lambda found: found["ended_utc"] is not None)

    def reset(self) -> None:
        """Bring the server back to the state in which it starts."""
        server_state.reset(self.http, self.services.settings.data)

    def wait_for_event(
        self,
        kind: str,
        *,
        after: int,
        of: str | None = None,
        step: str | None = None,
        within_s: float = EVENT_PATIENCE_S,
    ) -> dict[str, Any]:  # Any: an event's data
        """Return the data of the first event of `kind` after number `after`.

        `of`: of that fixation. `step`: of that step of a calibration.
        """
        wanted = {name: value for name, value in (("fixation_id", of), ("step", step)) if value is not None}
        seen: Counter[str] = Counter()
        end_s = time.monotonic() + within_s
        with suppress(httpx.ReadTimeout):
            for event in self._events(after, within_s=within_s):
                if event is not None:
                    seen[event["kind"]] += 1
                    data: dict[str, Any] = event["data"]
                    if event["kind"] == kind and wanted.items() <= data.items():
                        return data
                if time.monotonic() > end_s:
                    break
        asked = " ".join([kind, *wanted.values()])
        counts = ", ".join(f"{name} ({count})" for name, count in seen.items()) or "none"
        raise AssertionError(f"no event {asked} within {within_s:g} s after number {after}; seen: {counts}")

    def _events(
        self, after: int, *, within_s: float
    ) -> Iterator[dict[str, Any] | None]:  # Any: an event's document
        """Yield the events after number `after` as they come, and None for whatever else the stream says."""
        headers, patience = {"Last-Event-ID": str(after)}, httpx.Timeout(PATIENCE_S, read=within_s)
        with self.http.stream("GET", f"{API}/events", headers=headers, timeout=patience) as stream:
            for line in stream.iter_lines():
                yield json.loads(line.removeprefix("data: ")) if line.startswith("data: ") else None

    @property
    def last_event(self) -> int:
        recent = self.services.events.recent(1)
        return recent[-1].id if recent else 0


def slow_views() -> dict[str, str]:
    """Return the environment of a server whose live views are slow, unless it says another rate."""
    rates = {"FOVEACAM_LIVE_WIDE_HZ": str(LIVE_WIDE_HZ), "FOVEACAM_LIVE_FOVEA_HZ": str(LIVE_FOVEA_HZ)}
    return {**rates, **os.environ}


@contextmanager
def running(
    data: Path,
    *,
    rig: str = "sim",
    scene: str = "bench",
    calibration: Path | None = None,
    viewer: bool = False,
    live_hz: tuple[float, float] = (LIVE_WIDE_HZ, LIVE_FOVEA_HZ),
    host: str = "127.0.0.1",
    port: int = 0,
    root_path: str = "",
    rigs: Path | None = None,
    announce: bool = False,
    otlp_endpoint: str | None = None,
    archive: str | None = None,
) -> Iterator[Running]:
    warm_up()  # a compiled renderer: else the first look would wait for it
    settings = Settings(
        data=data,
        rig=rig,
        scene=scene,
        calibration=calibration,
        viewer=viewer,
        host=host,
        root_path=root_path,
        rigs=rigs,
        announce=announce,
        otlp_endpoint=otlp_endpoint,
        archive=archive,
        live_wide_hz=live_hz[0],
        live_fovea_hz=live_hz[1],
    )
    app = create_app(settings)
    with serving(app, port=port) as found:
        services = app.state.services
        assert services.hardware.wait_open(PATIENCE_S)
        base = f"http://127.0.0.1:{found}"
        with httpx.Client(base_url=base, timeout=PATIENCE_S, trust_env=False) as http:
            yield Running(found, services, http)


def missing_rig(folder: Path, *, rig_id: str = "workshop") -> str:
    """Write a rig file whose devices are all missing, with which a server starts sooner; return its path."""
    path = folder / "missing.toml"
    port = 'port = "/dev/ttyNOBODY"'
    path.write_text(f'kind = "serial"\nrig_id = "{rig_id}"\n[mirrors]\n{port}\n', encoding="utf-8")
    return str(path)


@dataclass
class Program:
    """`foveacam serve` in a process of its own."""

    process: subprocess.Popen[str]
    url: str


def read_until(process: subprocess.Popen[str], pattern: str, *, timeout_s: float = PATIENCE_S) -> str:
    """Return the first group of `pattern` in what the process prints."""
    found: queue.Queue[str] = queue.Queue()

    def read() -> None:
        assert process.stdout is not None
        printed = []
        for line in process.stdout:
            printed.append(line)
            match = re.search(pattern, line)
            if match:
                found.put(match[1])
        found.put("")  # it ended
        process.stdout.close()

    threading.Thread(target=read, daemon=True).start()
    answer = found.get(timeout=timeout_s)
    assert answer, "the program ended before it printed what was waited for"
    return answer


@contextmanager
def gated() -> Iterator[threading.Event]:
    """Let captures wait behind every look until the event is set, or the context ends."""
    found, saw = threading.Event(), CaptureJobWatcher.show_frames

    def wait_behind(watch: CaptureJobWatcher, frames: tuple[Frame, ...]) -> None:
        saw(watch, frames)
        found.wait(PATIENCE_S)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CaptureJobWatcher, "show_frames", wait_behind)
        yield found
        found.set()
