"""`foveacam bench replay`: open a recording of 10 GB in the console, and scrub it.

The recording lies in the server's import folder and is not in the machine's file cache. Needs Chromium and
the extra `dev`, and 12 GB of the temporary folder's disk; with less the recording is as long as fits.
"""

import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from foveacam_bench.servers import ServerProcess, free_port
from foveacam_bench.stream.console_page import chromium, open_context, wait_until
from foveacam_pipeline.capture.recording.pixels import payload_of, stream_format
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.session import RecordingSession
from foveacam_pipeline.capture.recording.values import RawFrame
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, free_bytes

if TYPE_CHECKING:
    from playwright.sync_api import Page

FULL_BYTES, QUICK_BYTES = 10_000_000_000, 1_000_000_000
STREAMS = ("center", "left", "right")
HEIGHT, WIDTH = 1080, 1440
PERIOD_NS = 33_333_333
PICTURES = 8
SCRUBS = 60
SEED = 20_261
PATIENCE_MS = 60_000

OPEN_JS = """async (path) => {
  const began_ms = performance.now();
  const answer = await fetch("/api/v1/recordings/open", {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ path }),
  });
  const { id } = await answer.json();
  location.hash = `#/gallery/recordings/${id}`;
  while (!document.querySelector(".player-wide[data-shown]")) await new Promise(requestAnimationFrame);
  return [id, performance.now() - began_ms];
}"""
SCRUB_JS = """async (at_s) => {
  const shown = () => [...document.querySelectorAll(".player-pane")].map((pane) => pane.dataset.shown);
  const [line, before, began_ms] = [document.querySelector("input.timeline"), shown(), performance.now()];
  line.value = at_s;
  line.dispatchEvent(new Event("input"));
  while (shown().some((url, index) => url === before[index])) await new Promise(requestAnimationFrame);
  return performance.now() - began_ms;
}"""


def run(*, quick: bool = False) -> dict[str, float]:
    """Measure and return opening and scrubbing times; takes about two minutes, quick half of one."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        home = folder / "data" / "import"
        home.mkdir(parents=True)
        small, long = folder / "small.fcap", home / "long.fcap"
        write_recording(small, size_bytes=20_000_000)
        room_bytes = free_bytes(folder) - 3 * RESERVE_BYTES
        write_recording(long, size_bytes=min(QUICK_BYTES if quick else FULL_BYTES, room_bytes))
        drop_from_cache(long)
        index_s = _index_s(long)
        drop_from_cache(long)
        options = ("--replay", str(small))
        with (
            chromium() as browser,
            ServerProcess(folder, port=free_port(), options=options) as server,
            open_context(browser, scene=False) as context,
        ):
            page = context.new_page()
            page.set_default_timeout(PATIENCE_MS)
            page.goto(f"{server.url}#/planner")
            wait_until(page, lambda: page.evaluate("Boolean(window.foveacam?.bootId())"))
            _, open_ms = page.evaluate(OPEN_JS, str(long))
            scrubs_ms = _scrubs_ms(page)
        return {
            "recording_gb": long.stat().st_size / 1e9,
            "index_s": index_s,
            "open_s": open_ms / 1e3,
            "scrub_p50_ms": float(np.percentile(scrubs_ms, 50)),
            "scrub_p95_ms": float(np.percentile(scrubs_ms, 95)),
        }


def write_recording(path: Path, *, size_bytes: int) -> None:
    """Record noise of three cameras at 30 Hz until the file has a size."""
    rng = np.random.default_rng(SEED)
    pictures = [
        np.clip(rng.normal(128.0, 20.0, (HEIGHT, WIDTH)), 0, 255).astype(np.uint8) for _ in range(PICTURES)
    ]
    form = stream_format(pictures[0], bits=8)
    tick = 0
    with Recorder(path, RecordingSession(timestamp="2026-01-31T12:00:00+00:00")) as recorder:
        while tick * len(STREAMS) * form.frame_bytes < size_bytes:
            for stream in STREAMS:
                frame = RawFrame(
                    payload=payload_of(pictures[tick % PICTURES], form),
                    form=form,
                    seq=tick,
                    t_ns=tick * PERIOD_NS,
                )
                while not recorder.publish(stream, frame):
                    time.sleep(0.01)  # the disk is slower
            tick += 1


def drop_from_cache(path: Path) -> None:
    """Take a file out of the machine's file cache."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def _index_s(path: Path) -> float:
    began_s = time.perf_counter()
    with Recording(path) as recording:
        recording.frame("center", 0)
    return time.perf_counter() - began_s


def _scrubs_ms(page: "Page") -> list[float]:
    """Return how long all panes take to show another moment, for moments all over the recording."""
    end_s = float(page.locator("input.timeline").get_attribute("max") or 0.0)
    moments_s = np.random.default_rng(SEED).uniform(0.0, end_s, SCRUBS)
    found = []
    for at_s in moments_s:
        page.wait_for_timeout(150)
        found.append(float(page.evaluate(SCRUB_JS, float(at_s))))
    return found
