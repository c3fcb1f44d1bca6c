"""Situations in which `bench doors` ends a server: each begins work and returns once it is under way."""

import base64
import os
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import cv2
import httpx
import numpy as np

from foveacam_bench.doors.foreign import process_family
from foveacam_bench.doors.load import ESTIMATE
from foveacam_bench.servers import ServerProcess
from foveacam_client import models
from foveacam_client.document import JsonObject
from foveacam_hardware.contract import DeviceFault
from foveacam_server.commands.server_rig import server_rig

PATIENCE_S = 120.0
POLL_S = 0.05
RECORDED_S, ENDLESS_S = 6.0, 60.0
"""Durations of recordings; the longer one must fit on the disk, and outlast its situation."""
WHOLE = "whole"
"""Name of the recording that other situations use."""
NOISE_PX = 2000
ESTIMATES = 4
UPLOADED_BYTES = 6_000_000
_SMALL_BUFFER_BYTES = 4096
_STALLED_S = 1.0
"""Time in which the buffers between the server and a peer that does not read fill up."""
Begin: TypeAlias = Callable[["RunningWork"], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningWork:
    """A server, and the connections that a situation opens on it, closed once the server has ended."""

    server: ServerProcess
    stack: ExitStack
    storage: socket.socket
    """Accepts connections and never answers; serves as the servers' archive."""

    def start(self, path: str, body: object) -> JsonObject:
        """Start a job and return it."""
        return dict(self.server.send("POST", path, body).json())

    def wait_for(self, what: str, shown: Callable[[], bool]) -> None:
        """Wait until a condition holds; raise `DeviceFault` when it does not."""
        end_s = time.monotonic() + PATIENCE_S
        while not shown():
            if time.monotonic() > end_s:
                raise DeviceFault(f"bench doors: {what} did not begin in {PATIENCE_S:g} s")
            time.sleep(POLL_S)

    def wait_for_job(self, job: JsonObject) -> None:
        """Wait until a job reports progress."""

        def runs() -> bool:
            found = self.server.send("GET", f"/jobs/{job['id']}").json()
            if found["ended_utc"] is not None:
                raise DeviceFault(f"bench doors: the {job['kind']} ended too early: {found['problem']}")
            return bool(found["state"] == "running" and found["progress"]["done"] >= 1)

        self.wait_for(f"the {job['kind']}", runs)

    def ask_beside(self, method: str, path: str, body: object) -> None:
        """Send a request on a separate thread; ignore its answer."""

        def ask() -> None:
            with suppress(httpx.HTTPError):
                self.server.send(method, path, body)

        threading.Thread(target=ask, daemon=True).start()

    def read_nothing(self, request: bytes) -> None:
        """Send a request on a separate connection, and read none of the answer."""
        address = httpx.URL(self.server.url)
        peer = self.stack.enter_context(socket.socket())
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SMALL_BUFFER_BYTES)
        peer.settimeout(PATIENCE_S)
        peer.connect((address.host, address.port))
        peer.sendall(request)
        peer.recv(1, socket.MSG_PEEK)
        time.sleep(_STALLED_S)


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """Work of a server at the time of SIGTERM; `replays`: it plays the recording in place of a rig."""

    begin: Begin
    options: Sequence[str] = ()
    replays: bool = False


def begin_idle(_work: RunningWork) -> None:
    """Do nothing."""


def begin_computing(work: RunningWork) -> None:
    """Request estimates, and a map of a picture that has nothing but edges."""
    picture = (np.random.default_rng(1).integers(0, 2, (NOISE_PX, NOISE_PX)) * 255).astype(np.uint8)
    text = base64.b64encode(cv2.imencode(".png", picture)[1].tobytes()).decode()
    before_s = used_cpu_s(work.server.process.pid)
    body = {"kind": "picture", "picture_base64": text, "m_per_px": 0.1}
    work.ask_beside("POST", "/planner/map", body)
    for _ in range(ESTIMATES):
        work.ask_beside("POST", "/captures/estimates", ESTIMATE)
    work.wait_for("the computation", lambda: used_cpu_s(work.server.process.pid) > before_s + 1.0)


