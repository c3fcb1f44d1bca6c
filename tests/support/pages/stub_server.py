"""A server that says what a test has put into it: documents, events, live pictures that never change.

For pages whose states a real rig reaches late or never: a refused node, a failed sweep, no pan-tilt.
"""

import asyncio
import copy
import json
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import HTMLResponse, JSONResponse, StreamingResponse

from foveacam_server.console import pages
from foveacam_server.console.page_policy import content_policy
from foveacam_server.rig.stream_messages import HEADER
from tests.support.pages import calibration_documents as documents
from tests.support.pages import engine_documents, rig_documents
from tests.support.pages.calibration_documents import SESSION_ID, Document
from tests.support.pages.calibration_results import UTC, settle_time
from tests.support.pages.stub_people import StubPeople
from tests.support.pages.stub_people import problem as problem  # the tests of the pages take it from here
from tests.support.pages.stub_steering import StubSteering
from tests.support.servers.local_server import serving
from tests.support.servers.server_process import PATIENCE_S

Json = Any  # what tests put in and look at: any JSON value
END = ""  # of an event stream
PROCEDURES = ("/runs", "/drift_checks", "/acceptances")
"""Ends of the paths that begin a procedure of the calibration."""
VIEWS = ["wide", "left", "right", "anaglyph", "difference", "depth"]
VIEWS += ["calibration_wide", "calibration_left", "calibration_right"]
LIVE_SCALE = 10
"""Live pictures have a tenth of the size that is told of them, so that the browser decodes and draws less."""


