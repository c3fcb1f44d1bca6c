"""Events that go on after a broken connection, and waiting for a job by them or by asking."""

import asyncio
import json
import struct
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from foveacam_client import (
    AsyncRig,
    Connection,
    DeviceMissing,
    JobCancelled,
    JobInterrupted,
    NotAllowed,
    RetryPolicy,
    Rig,
    StartedJob,
    Unreachable,
    WaitTimeout,
    models,
)
from foveacam_client.waiting import Deadline

Document = dict[str, Any]  # Any: JSON

JOB: Document = {
    "id": "job-1",
    "kind": "wide_depth",
    "state": "running",
    "created_utc": "2026-01-01T00:00:00Z",
    "started_utc": "2026-01-01T00:00:00Z",
    "ended_utc": None,
    "progress": {"done": 0, "total": 4, "eta_s": None, "note": ""},
    "result_url": None,
    "problem": None,
}
PROBLEM = {
    "type": "/problems/not-connected",
    "title": "A device is not connected",
    "status": 503,
    "detail": "no eye",
}


def job(done: int = 4, *, eta_s: float | None = None, **more: object) -> Document:
    return {**JOB, "progress": {"done": done, "total": 4, "eta_s": eta_s, "note": ""}, **more}


def event(number: int, data: Document | None = None, kind: str = "job.updated") -> Document:
    return {
        "id": number,
        "kind": kind,
        "level": "info",
        "t_utc": "2026-01-01T00:00:00Z",
        "message": "",
        "data": data or {},
    }


def lines(*events: Document) -> bytes:
    """Return events as a stream has them, between what keeps the connection alive."""
    sent = [f"id: {one['id']}\nevent: {one['kind']}\ndata: {json.dumps(one)}\n\n" for one in events]
    return (": ping\n\n" + "".join(sent)).encode()


