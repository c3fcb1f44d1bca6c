"""How the client sends, repeats, reads and saves; the server is a function in this process."""

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from starlette.responses import JSONResponse
from starlette.types import Receive, Scope, Send
from tests.support.servers.certificates import written_certificate
from tests.support.servers.local_server import serving

import foveacam_client
from foveacam_client import (
    AsyncRig,
    ClientError,
    Connection,
    DeviceMissing,
    NotAllowed,
    ProblemError,
    RetryPolicy,
    Rig,
    RigBusy,
    TargetOutOfRange,
    TooManyRequests,
    UnexpectedAnswer,
    Unreachable,
    models,
)
from foveacam_client.connection import token_of

JOB = {
    "id": "job-1",
    "kind": "fixation",
    "state": "queued",
    "created_utc": "2026-01-01T00:00:00Z",
    "started_utc": None,
    "ended_utc": None,
    "progress": {"done": 0, "total": 4, "eta_s": None, "note": ""},
    "result_url": None,
    "problem": None,
}
REQUEST = models.FixationRequest(pixel=models.Pixel(x_px=700, y_px=520))


class FakeServer:
    """Answers in the given order, the last one again and again, and keeps requests and pauses."""

    def __init__(self, *answers: httpx.Response | Exception) -> None:
        self._answers = list(answers)
        self.requests: list[httpx.Request] = []
        self.pauses_s: list[float] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        answer = self._answers.pop(0) if len(self._answers) > 1 else self._answers[0]
        if isinstance(answer, Exception):
            raise answer
        return answer

    def rig(self, **more: object) -> Rig:
        connection = Connection(**more)  # type: ignore[arg-type]  # as the test names them
        return Rig(connection, http_transport=httpx.MockTransport(self), pause=self.pauses_s.append)


def problem(
    status: int, slug: str = "busy", detail: str = "the rig captures", **headers: str
) -> httpx.Response:
    document = {
        "type": f"/problems/{slug}",
        "title": "Busy",
        "status": status,
        "detail": detail,
        "remedy": "wait for it",
    }
    names = {name.replace("_", "-"): value for name, value in headers.items()}
    return httpx.Response(status, json=document, headers=names)


def opening() -> httpx.Response:
    return problem(503, "not-connected", Retry_After="2")


EMPTY = httpx.Response(200, json=[])


def test_a_server_that_is_not_ready_answers_what_is_missing() -> None:
    server = FakeServer(httpx.Response(503, json={"ready": False, "problems": []}))

    assert not server.rig().api.health.readyz().ready
    assert len(server.requests) == 1


def test_a_problem_is_an_exception_with_its_own_words() -> None:
    rig = FakeServer(problem(409, X_Request_Id="r-7")).rig()

    with pytest.raises(RigBusy, match="the rig captures wait for it") as raised:
        rig.api.fixations.create(REQUEST)

    error = raised.value
    assert (error.title, error.detail, error.remedy) == (
        "Busy",
        "the rig captures",
        "wait for it",
    )
    assert (error.status, error.slug, error.request_id) == (409, "busy", "r-7")


def test_a_remedy_that_the_detail_ends_with_is_said_once() -> None:
    rig = FakeServer(problem(409, detail="the rig captures; wait for it")).rig()

    with pytest.raises(RigBusy, match=r"^Busy: the rig captures; wait for it$"):
        rig.api.fixations.create(REQUEST)


@pytest.mark.parametrize(
    ("status", "slug", "kind"),
    [(422, "out-of-range", TargetOutOfRange), (403, "forbidden", NotAllowed), (418, "teapot", ProblemError)],
)
def test_problems_are_told_apart_by_their_stable_type_and_status(
    status: int, slug: str, kind: type[ProblemError]
) -> None:
    with pytest.raises(kind):
        FakeServer(problem(status, slug)).rig().api.stop.get()


def test_an_answer_of_a_proxy_without_a_problem_document_is_worded() -> None:
    with pytest.raises(ProblemError, match="GET /healthz was answered with 508"):
        FakeServer(httpx.Response(508, text="<html>")).rig().api.health.healthz()


def test_a_server_of_something_else_is_told() -> None:
    with pytest.raises(UnexpectedAnswer, match="of another version"):
        FakeServer(httpx.Response(200, text="hello")).rig().api.health.healthz()


def test_fields_that_a_newer_server_has_are_left_out() -> None:
    newer = httpx.Response(200, json={"problems": [], "ready": True, "new": 1})

    assert FakeServer(newer).rig().api.health.readyz().ready