@dataclass
class StubServer:
    """What it answers, by path below /api/v1, and what it was asked."""

    answers: dict[str, Json] = field(default_factory=dict)
    refusals: dict[str, Document] = field(default_factory=dict)
    answers_after: dict[str, dict[str, Json]] = field(default_factory=dict)
    """What it answers from an order on, by "METHOD path"."""
    requests: list[tuple[str, str, Json]] = field(default_factory=list)
    annotated: bool = False
    follow_marks: list[Document] | None = None
    """The followed targets of the overlay message of each wide picture; None: there is no such message."""
    away: bool = False
    """Whether it serves no views, as while it restarts."""
    steering: StubSteering = field(default_factory=StubSteering)
    people: StubPeople = field(default_factory=StubPeople)
    url: str = ""
    _ids: int = 0
    _loop: asyncio.AbstractEventLoop | None = None
    _listeners: list[asyncio.Queue[str]] = field(default_factory=list)
    _former: list[asyncio.Queue[str]] = field(default_factory=list)

    def reset(self, session: Document | None = None) -> None:
        """Begin anew: a calibrated rig with a pan-tilt, and this session or none."""
        self.refusals.clear()
        self.answers_after.clear()
        self.requests.clear()
        self.annotated = self.away = False
        self.follow_marks = None
        self.steering = StubSteering()
        self.people = StubPeople()
        self._former += self._listeners  # pages of the tests before
        self._listeners.clear()
        records = [
            documents.record("a" * 32, "Bench, spring", current=True),
            documents.record("b" * 32, "As delivered", origin="factory", age_s=9e6),
        ]
        self.answers = {
            "/rig": documents.rig(),
            "/calibrations": records,
            "/calibrations/health": documents.health(),
            "/calibration_sessions": [],
            "/pan_tilt": documents.pan_tilt(),
            "/rail": rig_documents.rail(),
            "/rig/start": rig_documents.start(),
            "/settle_time": settle_time(),
            "/cameras/self_tests/newest": rig_documents.trigger_test(),
            "/drift_checks": [],
            "/acceptances": [],
            "/displays": [],
            "/displays/pattern": {
                "pattern": {"kind": "blank"},
                "description": "blank",
                "width_mm": None,
                "height_mm": None,
            },
            "/jobs": [],
            "/fixations": [],
            "/fixations/estimates": [],
            "/reach": documents.reach(),
            "/suggestions": [],
            "/suggestions/checks": [],
            "/engine": engine_documents.engine(),
            "/mirrors": documents.rig()["mirrors"],
            "/targets": [],
            "/clouds": [],
            "/follows": [],
            "/events/recent": [],
            "/faults": [],
            "/stop": {"engaged": False, "since_utc": None, "by": None},
            "/lease": {"holder": None, "expires_in_s": None},
        }
        if session is not None:
            self.session = session

    @property
    def session(self) -> Document:
        found: Document = self.answers[f"/calibration_sessions/{SESSION_ID}"]
        return found

    @session.setter
    def session(self, session: Document) -> None:
        self.answers[f"/calibration_sessions/{session['id']}"] = session
        self.answers["/calibration_sessions"] = [session]

    @property
    def silent_roles(self) -> set[str]:
        """Cameras that deliver too little to be shown."""
        links = {camera["role"]: camera["link"] for camera in self.answers["/rig"]["cameras"]}
        return {role for role, link in links.items() if link is not None and link["phase"] != "streaming"}

    def set_job(self, job: Document) -> None:
        """Let this job be the one that runs, or that ran, in the session."""
        self.answers["/jobs"] = [job]
        over = job["ended_utc"] is not None
        self.session = self.session | {"running": None if over else job["id"]}
        self.send_event("job.updated", job)

    def send_event(self, kind: str, data: Document, *, level: str = "info") -> None:
        """Send an event to every page; what it tells of a job or an estimate can be read from then on."""
        if kind == "job.updated":
            self.answers[f"/jobs/{data['id']}"] = data
        elif kind in ("fixation.estimate", "fixation.done"):
            self.answers["/fixations/estimates"] = [data] if kind == "fixation.estimate" else []
        self._ids += 1
        event = {
            "id": self._ids,
            "kind": kind,
            "level": level,
            "t_utc": UTC,
            "message": kind,
            "data": data,
        }
        text = f"event: {kind}\nid: {self._ids}\ndata: {json.dumps(event)}\n\n"
        loop = self._loop
        if loop is not None:
            for queue in list(self._listeners):
                loop.call_soon_threadsafe(queue.put_nowait, text)

    def wait_for_listener(self, *, within_s: float = 20.0) -> None:
        """Wait until a page listens to events: what is told before is lost."""
        end_s = time.monotonic() + within_s
        while not self._listeners:
            if time.monotonic() > end_s:
                raise AssertionError(f"within {within_s} s no page listened to the events")
            time.sleep(0.02)

    def posted_bodies(self, path: str, *, count: int = 1) -> list[Json]:
        """Return the bodies that were posted to a path, once so many have come."""
        return self.bodies_of("POST", path, count=count)

    def bodies_of(self, method: str, path: str, *, count: int = 1) -> list[Json]:
        """Return the bodies of such requests, once so many have come: a click is over before its request."""
        end_s = time.monotonic() + PATIENCE_S
        while len(found := [body for *asked, body in self.requests if asked == [method, path]]) < count:
            assert time.monotonic() < end_s, f"within {PATIENCE_S} s: {len(found)} of {count} {method} {path}"
            time.sleep(0.02)
        return found

    def sign_out(self) -> None:
        """Know the browser no more, and end its streams."""
        self.people.signed_out = True
        self._end(self._listeners)

    def leave_pages(self) -> None:
        """End the streams of pages that tests before this one left open: they read everything anew."""
        self._end(self._former)

    def _end(self, streams: list[asyncio.Queue[str]]) -> None:
        if self._loop is not None:
            for queue in list(streams):
                self._loop.call_soon_threadsafe(queue.put_nowait, END)

    async def events(self) -> AsyncIterator[str]:
        self._loop = asyncio.get_running_loop()
        queue: asyncio.Queue[str] = asyncio.Queue()
        self._listeners.append(queue)
        try:
            yield ": here\n\n"
            while (text := await queue.get()) != END:
                yield text
        finally:
            for streams in (self._listeners, self._former):
                if queue in streams:
                    streams.remove(queue)

    def answer(self, method: str, path: str, body: Json) -> tuple[int, Json]:
        """Return status and document; an order that nobody has put in gets what its kind usually gets."""
        self.requests.append((method, path, body))
        refusal = self.refusals.get(f"{method} {path}")
        if refusal is not None:
            return refusal["status"], refusal
        if (answer := self.people.answer(method, path, body)) is not None:
            return answer
        if method == "GET":
            known = self.answers.get(path)
            return (404, problem(404, "Not found", f"there is no {path}")) if known is None else (200, known)
        self.answers |= self.answers_after.pop(f"{method} {path}", {})
        return self._obey(method, path, body)

    def _obey(self, method: str, path: str, body: Json) -> tuple[int, Json]:
        if path == "/calibration_sessions":
            self.session = documents.empty_session(label=body["label"])
            return 201, self.session
        if path.endswith(PROCEDURES):
            posts = [asked for method, asked, _ in self.requests if method == "POST"]
            job_id = f"job-{sum(asked.endswith(PROCEDURES) for asked in posts)}"
            kind = "acceptance" if path == "/acceptances" else f"calibration.{body.get('step', 'drift')}"
            job = documents.job(job_id, kind=kind, changes={"progress": None})
            self.answers[f"/jobs/{job_id}"] = job
            return 202, job
        if path.startswith(("/pan_tilt/", "/rail/")):
            return 200, self.answers[f"/{path.split('/')[1]}"]
        if path.startswith("/cameras/") and method in ("PATCH", "DELETE"):
            self.answers["/rig"], answer = rig_documents.changed(
                self.answers["/rig"], path.split("/")[2], body
            )
            return 200, answer
        if method == "POST" and path == "/follows":
            return 201, self.answers[path][-1]
        if path == "/settle_time":
            measured_us = self.session["settle"]["settle_us"] if method == "PUT" else None
            self.answers[path] = settle_time(measured_us)
            return 200, self.answers[path]
        if path.startswith("/mirrors/"):
            return 200, self.answers["/rig"]["mirrors"]
        if method == "DELETE" and "/wide_samples/" in path:
            session = copy.deepcopy(self.session)
            gone = path.rsplit("/", 1)[1]
            session["wide"]["samples"] = [each for each in session["wide"]["samples"] if each["id"] != gone]
            self.session = session
            return 200, session
        if method == "DELETE" and "/lenses/" in path:
            return 200, self.session
        return 200, self.answers.get(path, {})


