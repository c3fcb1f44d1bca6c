"""`foveacam doctor --server`: a server that runs, as a client finds it."""

import asyncio
import json
import ssl
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI, Response
from pydantic import SecretStr
from typer.testing import CliRunner

from foveacam_hardware.contract import InvalidInput
from foveacam_server.accounts.rights import Right, UserRole
from foveacam_server.checks.findings import Finding
from foveacam_server.cli import app
from foveacam_server.doctor import running_server
from foveacam_server.doctor.running_server import examine_server
from tests.support.servers.certificates import written_certificate
from tests.support.servers.local_server import serving
from tests.support.servers.running_server import Running, running

PASSWORD = "correct horse battery"  # noqa: S105  # a password of this test alone


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("lab"), host="0.0.0.0") as found:  # noqa: S104 - the guarded case
        found.services.accounts.users.add("ada", UserRole.ADMIN, password=PASSWORD)
        yield found


def found(lab: Running, token: str | None = None) -> dict[str, Finding]:
    secret = None if token is None else SecretStr(token)
    return {each.name: each for each in examine_server(f"http://127.0.0.1:{lab.port}", token=secret)}


def token_of(lab: Running, *scopes: Right) -> str:
    name = f"doctor {len(lab.services.accounts.tokens.all())}"
    return lab.services.accounts.tokens.add(name, frozenset(scopes), days=1, created_by="test")[0]


def test_a_server_that_works_is_found_so(lab: Running) -> None:
    findings = found(lab, token_of(lab, Right.VIEW))
    assert list(findings) == [
        "server",
        "clock",
        "sign_in",
        "version",
        "rig",
        "calibration",
        "events",
        "views",
    ]
    assert {each.level for each in findings.values()} <= {"ok", "warning"}
    assert findings["rig"].level == findings["events"].level == findings["views"].level == "ok"
    assert findings["sign_in"].found.endswith("may view")


def test_who_is_not_known_is_told_how_to_be(lab: Running) -> None:
    for token in (None, "fcd_of_nobody_at_all"):
        assert "People" in found(lab, token)["sign_in"].remedy
    assert "may not view" in found(lab, token_of(lab, Right.OPERATE))["sign_in"].found


def test_what_is_wrong_is_named(lab: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    token = token_of(lab, Right.VIEW)
    monkeypatch.setattr(running_server, "__version__", "9.9")
    monkeypatch.setattr(running_server, "CLOCK_OFF_S", -1.0)
    monkeypatch.setattr(running_server, "SLOW_MS", 0.0)
    lab.services.stop.engage("test")
    try:
        findings = found(lab, token)
    finally:
        lab.services.stop.release("test")
    assert findings["version"].level == findings["clock"].level == findings["server"].level == "warning"
    assert "this program 9.9" in findings["version"].found
    assert findings["rig"].found == "the stop is engaged, by test"


def test_nobody_there_and_no_address(capsys: pytest.CaptureFixture[str]) -> None:
    (alone,) = examine_server("http://127.0.0.1:9", token=None)
    assert alone.level == "problem" and "no answer from http://127.0.0.1:9" in alone.found
    for address in ("nonsense", "ftp://127.0.0.1", "http://"):
        with pytest.raises(InvalidInput, match="give the address that a browser opens it by"):
            examine_server(address, token=None)
    result = CliRunner().invoke(app, ["doctor", "--server", "http://127.0.0.1:9", "--json"])
    assert result.exit_code == 1 and json.loads(result.output)["problems"] == 1


def test_a_certificate_that_ends_soon_is_a_warning(tmp_path: Path) -> None:
    app = FastAPI()

    @app.get("/healthz")
    async def health() -> dict[str, str]:
        return {"status": "ok"}

    @app.get("/api/v1/session")
    async def session() -> dict[str, str]:
        return {"kind": "nobody"}

    certificate = written_certificate(tmp_path, "127.0.0.1")
    trusted = ssl.create_default_context(cafile=certificate[0])
    with serving(app, certificate=certificate) as port:
        url = f"https://127.0.0.1:{port}"
        findings = {each.name: each for each in examine_server(url, token=None, trusted=trusted)}
        (refused,) = examine_server(url, token=None)
    assert findings["certificate"].level == "warning" and "0 days" in findings["certificate"].found
    assert "certificate" in refused.found.lower()


async def late() -> Response:
    await asyncio.Event().wait()
    return Response()


async def cut() -> Response:
    return Response(b"{", headers={"Content-Length": "100"})


async def list_of_nothing() -> Response:
    return Response(b"[]", media_type="application/json")


async def page() -> Response:
    return Response("<html>502 Bad Gateway</html>", status_code=502)


@pytest.mark.parametrize("answer", [late, cut, list_of_nothing, page])
@pytest.mark.parametrize("known", [True, False])
def test_every_check_ends_in_a_finding_whatever_the_server_answers(
    answer: Callable[[], Awaitable[Response]], known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = FastAPI(openapi_url=None)
    app.add_api_route("/healthz", lambda: {"status": "ok"})
    if known:
        app.add_api_route("/api/v1/session", lambda: {"kind": "user", "name": "ada", "rights": ["view"]})
    app.add_api_route("/{path:path}", answer)
    monkeypatch.setattr(running_server, "PATIENCE_S", 0.3)
    with serving(app) as port:
        findings = examine_server(f"http://127.0.0.1:{port}", token=None)
    wanted = ["server", "clock", "sign_in"]
    if known:
        wanted += ["version", "rig", "calibration", "events", "views"]
    assert [each.name for each in findings] == wanted
    bad = findings[3:] if known else findings[2:]
    lenient = {"events"} if answer is not late else set()  # whatever comes at once is an event there
    assert {each.level for each in bad if each.name not in lenient} == {"problem"}
    assert all(each.found for each in findings)