@pytest.mark.parametrize("failure", [httpx.ConnectError("refused"), problem(503), problem(502), problem(429)])
def test_a_read_is_repeated_with_growing_pauses(failure: httpx.Response | Exception) -> None:
    server = FakeServer(failure, failure, EMPTY)

    assert server.rig().api.captures.list() == []

    first_s, second_s = server.pauses_s
    assert 0.1 <= first_s <= 0.2 <= second_s <= 0.4


def test_a_server_that_stays_away_is_unreachable_after_the_attempts() -> None:
    server = FakeServer(httpx.ConnectError("refused"))

    with pytest.raises(Unreachable, match="is the server running"):
        server.rig(retries=RetryPolicy(attempts=3)).api.captures.list()

    assert len(server.requests) == 3


def test_what_changes_something_is_sent_once() -> None:
    server = FakeServer(httpx.ReadError("gone"))

    with pytest.raises(Unreachable):
        server.rig().api.mirrors.park()

    assert len(server.requests) == 1


def test_a_job_is_asked_for_again_with_the_same_key() -> None:
    server = FakeServer(httpx.ReadError("gone"), httpx.Response(202, json=JOB))

    started = server.rig().api.fixations.create(REQUEST)

    first, second = (request.headers["Idempotency-Key"] for request in server.requests)
    assert started.id == "job-1"
    assert first == second
    assert len(first) == 32


def test_two_calls_have_keys_of_their_own_and_one_can_be_given() -> None:
    server = FakeServer(httpx.Response(202, json=JOB))
    rig = server.rig()

    rig.api.fixations.create(REQUEST)
    rig.api.fixations.create(REQUEST)
    rig.api.fixations.create(REQUEST, idempotency_key="mine")

    first, second, third = (request.headers["Idempotency-Key"] for request in server.requests)
    assert first != second
    assert third == "mine"


def test_retry_after_is_waited_for() -> None:
    server = FakeServer(problem(429, Retry_After="3"), EMPTY)

    server.rig().api.captures.list()

    assert server.pauses_s == [3.0]


def test_a_long_retry_after_is_told_instead_of_waited_for() -> None:
    server = FakeServer(problem(429, "too-many-tries", Retry_After="60"))

    with pytest.raises(TooManyRequests) as raised:
        server.rig().api.captures.list()

    assert raised.value.retry_after_s == 60.0
    assert server.pauses_s == []


def test_a_refusal_that_stays_is_raised_after_the_attempts() -> None:
    with pytest.raises(DeviceMissing):
        FakeServer(problem(503, "not-connected")).rig().api.rig.get()


def test_bodies_leave_out_what_was_not_set_and_keep_what_names_a_kind() -> None:
    server = FakeServer(httpx.Response(202, json=JOB))
    plan = models.RasterPlan(points=models.GridPoints(columns=2, rows=3))

    server.rig().api.captures.create(models.CaptureRequest(name="desk", plan=plan))

    sent = json.loads(server.requests[0].content)
    assert sent["plan"]["points"] == {
        "kind": "grid",
        "columns": 2,
        "rows": 3,
        "centre_ax_deg": 0.0,
        "centre_ay_deg": 0.0,
        "order": "serpentine",
    }
    assert "verging" not in sent["plan"]


def test_paths_and_queries_are_quoted() -> None:
    server = FakeServer(httpx.Response(200, json=[]), httpx.Response(204))
    rig = server.rig(url="http://127.0.0.1:8000/rigs/one")

    rig.api.captures.list(text="a&b", removed="true")
    rig.api.camera_presets.delete("dim light/1")

    first, second = (request.url.raw_path for request in server.requests)
    assert first == b"/rigs/one/api/v1/captures?text=a%26b&removed=true"
    assert second == b"/rigs/one/api/v1/cameras/presets/dim%20light%2F1"


def test_a_password_is_sent_as_it_is() -> None:
    sent = models.SignInRequest(name="ann", password="correct horse").model_dump(mode="json")  # noqa: S106

    assert sent["password"] == "correct horse"  # noqa: S105


def test_a_token_comes_from_the_argument_the_file_or_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FOVEACAM_TOKEN", "of the environment")
    (tmp_path / "token").write_text("of the file\n")

    assert token_of("given", tmp_path / "token") == "given"
    assert token_of(None, tmp_path / "token") == "of the file"
    assert token_of(None, None) == "of the environment"
    with pytest.raises(ClientError, match="cannot be read"):
        token_of(None, tmp_path / "none")


