"""Answers the client from a table of routes, and the documents that its tests have in common."""

import asyncio
import json
import struct
from collections.abc import Mapping
from typing import Any

import cv2
import httpx
import numpy as np

from foveacam_client import AsyncRig, Connection, RetryPolicy, Rig

Document = dict[str, Any]  # Any: JSON

JOB: Document = {
    "id": "job-1",
    "kind": "fixation",
    "state": "succeeded",
    "created_utc": "2026-01-01T00:00:00Z",
    "started_utc": "2026-01-01T00:00:00Z",
    "ended_utc": "2026-01-01T00:00:01Z",
    "progress": {"done": 4, "total": 4, "eta_s": None, "note": ""},
    "result_url": "/api/v1/result",
    "problem": None,
}
FIXATION: Document = {
    "id": "fix-1",
    "job_id": "job-1",
    "calibration_id": "cal-1",
    "cloud_id": "cld-1",
    "created_utc": "2026-01-01T00:00:00Z",
    "distance_m": 2.00131,
    "distance_sigma_m": 0.00124,
    "basis": "both_foveae",
    "duration_ms": 100.0,
    "point_rig_m": [0.0, 0.0, 2.0],
    "reason": "",
    "request": {},
    "residual_px": 0.1,
    "score": 0.9,
    "state": "verged",
    "steps": [],
    "target": {"ax_deg": 0.0, "ay_deg": 0.0, "x_px": 720.0, "y_px": 540.0},
    "target_id": "tgt-1",
}
CAPTURE: Document = {
    "id": "cap-1",
    "name": "desk",
    "folder": "/data/captures/desk",
    "label": "",
    "licence": "",
    "state": "complete",
    "why": "",
    "removed": False,
    "created_utc": None,
    "codec": "tiff",
    "rig_id": None,
    "calibration_id": None,
    "plan": None,
    "conditions": None,
    "points": {"planned": 2, "taken": 2, "skipped": 0, "scans": 1, "frames": 6},
    "size_bytes": 1,
    "resumable": False,
    "job_id": None,
    "progress": None,
    "archived": None,
    "url": "/api/v1/captures/cap-1",
}
RECORDING: Document = {
    "id": "rec-1",
    "name": "recording 0001",
    "label": "",
    "file": "/data/recordings/recording 0001.fcap",
    "state": "recording",
    "why": "",
    "removed": False,
    "created_utc": None,
    "asked_s": None,
    "calibration_id": None,
    "calibration_problem": None,
    "duration_s": 1.0,
    "ended": None,
    "job_id": "job-1",
    "left_s": 299.0,
    "playable": False,
    "rig_id": None,
    "room_bytes": None,
    "room_s": None,
    "size_bytes": 0,
    "streams": [],
    "truncated": None,
    "archived": None,
    "url": "/api/v1/recordings/rec-1",
}
FOLLOWED: Document = {
    "id": "fol-1",
    "label": "cup",
    "created_utc": "2026-01-01T00:00:00Z",
    "priority": 1.0,
    "state": "finding",
    "tracker": "template",
}
Answer = httpx.Response | Document | list[Document] | bytes | None


def ply(points_m: list[tuple[float, float, float]]) -> bytes:
    """Return grey points with a standard error of 1 mm, as the server writes them."""
    names = ["float x", "float y", "float z", "uchar red", "uchar green", "uchar blue", "float sigma"]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points_m)}"]
    lines = [*header, *(f"property {name}" for name in names), "end_header", ""]
    points = [struct.pack("<fff3Bf", *point_m, 10, 20, 30, 0.001) for point_m in points_m]
    return "\n".join(lines).encode() + b"".join(points)


def png(*, width: int = 4, height: int = 3, red: int = 200) -> bytes:
    """Return a picture of one colour."""
    picture = np.full((height, width, 3), (0, 0, red), dtype=np.uint8)
    return cv2.imencode(".png", picture)[1].tobytes()


def refusal(status: int, slug: str, detail: str) -> httpx.Response:
    """Return a problem document."""
    content = {"type": f"/problems/{slug}", "title": "Refused", "status": status, "detail": detail}
    return httpx.Response(status, json=content)


class StubServer:
    """Answers `METHOD /path` below /api/v1 from a table; any job has ended. Keeps what was asked."""

    def __init__(self, answers: Mapping[str, Answer]) -> None:
        self.answers: dict[str, Answer] = {
            "GET /events/recent": [],
            "GET /jobs/job-1": JOB,
            **answers,
        }
        self.asked: list[str] = []
        self.bodies: dict[str, Document] = {}

    def __call__(self, request: httpx.Request) -> httpx.Response:
        asked = f"{request.method} {request.url.path.removeprefix('/api/v1')}"
        self.asked.append(asked)
        if request.content and request.headers.get("Content-Type") == "application/json":
            self.bodies[asked] = json.loads(request.content)
        answer = self.answers.get(asked, refusal(404, "not-found", f"there is no {asked}"))
        if isinstance(answer, httpx.Response):
            return answer
        if answer is None:
            return httpx.Response(204)
        return (
            httpx.Response(200, content=answer)
            if isinstance(answer, bytes)
            else httpx.Response(200, json=answer)
        )

    def rig(self) -> Rig:
        """Return a client of this server."""
        connection = Connection(retries=RetryPolicy(attempts=1))
        return Rig(connection, http_transport=httpx.MockTransport(self), pause=lambda _: None)

    def async_rig(self) -> AsyncRig:
        """Return an asynchronous client of this server."""
        connection = Connection(retries=RetryPolicy(attempts=1))
        return AsyncRig(connection, http_transport=httpx.MockTransport(self), pause=asyncio.sleep)