def begin_streaming(work: RunningWork) -> None:
    """Open an MJPEG stream and the live views, and read neither."""
    host = httpx.URL(work.server.url).netloc.decode()
    work.read_nothing(f"GET /api/v1/views/wide/stream.mjpeg HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())


def begin_downloading(work: RunningWork) -> None:
    """Download a recording, and do not read it."""
    host = httpx.URL(work.server.url).netloc.decode()
    path = f"/api/v1/recordings/{_recording_id(work)}/download.fcap"
    work.read_nothing(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())


def begin_recording(work: RunningWork) -> None:
    """Make a complete recording, then start an endless one."""
    request = models.RecordingRequest(name=WHOLE, duration_s=RECORDED_S, rate="live")
    with server_rig(work.server.url, token=None) as rig:
        rig.wait(rig.api.recordings.create(request), timeout_s=PATIENCE_S)
    work.wait_for_job(work.start("/recordings", {"name": "endless", "duration_s": ENDLESS_S, "rate": "live"}))


def begin_replaying(work: RunningWork) -> None:
    """Play a recording."""
    url = f"{work.server.url}api/v1/views/wide/snapshot.jpg"
    work.wait_for("the replay", lambda: httpx.get(url, timeout=PATIENCE_S, trust_env=False).is_success)


def begin_capturing(work: RunningWork) -> None:
    """Capture a dataset of many points."""
    grid = {"kind": "grid", "columns": 30, "rows": 30}
    plan = {"points": grid, "verging": {"mode": "given", "distance_m": 2.0}}
    work.wait_for_job(work.start("/captures", {"name": "many points", "plan": plan}))


def begin_uploading(work: RunningWork) -> None:
    """Send half of a recording, then stall."""
    body = {"name": "half", "size_bytes": UPLOADED_BYTES}
    upload_id = work.server.send("POST", "/recordings/uploads", body).json()["id"]
    address = httpx.URL(work.server.url)
    peer = work.stack.enter_context(socket.create_connection((address.host, address.port)))
    path = f"/api/v1/recordings/uploads/{upload_id}?at=0"
    head = f"PUT {path} HTTP/1.1\r\nHost: {address.netloc.decode()}\r\nContent-Length: {UPLOADED_BYTES}\r\n"
    peer.sendall(
        f"{head}Content-Type: application/octet-stream\r\n\r\n".encode() + bytes(UPLOADED_BYTES // 2)
    )


def begin_calibrating(work: RunningWork) -> None:
    """Run all steps of a calibration."""
    session = work.start("/calibration_sessions", {"label": "to be ended"})
    run = work.start(f"/calibration_sessions/{session['id']}/runs", {"step": "all"})
    work.wait_for_job(run)


def begin_following(work: RunningWork) -> None:
    """Follow the target in the middle."""
    work.start("/follows", {"pixel": {"x_px": 700.0, "y_px": 500.0}})

    def follows() -> bool:
        return any(job["state"] == "running" for job in work.server.send("GET", "/jobs").json())

    work.wait_for("the following", follows)


def begin_archiving(work: RunningWork) -> None:
    """Archive a recording in storage that accepts connections and never answers."""
    work.start(f"/recordings/{_recording_id(work)}/archive", {"remove_local": False})
    work.stack.enter_context(work.storage.accept()[0])


def _recording_id(work: RunningWork) -> str:
    found = work.server.send("GET", "/recordings").json()
    return str(next(one["id"] for one in found if one["name"] == WHOLE))


def used_cpu_s(pid: int) -> float:
    """Return the processor time that a process and its children have used."""
    ticks = 0
    for process in process_family(pid):
        with suppress(OSError):  # it has ended
            fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


SITUATIONS: Mapping[str, Situation] = {
    "recording": Situation(begin=begin_recording),
    "computing": Situation(begin=begin_computing),
    "streaming": Situation(begin=begin_streaming),
    "downloading": Situation(begin=begin_downloading),
    "capturing": Situation(begin=begin_capturing),
    "replaying": Situation(begin=begin_replaying, replays=True),
    "uploading": Situation(begin=begin_uploading),
    "calibrating": Situation(begin=begin_calibrating, options=("--scene", "calibration")),
    "following": Situation(begin=begin_following),
    "archive": Situation(begin=begin_archiving, options=("--archive", "s3://rig/bench")),
    "idle": Situation(begin=begin_idle),
}
"""All but the training, which is not a server's. The first one leaves a recording that others use."""