@lru_cache(maxsize=64)
def picture(name: str, *, width: int = 720, height: int = 540) -> bytes:
    """Return a JPEG that has its name written on it."""
    y, x = np.mgrid[0:height, 0:width]
    shade = (90 + 60 * np.sin(x / 40.0) * np.cos(y / 33.0)).astype(np.uint8)
    image = cv2.cvtColor(shade, cv2.COLOR_GRAY2BGR)
    cv2.putText(image, name, (20, height // 2), cv2.FONT_HERSHEY_SIMPLEX, width / 480, (255, 255, 255), 2)
    return cv2.imencode(".jpg", image)[1].tobytes()


def application(stub: StubServer) -> FastAPI:
    """Return the page and the answers as one application."""
    app = FastAPI(openapi_url=None)

    @app.get("/")
    def page() -> Response:
        if stub.people.signed_out:
            return HTMLResponse("<title>Sign in</title><h1>Sign in</h1>", status_code=401)
        response = pages.console()
        response.headers["Content-Security-Policy"] = content_policy()
        return response

    pages.install(app)

    @app.websocket("/api/v1/views/ws")
    async def views(socket: WebSocket) -> None:
        await _serve_views(socket, stub)

    @app.websocket("/api/v1/mirrors/steering")
    async def steering(socket: WebSocket) -> None:
        await stub.steering.serve(socket)

    @app.get("/api/v1/events")
    async def events() -> Response:
        if stub.people.signed_out:
            return JSONResponse(stub.answer("GET", "/events", None)[1], status_code=401)
        return StreamingResponse(stub.events(), media_type="text/event-stream")

    @app.api_route("/api/v1/{path:path}", methods=["GET", "POST", "PUT", "PATCH", "DELETE"])
    async def rest(path: str, request: Request) -> Response:
        if path.endswith((".png", ".jpg", ".svg")):
            return Response(picture(Path(path).name), media_type="image/jpeg")
        body = json.loads(await request.body() or b"null")
        with_query = path == "audit" or (path.startswith("users/") and request.url.query)
        asked = f"/{path}?{request.url.query}" if with_query else f"/{path}"
        status, document = stub.answer(request.method, asked, body)
        return Response(status_code=204) if status == 204 else JSONResponse(document, status_code=status)

    return app


async def _serve_views(socket: WebSocket, stub: StubServer) -> None:
    """Send each view that is subscribed at once, and again after it was acknowledged, as the server does."""
    if stub.away or stub.people.signed_out:
        await socket.close()
        return
    await socket.accept()
    listed = [{"index": index, "name": name, "width": 720, "height": 540} for index, name in enumerate(VIEWS)]
    await socket.send_json({"type": "hello", "views": listed, "server": "stub"})
    subscribed: set[str] = set()
    acknowledged: set[str] = set()
    sender = asyncio.create_task(_send_rates(socket, stub, acknowledged))
    try:
        while True:
            message = await socket.receive_json()
            if message["type"] == "subscribe":
                subscribed = set(message["views"])
                acknowledged.clear()
                for name in subscribed:
                    await _send_picture(socket, stub, name)
            elif (name := VIEWS[message["view"]]) in subscribed:
                acknowledged.add(name)
    except WebSocketDisconnect:
        pass
    finally:
        sender.cancel()


async def _send_rates(socket: WebSocket, stub: StubServer, acknowledged: set[str]) -> None:
    """Twice a second tell the rates, and send the views that wait for their next picture."""
    with suppress(WebSocketDisconnect, RuntimeError):
        while not (stub.away or stub.people.signed_out):
            drawn = [name for name in VIEWS if stub.annotated or "_" not in name]
            age_ms = {name: 20.0 if name in drawn else None for name in VIEWS}
            views = {
                name: {"rate_hz": 20.0, "age_ms": age, "frozen_since_ms": None}
                for name, age in age_ms.items()
            }
            await socket.send_json({"type": "stats", "views": views})
            for name in acknowledged - stub.silent_roles:
                acknowledged.discard(name)
                await _send_picture(socket, stub, name)
            await asyncio.sleep(0.5)
        await socket.close()


async def _send_picture(socket: WebSocket, stub: StubServer, name: str) -> None:
    if name == "wide" and stub.follow_marks is not None:
        blank = {"left": None, "right": None}
        overlay = {"type": "overlay", "seq": 1, "footprints": blank, "gaze": blank}
        await socket.send_json(overlay | {"follows": stub.follow_marks})
    header = HEADER.pack(VIEWS.index(name), LIVE_SCALE, 0, 1, 1, 20_000, 1)
    await socket.send_bytes(header + picture(name, width=720 // LIVE_SCALE, height=540 // LIVE_SCALE))


@contextmanager
def serving_stub() -> Iterator[StubServer]:
    """Serve a stub until the context ends."""
    stub = StubServer()
    stub.reset()
    with serving(application(stub)) as port:
        stub.url = f"http://127.0.0.1:{port}/"
        yield stub
