import json
import logging
from collections.abc import Iterator

import pytest

from foveacam_server.foundation.watching.log_lines import (
    JsonLines,
    TextLines,
    WorkIds,
    choose_format,
    configure_logging,
)
from foveacam_server.foundation.watching.work_ids import JOB_ID, REQUEST_ID

SECRET = "s3cr3t-0f-th3-l4b"  # noqa: S105  # a secret of these tests alone


@pytest.fixture
def at_work() -> Iterator[None]:
    request, job = REQUEST_ID.set("req-1"), JOB_ID.set("job-2")
    yield
    REQUEST_ID.reset(request)
    JOB_ID.reset(job)


def record(message: str, *values: object, error: Exception | None = None) -> logging.LogRecord:
    failure = None if error is None else (type(error), error, error.__traceback__)
    found = logging.LogRecord("foveacam.test", logging.WARNING, __file__, 1, message, values, failure)
    WorkIds().filter(found)
    return found


def test_json_line_has_its_request_and_job(at_work: None) -> None:
    line = json.loads(JsonLines().format(record("look %d\nfailed", 3)))
    assert line.pop("time_utc").endswith("+00:00")
    assert line == {
        "level": "WARNING",
        "logger": "foveacam.test",
        "message": "look 3\nfailed",
        "request_id": "req-1",
        "job_id": "job-2",
        "exception": None,
    }
    assert "\n" not in JsonLines().format(record("look %d\nfailed", 3))


def test_json_line_has_the_traceback_of_an_exception() -> None:
    error = ZeroDivisionError("no distance")
    line = json.loads(JsonLines().format(record("failed", error=error)))
    assert (line["request_id"], line["job_id"]) == (None, None)
    assert line["exception"].endswith("ZeroDivisionError: no distance")


def test_text_line_names_request_and_job_where_there_are_any(at_work: None) -> None:
    assert TextLines().format(record("slow")) == "WARNING: slow [request req-1, job job-2]"
    JOB_ID.set(None)
    REQUEST_ID.set(None)
    assert TextLines().format(record("slow")) == "WARNING: slow"


@pytest.mark.parametrize(
    "message",
    [
        f"GET /?token={SECRET} 303",
        f"http://rig:8000/join?code={SECRET}",
        f"HTTP Request: GET https://provider/callback?state={SECRET}&code={SECRET} 200",
        f"authorization: Bearer {SECRET}",
        f"[(b'Host', b'rig'), (b'Authorization', b'Bearer {SECRET}'), (b'Accept', b'*/*')]",
        f"(b'Cookie', b'foveacam={SECRET}')",
        f"< set-cookie: foveacam_session={SECRET}; HttpOnly",
        f"X-Lease: {SECRET}",
        f'{{"name": "ada", "password": "{SECRET}"}}',
        f"code_verifier={SECRET}&client_secret={SECRET}",
        f"the header was Bearer {SECRET}",
    ],
)
@pytest.mark.parametrize("lines", [TextLines(), JsonLines()])
def test_secrets_are_hidden(lines: logging.Formatter, message: str) -> None:
    failed = record("%s", message, error=RuntimeError(message))
    assert SECRET not in lines.format(failed)


def test_what_is_no_secret_stays(at_work: None) -> None:
    told = "camera left: token of the lease asked for; exit code 3; key=left"
    assert told in TextLines().format(record(told))


def test_the_format_holds_for_every_logger(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    root = logging.getLogger()
    monkeypatch.setattr(root, "handlers", [])
    configure_logging()
    choose_format("json")
    logging.getLogger("some.library").warning("slow")
    assert json.loads(capsys.readouterr().err)["message"] == "slow"