def test_the_token_is_sent_and_not_shown() -> None:
    server = FakeServer(EMPTY)
    connection = Connection(token="fcd_secret")  # noqa: S106

    Rig(connection, http_transport=httpx.MockTransport(server)).api.captures.list()

    assert server.requests[0].headers["Authorization"] == "Bearer fcd_secret"
    assert "secret" not in repr(connection)


@pytest.mark.parametrize("url", ["127.0.0.1:8000", "ftp://rig", "http://", "http://rig:port"])
def test_what_is_no_address_is_told(url: str) -> None:
    with pytest.raises(ClientError, match="no address"):
        foveacam_client.connect(url)


def test_a_certificate_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ClientError, match="cannot be read"):
        foveacam_client.connect("https://rig", ca_file=tmp_path / "none.pem")


async def ready(scope: Scope, receive: Receive, send: Send) -> None:
    await JSONResponse({"problems": [], "ready": True})(scope, receive, send)


def test_a_private_authority_is_believed_where_its_certificate_is_given(tmp_path: Path) -> None:
    certificate, key = written_certificate(tmp_path, "127.0.0.1")
    with serving(ready, certificate=(certificate, key)) as port:
        url = f"https://127.0.0.1:{port}"

        with foveacam_client.connect(url, ca_file=certificate) as rig:
            assert rig.api.health.readyz().ready
        unknown = Connection(url=url, retries=RetryPolicy(attempts=1))
        with Rig(unknown) as rig, pytest.raises(Unreachable, match="certificate"):
            rig.api.health.readyz()


class BrokenBody(httpx.SyncByteStream):
    """A body whose connection breaks in the middle."""

    def __iter__(self) -> Iterator[bytes]:
        yield b"half"
        raise httpx.ReadError("gone")


def test_a_file_whose_connection_breaks_is_read_anew_and_appears_whole(tmp_path: Path) -> None:
    broken = httpx.Response(200, stream=BrokenBody())
    server = FakeServer(broken, httpx.Response(200, content=b"whole"))

    server.rig().download_dataset("cap-1", tmp_path / "desk.zip")

    assert (tmp_path / "desk.zip").read_bytes() == b"whole"
    assert [path.name for path in tmp_path.iterdir()] == ["desk.zip"]


def test_a_file_that_never_comes_whole_leaves_nothing_and_keeps_the_old_one(tmp_path: Path) -> None:
    (tmp_path / "desk.zip").write_bytes(b"old")
    server = FakeServer(httpx.Response(200, stream=BrokenBody()))
    rig = server.rig(retries=RetryPolicy(attempts=1))

    with pytest.raises(Unreachable):
        rig.download_dataset("cap-1", tmp_path / "desk.zip")

    assert [path.name for path in tmp_path.iterdir()] == ["desk.zip"]
    assert (tmp_path / "desk.zip").read_bytes() == b"old"


def test_the_asynchronous_client_repeats_in_the_same_way() -> None:
    server = FakeServer(httpx.ConnectError("refused"), httpx.Response(202, json=JOB))

    async def pause(pause_s: float) -> None:
        server.pauses_s.append(pause_s)

    async def ask() -> str:
        async with AsyncRig(Connection(), http_transport=httpx.MockTransport(server), pause=pause) as rig:
            return (await rig.api.fixations.create(REQUEST)).id

    assert asyncio.run(ask()) == "job-1"
    first, second = (request.headers["Idempotency-Key"] for request in server.requests)
    assert first == second
    assert len(server.pauses_s) == 1


def test_a_rig_that_opens_is_waited_for_whatever_the_call() -> None:
    server = FakeServer(*[opening()] * 9, problem(409))
    with server.rig() as rig, pytest.raises(RigBusy):
        rig.api.mirrors.park()  # no job and no read: else sent once
    assert server.pauses_s == [2.0] * 9
    server = FakeServer(*[opening()] * 9, httpx.Response(202, json=JOB))
    with server.rig() as rig:
        rig.api.fixations.create(REQUEST)
    keys = {request.headers["Idempotency-Key"] for request in server.requests}
    assert (len(server.requests), len(keys)) == (10, 1)


def test_a_rig_that_opens_for_too_long_is_an_error() -> None:
    server = FakeServer(opening())
    with server.rig(retries=RetryPolicy(opening_s=7.0, attempts=1)) as rig, pytest.raises(DeviceMissing):
        rig.api.mirrors.park()
    assert server.pauses_s == [2.0] * 3


def test_a_missing_device_is_not_waited_for() -> None:
    server = FakeServer(problem(503, "not-connected"))
    with server.rig() as rig, pytest.raises(DeviceMissing):
        rig.api.mirrors.park()
    assert server.pauses_s == []