class CutStream(httpx.SyncByteStream):
    """A stream whose connection breaks after its content."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    def __iter__(self) -> Iterator[bytes]:
        yield self._content
        raise httpx.ReadError("gone")


class JobServer:
    """A server with one job: what asking for it gives in turn, and its streams of events in turn."""

    def __init__(self, *asked: Document, streams: tuple[httpx.Response, ...] = ()) -> None:
        self._asked = list(asked)
        self._streams = list(streams)
        self.paths: list[str] = []
        self.last_ids: list[str | None] = []
        self.pauses_s: list[float] = []
        self.recent = [event(40)]
        self.away = range(0)
        """The requests, from 1, at which nobody is there."""

    def __call__(self, request: httpx.Request) -> httpx.Response:
        path = request.url.path.removeprefix("/api/v1")
        self.paths.append(f"{request.method} {path}")
        if len(self.paths) in self.away:
            raise httpx.ConnectError("refused")
        if path == "/events":
            self.last_ids.append(request.headers.get("Last-Event-ID"))
            return self._streams.pop(0) if self._streams else httpx.Response(403, json={})
        if path == "/jobs/job-1":
            return httpx.Response(200, json=self._asked.pop(0) if len(self._asked) > 1 else self._asked[0])
        answers: dict[str, object] = {
            "/events/recent": self.recent,
            "/jobs/job-1/cancel": JOB,
            "/result": {"deleted": 3},
            "/fixations/fix-1": FIXATION,
        }
        if path == "/clouds/cld-1.ply":
            return httpx.Response(200, content=PLY + b"end_header\n" + struct.pack("<fff", 1.0, 2.0, 3.0))
        return httpx.Response(200, json=answers[path])

    def rig(self, retries: RetryPolicy | None = None) -> Rig:
        connection = Connection(retries=retries or RetryPolicy())
        return Rig(connection, http_transport=httpx.MockTransport(self), pause=self.pauses_s.append)


FIXATION: Document = {
    "id": "fix-1",
    "job_id": "job-1",
    "calibration_id": "cal-1",
    "cloud_id": None,
    "created_utc": "2026-01-01T00:00:00Z",
    "distance_m": None,
    "distance_sigma_m": None,
    "duration_ms": None,
    "point_rig_m": None,
    "reason": "",
    "request": {},
    "residual_px": None,
    "score": None,
    "state": "no_texture",
    "steps": [],
    "target": {"ax_deg": 0.0, "ay_deg": 0.0, "x_px": 0.0, "y_px": 0.0},
    "target_id": None,
}
PLY = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + b"".join(
    b"property float %c\n" % axis for axis in b"xyz"
)
STARTED = StartedJob(models.JobDocument.model_validate(JOB), models.TrashEmptied)
"""A job that results in the shortest of documents."""
FIXATING = StartedJob(models.JobDocument.model_validate(JOB), models.FixationDocument)
DONE = job(state="succeeded", result_url="/api/v1/result")


def stream(*events: Document) -> httpx.Response:
    return httpx.Response(200, content=lines(*events))


def cut(*events: Document, after: bytes = b"") -> httpx.Response:
    return httpx.Response(200, stream=CutStream(lines(*events) + after))


def test_events_go_on_after_the_last_one_when_the_connection_breaks() -> None:
    half = b'id: 43\ndata: {"id": 43, "ki'
    server = JobServer(JOB, streams=(cut(event(41), event(42), after=half), stream(event(43))))

    events = server.rig().events()

    assert [next(events).id for _ in range(3)] == [41, 42, 43]
    assert server.last_ids == ["40", "42"]
    assert len(server.pauses_s) == 1


def test_events_after_an_id_of_ones_own_and_of_some_kinds() -> None:
    server = JobServer(JOB, streams=(stream(event(8), event(9, kind="stop.engaged")),))

    events = server.rig().events(kinds=["stop.engaged"], last_event_id=7)

    assert next(events).id == 9
    assert server.last_ids == ["7"]


def estimate(number: int, step: int, job_id: str = "job-1") -> Document:
    data = {"fixation_id": "fix-1", "job_id": job_id, "step": step, "elapsed_ms": 9.0, "distance_m": 8.0}
    return event(number, data, kind="fixation.estimate")


def test_estimates_of_one_fixation_come_until_it_ends_also_those_before_it_is_asked() -> None:
    ended = event(45, DONE)
    later = stream(estimate(42, 1), estimate(43, 1, job_id="job-2"), estimate(44, 2), ended, estimate(46, 3))
    server = JobServer(JOB, streams=(later,))
    server.recent = [estimate(40, 0)]

    told = list(server.rig().estimates(FIXATING))

    assert [found.step for found in told] == [0, 1, 2]
    assert told[0].distance_m == 8.0
    assert server.last_ids == ["40"]


def test_estimates_of_a_fixation_that_has_ended_are_over() -> None:
    server = JobServer(DONE)
    server.recent = [estimate(40, 0)]

    assert [found.step for found in server.rig().estimates(FIXATING)] == [0]


def test_events_that_may_not_be_read_say_so() -> None:
    with pytest.raises(NotAllowed):
        next(JobServer(JOB).rig().events())


def test_events_of_a_server_that_stays_away_end_in_its_absence() -> None:
    server = JobServer(JOB, streams=(cut(), cut(), cut()))

    with pytest.raises(Unreachable):
        next(server.rig(RetryPolicy(reconnect_s=-1.0)).events())


def test_a_job_is_waited_for_by_events_with_its_progress() -> None:
    half_done = job(2, eta_s=1.5)
    told = stream(event(41, half_done), event(42, half_done), event(43, {"id": "job-2"}), event(44, DONE))
    server = JobServer(JOB, streams=(told,))
    progress: list[tuple[int, float | None]] = []

    found = server.rig().wait(STARTED, on_progress=lambda now: progress.append((now.done, now.eta_s)))

    assert found.deleted == 3
    assert progress == [(0, None), (2, 1.5), (4, None)]
    assert server.paths == ["GET /events/recent", "GET /jobs/job-1", "GET /events", "GET /result"]


def test_a_job_that_has_ended_opens_no_stream() -> None:
    server = JobServer(DONE)

    assert server.rig().wait(STARTED).deleted == 3
    assert "GET /events" not in server.paths


@pytest.mark.parametrize(
    "streams", [(), (cut(event(41, job(1))),), (stream(),)], ids=["none", "cut", "ended"]
)
def test_without_events_a_job_is_asked_for_once_a_second(streams: tuple[httpx.Response, ...]) -> None:
    server = JobServer(JOB, job(2), DONE, streams=streams)

    assert server.rig().wait(STARTED).deleted == 3
    assert server.pauses_s == [1.0, 1.0]


def test_a_job_is_asked_for_while_the_server_restarts() -> None:
    server = JobServer(JOB, DONE)
    server.away = range(3, 6)

    assert server.rig(RetryPolicy(attempts=1)).wait(STARTED).deleted == 3


def test_a_server_that_does_not_come_back_is_unreachable() -> None:
    server = JobServer(JOB)
    server.away = range(3, 1000)

    with pytest.raises(Unreachable):
        server.rig(RetryPolicy(attempts=1, reconnect_s=-1.0)).wait(STARTED)


def test_a_job_that_fails_raises_its_problem() -> None:
    with pytest.raises(DeviceMissing, match="no eye"):
        JobServer(job(state="failed", problem=PROBLEM)).rig().wait(STARTED)


def test_a_job_that_a_restart_ended_says_so() -> None:
    interrupted = {**PROBLEM, "type": "/problems/interrupted"}

    with pytest.raises(JobInterrupted):
        JobServer(job(state="failed", problem=interrupted)).rig().wait(STARTED)


def test_a_job_that_was_cancelled_says_so() -> None:
    cancelled = {**PROBLEM, "type": "/problems/cancelled", "status": 409}

    with pytest.raises(JobCancelled):
        JobServer(job(state="cancelled", problem=cancelled)).rig().wait(STARTED)


def test_a_wait_ends_when_its_time_is_over() -> None:
    now_s = 0.0
    deadline = Deadline(5.0, late="it goes on", clock_s=lambda: now_s)

    assert deadline.left_s(1.0) == 1.0
    now_s = 4.5
    assert deadline.left_s(1.0) == 0.5
    now_s = 5.0
    with pytest.raises(WaitTimeout, match="nothing after 5 s: it goes on"):
        deadline.left_s(1.0)


@pytest.mark.parametrize("cancel", [False, True])
def test_an_interrupt_cancels_the_job_only_where_asked(cancel: bool) -> None:
    server = JobServer(JOB, job(1))

    def interrupt(progress: models.JobProgress) -> None:
        if progress.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        server.rig().wait(STARTED, on_progress=interrupt, cancel_on_interrupt=cancel)

    assert ("POST /jobs/job-1/cancel" in server.paths) == cancel


def test_a_task_that_is_cancelled_cancels_its_job_where_asked() -> None:
    server = JobServer(JOB)

    async def wait() -> None:
        waits = asyncio.Event()

        async def pause(_: float) -> None:
            waits.set()
            await asyncio.Event().wait()

        async with AsyncRig(Connection(), http_transport=httpx.MockTransport(server), pause=pause) as rig:
            waiting = asyncio.create_task(rig.wait(STARTED, cancel_on_interrupt=True))
            await waits.wait()
            waiting.cancel()
            await asyncio.wait([waiting])
            assert waiting.cancelled()

    asyncio.run(wait())

    assert "POST /jobs/job-1/cancel" in server.paths


def test_the_asynchronous_client_waits_by_events_too() -> None:
    server = JobServer(JOB, streams=(stream(event(41, DONE)),))

    async def wait() -> int:
        async with AsyncRig(Connection(), http_transport=httpx.MockTransport(server)) as rig:
            return (await rig.wait(STARTED)).deleted

    assert asyncio.run(wait()) == 3


def test_a_point_cloud_is_read_as_soon_as_its_event_comes() -> None:
    created = {"id": "cld-1", "fixation_id": "fix-1"}
    other = {"id": "cld-0", "fixation_id": "fix-0"}
    told = stream(event(41, other, "cloud.created"), event(42, created, "cloud.created"))
    server = JobServer(JOB, streams=(told,))

    cloud = server.rig().cloud(models.FixationDocument.model_validate(FIXATION))

    assert cloud.points_rig_m.tolist() == [[1.0, 2.0, 3.0]]
    assert server.paths[-1] == "GET /clouds/cld-1.ply"


def test_a_fixation_that_gets_no_cloud_says_so() -> None:
    server = JobServer(JOB)

    with pytest.raises(WaitTimeout, match=r"fix-1 \(no_texture\) has no point cloud"):
        server.rig().cloud(models.FixationDocument.model_validate(FIXATION), timeout_s=0.0)
