"""A server that others can reach: its first admin, what each role may do, and who is thrown out."""

import json
import os
import ssl
import stat
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

import foveacam_client
from foveacam_bench.access.ended_sign_ins import ended_figures
from foveacam_hardware.rig_config import AccessConfig, SimulatedRigConfig
from foveacam_server.rig.chosen_rig import ChosenRig
from tests.support.scenes.dataset_scenes import written
from tests.support.servers.certificates import written_certificate
from tests.support.servers.running_server import (
    API,
    CENTRE,
    PATIENCE_S,
    Running,
    missing_rig,
    read_until,
    running,
)

PASSWORD = "correct horse battery"  # noqa: S105  # a password of these tests alone
JOB = f"{API}/captures/test/archive"
"""A job that needs no rig: it sends the capture that `written` writes to the archive."""
EVERYWHERE = "0.0.0.0"  # noqa: S104  # the address that is guarded


@dataclass
class Lab:
    """A server, and the browsers that are open on it."""

    server: Running
    stack: ExitStack

    def browser(self) -> httpx.Client:
        """Return a browser without cookies."""
        base = f"http://127.0.0.1:{self.server.port}"
        return self.stack.enter_context(httpx.Client(base_url=base, timeout=PATIENCE_S, trust_env=False))

    def socket(self, path: str, browser: httpx.Client) -> ClientConnection:
        """Open a WebSocket of a browser."""
        cookies = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
        found = connect(f"ws://127.0.0.1:{self.server.port}{path}", additional_headers={"Cookie": cookies})
        self.stack.callback(found.close)
        return found


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("lab")
    with running(folder, host=EVERYWHERE, viewer=True) as server, ExitStack() as stack:
        yield Lab(server, stack)


@pytest.fixture(scope="module")
def ada(lab: Lab) -> httpx.Client:
    """The browser of the first admin, who came by the terminal's link."""
    assert lab.server.get("/rig").status_code == lab.server.get("/users").status_code == 401
    assert "no user yet" in lab.server.http.get("/", headers={"Accept": "text/html"}).text
    browser = lab.browser()
    code = lab.server.services.accounts.first_admin.code()
    page = browser.get("/join", params={"code": code})
    assert page.status_code == 200 and "you are the first admin" in page.text
    form = {"code": code, "name": "Ada", "password": PASSWORD, "again": "something else"}
    assert "passwords differ" in browser.post("/join", data=form).text
    assert browser.post("/join", data=form | {"again": "short", "password": "short"}).status_code == 422
    joined = browser.post("/join", data=form | {"again": PASSWORD})
    assert (joined.status_code, joined.headers["location"]) == (303, "/")
    assert browser.post("/join", data=form | {"again": PASSWORD, "name": "eve"}).status_code == 401
    used = lab.browser().get("/join", params={"code": code})
    assert used.status_code == 401 and "this link is not good" in used.text and "/sign_in" in used.text
    return browser


def joined(lab: Lab, ada: httpx.Client, name: str, role: str) -> httpx.Client:
    """Return the browser of a new user, who came by the link that the admin passed on."""
    made = ada.post(f"{API}/users", json={"name": name, "role": role})
    assert made.status_code == 201, made.text
    browser = lab.browser()
    code = made.json()["invitation"]["path"].partition("code=")[2]
    answer = browser.post(f"{API}/session/invitation", json={"code": code, "password": PASSWORD})
    assert answer.status_code == 200 and answer.json()["role"] == role, answer.text
    return browser


def test_each_role_does_what_it_may(lab: Lab, ada: httpx.Client) -> None:
    vera, otto = joined(lab, ada, "vera", "viewer"), joined(lab, ada, "otto", "operator")
    assert vera.get(f"{API}/rig").status_code == otto.get(f"{API}/rig").status_code == 200
    refused = vera.post(f"{API}/fixations", json=CENTRE)
    assert refused.status_code == 403
    assert refused.json()["type"] == "/problems/forbidden"
    assert "you are vera, a viewer" in refused.json()["detail"]
    look = otto.post(f"{API}/fixations", json={**CENTRE, "depth": False}, headers={"Prefer": "wait=60"})
    assert look.status_code == 200 and look.json()["state"] == "verged"
    assert otto.get(f"{API}/users").status_code == otto.delete(f"{API}/captures/trash").status_code == 403
    assert otto.post(f"{API}/drift_checks", json={"apply": True}).status_code == 403
    with pytest.raises(InvalidStatus) as stopped:
        lab.socket(f"{API}/mirrors/steering", vera)
    assert stopped.value.response.status_code == 403
    lab.socket(f"{API}/mirrors/steering", otto).close()
    assert ada.get(f"{API}/users").status_code == 200
    session = vera.get(f"{API}/session").json()
    assert (session["mode"], session["name"], session["rights"]) == ("users", "vera", ["view"])
    assert [one["user"] for one in vera.get(f"{API}/sessions").json()["sessions"]] == ["vera"]


def test_who_is_thrown_out_sees_nothing_more(lab: Lab, ada: httpx.Client) -> None:
    rex = joined(lab, ada, "rex", "operator")
    ended = threading.Event()

    def listen() -> None:
        with rex.stream("GET", f"{API}/events", timeout=PATIENCE_S) as stream:
            for _ in stream.iter_lines():
                pass
        ended.set()

    listener = threading.Thread(target=listen)
    listener.start()
    views = lab.socket(f"{API}/views/ws", rex)
    views.send(json.dumps({"type": "subscribe", "views": {"wide": {"scale": 1}}}))
    views.recv(timeout=PATIENCE_S)
    (mine,) = [one for one in ada.get(f"{API}/sessions").json()["sessions"] if one["user"] == "rex"]
    assert mine["streams"] >= 2 and not mine["current"]
    assert ada.delete(f"{API}/sessions/{mine['id']}").status_code == 204
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            views.recv(timeout=PATIENCE_S)
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 4401
    assert ended.wait(PATIENCE_S)
    listener.join()
    assert rex.get(f"{API}/rig").status_code == 401
    with pytest.raises(InvalidStatus):
        lab.socket("/viser/", rex)
    again = rex.post(f"{API}/session", json={"name": "rex", "password": PASSWORD})
    assert again.status_code == 200 and rex.get(f"{API}/rig").status_code == 200
    assert rex.delete(f"{API}/session").status_code == 204
    assert rex.get(f"{API}/rig").status_code == 401


def test_nothing_of_a_users_sign_ins_is_left_after_a_link_a_new_password_a_removal_or_a_disabling(
    lab: Lab, ada: httpx.Client
) -> None:
    figures = ended_figures(f"http://127.0.0.1:{lab.server.port}", ada)
    assert figures["sessions_alive_after_reset_which"] == []
    assert figures["sessions_tried_after_reset"] == 24


def test_the_client_works_with_the_token_of_a_service(lab: Lab, ada: httpx.Client) -> None:
    made = ada.post(f"{API}/service_tokens", json={"name": "robot", "scopes": ["view"], "days": 7}).json()
    url = f"http://127.0.0.1:{lab.server.port}"

    with foveacam_client.connect(url, token=made["token"]) as rig:
        assert rig.api.rig.get()
        with pytest.raises(foveacam_client.NotAllowed, match="right"):
            rig.fixate(720, 540)
    (listed,) = ada.get(f"{API}/service_tokens").json()["tokens"]
    assert ada.delete(f"{API}/service_tokens/{listed['id']}").status_code == 204
    with (
        foveacam_client.connect(url, token=made["token"]) as rig,
        pytest.raises(foveacam_client.NotSignedIn, match="token"),
    ):
        rig.api.rig.get()


def test_a_service_works_with_its_token_until_it_is_revoked(lab: Lab, ada: httpx.Client) -> None:
    made = ada.post(f"{API}/service_tokens", json={"name": "logger", "scopes": ["view"], "days": 7}).json()
    service = {"Authorization": f"Bearer {made['token']}"}
    assert lab.server.http.get(f"{API}/rig", headers=service).status_code == 200
    assert lab.server.http.get("/metrics", headers=service).status_code == 200
    refused = lab.server.http.post(f"{API}/mirrors/park", headers=service)
    assert refused.status_code == 403 and "whose token may view" in refused.json()["detail"]
    (listed,) = ada.get(f"{API}/service_tokens").json()["tokens"]
    assert listed["last_used_utc"] is not None and made["token"] not in json.dumps(listed)
    assert ada.delete(f"{API}/service_tokens/{listed['id']}").status_code == 204
    assert lab.server.http.get(f"{API}/rig", headers=service).status_code == 401


def test_who_drives_is_known_by_name_and_is_asked(lab: Lab, ada: httpx.Client) -> None:
    nils, mia = joined(lab, ada, "nils", "operator"), joined(lab, ada, "mia", "operator")
    lease = {"X-Lease": nils.post(f"{API}/lease", json={"holder": "desk"}).json()["token"]}
    assert mia.get(f"{API}/lease").json()["person"] == "nils"
    refused = mia.post(f"{API}/mirrors/park")
    assert refused.status_code == 409 and "nils (desk) holds the control lease" in refused.json()["detail"]
    assert mia.post(f"{API}/lease", json={"holder": "lab", "take_over": True}).status_code == 403
    assert mia.post(f"{API}/lease/request", json={"holder": "lab"}).json()["asked_by"] == "mia (lab)"
    handed = nils.put(f"{API}/lease/request", json={"hand_over": True}, headers=lease)
    assert handed.status_code == 200
    taken = mia.post(f"{API}/lease", json={"holder": "lab"})
    assert taken.json()["holder"] == "mia (lab)"
    without = ada.post(f"{API}/lease", json={"holder": "desk", "take_over": True})
    assert without.status_code == 422 and "without a reason" in without.json()["detail"]
    body = {"holder": "desk", "take_over": True, "reason": "the rig is needed"}
    token = ada.post(f"{API}/lease", json=body).json()["token"]
    assert mia.post(f"{API}/stop").json()["parked"] is True  # whoever holds it
    assert lab.server.services.stop.state.by == "mia at 127.0.0.1"
    assert mia.delete(f"{API}/stop").status_code == 200
    assert ada.delete(f"{API}/lease", headers={"X-Lease": token}).status_code == 204


def test_a_viewer_stops_the_rig_where_its_file_says_so(
    lab: Lab, ada: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    eve = joined(lab, ada, "eve", "viewer")
    assert eve.post(f"{API}/stop").status_code == 403
    allowed = SimulatedRigConfig(access=AccessConfig(viewers_may_stop=True))
    monkeypatch.setattr(ChosenRig, "config", lambda _rig: allowed)
    assert eve.post(f"{API}/stop").json()["parked"] is True
    assert eve.delete(f"{API}/stop").status_code == 403
    assert ada.delete(f"{API}/stop").status_code == 200


def test_the_sign_in_form_asks_for_name_and_password(lab: Lab, ada: httpx.Client) -> None:
    browser = lab.browser()
    page = browser.get("/", headers={"Accept": "text/html"})
    assert page.status_code == 401 and 'name="password"' in page.text and 'name="token"' not in page.text
    wrong = browser.post("/sign_in", data={"name": "ada", "password": "wrong"})
    assert wrong.status_code == 401 and 'role="alert"' in wrong.text and 'value="ada"' in wrong.text
    right = browser.post("/sign_in", data={"name": " Ada ", "password": PASSWORD})
    assert (right.status_code, right.headers["location"]) == (303, "/")
    assert "HttpOnly" in right.headers["set-cookie"] and "SameSite=lax" in right.headers["set-cookie"]
    assert browser.get("/").status_code == 200
    evil = {"Origin": "http://evil.example"}
    assert (
        browser.post("/sign_in", data={"name": "ada", "password": PASSWORD}, headers=evil).status_code == 403
    )
    assert (
        browser.put(f"{API}/session/password", json={"password": PASSWORD, "new_password": "ada"}).status_code
        == 422
    )


def test_every_change_is_in_the_audit_log(lab: Lab, ada: httpx.Client) -> None:
    lab.server.services.accounts.audit.flush()
    page = ada.get(f"{API}/audit", params={"text": "sign in as ada"}).json()
    assert {entry["outcome"] for entry in page["entries"]} == {"refused", "done"}
    changed = ada.get(f"{API}/audit", params={"who": "ada", "text": "/users"}).json()["entries"]
    assert changed[0]["what"] == "Add a user" and changed[0]["detail"].endswith((", viewer", ", operator"))
    refused = ada.get(f"{API}/audit", params={"who": "vera", "outcome": "refused"}).json()["entries"]
    assert {entry["path"] for entry in refused} == {f"{API}/fixations", f"{API}/mirrors/steering"}
    lines = ada.get(f"{API}/audit.jsonl").text.splitlines()
    assert [json.loads(line)["id"] for line in lines] == sorted(json.loads(line)["id"] for line in lines)
    for secret in (PASSWORD, "code=", "fcd_"):
        assert not any(secret in line for line in lines)


def test_the_first_user_of_this_machine_closes_it(tmp_path: Path) -> None:
    with running(tmp_path, rig=missing_rig(tmp_path)) as server, ExitStack() as stack:
        assert server.get("/session").json()["mode"] == "open"
        body = {"name": "ada", "role": "admin", "password": PASSWORD}
        assert server.post("/users", body | {"role": "operator"}).status_code == 422
        stranger = Lab(server, stack).browser()
        views = Lab(server, stack).socket(f"{API}/views/ws", stranger)
        assert server.post("/users", body).status_code == 201
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                views.recv(timeout=PATIENCE_S)
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 4401
        assert server.get("/session").json()["name"] == "ada"
        assert stranger.get(f"{API}/rig").status_code == 401
        assert stranger.post(f"{API}/stop").status_code == 401
        assert stranger.get("/healthz").status_code == 200


def program_environment(folder: Path) -> dict[str, str]:
    """Return the environment of a program whose rig is missing: who may come in is asked here, no rig."""
    found = {"COLUMNS": "200", "FOVEACAM_DATA": str(folder), "FOVEACAM_VIEWER": "false"}
    found |= {"FOVEACAM_RIG": missing_rig(folder), "FOVEACAM_ARCHIVE": f"file://{folder}/archive"}
    return os.environ | found


def test_the_program_serves_https_and_names_the_file_with_the_link_of_the_first_admin(tmp_path: Path) -> None:
    certificate, key = written_certificate(tmp_path, "127.0.0.1")
    command = [sys.executable, "-m", "foveacam_server", "serve", "--host", EVERYWHERE, "--port", "0"]
    command += ["--tls-cert", str(certificate), "--tls-key", str(key)]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=program_environment(tmp_path),
    )
    try:
        path = Path(read_until(process, r"  cat (\S+)"))
        assert stat.S_IMODE(path.stat().st_mode) == 0o600 and path.parent == tmp_path
        link = path.read_text().strip()
        trusted = ssl.create_default_context(cafile=certificate)
        with httpx.Client(verify=trusted, trust_env=False) as browser:
            page = browser.get(link)
            assert "first admin" in page.text
            assert page.headers["Strict-Transport-Security"] == "max-age=31536000"
            form = {
                "code": link.partition("code=")[2],
                "name": "ada",
                "password": PASSWORD,
                "again": PASSWORD,
            }
            made = browser.post(httpx.URL(link).copy_with(path="/join", query=None), data=form)
            assert made.status_code == 303 and "; Secure" in made.headers["set-cookie"]
            assert not path.exists()
            assert browser.post(httpx.URL(link).copy_with(path=f"{API}/stop", query=None)).status_code == 200
        with pytest.raises(httpx.HTTPError):  # a stop in plain text is none
            httpx.post(f"http://127.0.0.1:{httpx.URL(link).port}{API}/stop", trust_env=False)
    finally:
        process.terminate()
        process.wait(20)


def test_the_log_of_a_whole_visit_holds_no_secret(tmp_path: Path) -> None:
    secret_token = "the-token-of-the-lab"  # noqa: S105  # of this test alone
    command = [sys.executable, "-m", "foveacam_server", "serve", "--port", "0", "--log-format", "json"]
    secret = {"FOVEACAM_LOG": "debug", "FOVEACAM_TOKEN": secret_token, "FOVEACAM_HOST": EVERYWHERE}
    environment = {**program_environment(tmp_path), **secret}
    written(tmp_path / "captures" / "small", 1)
    log = tmp_path / "log"
    with log.open("w") as errors:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=environment)
    try:
        url = read_until(process, r"(http://127\.0\.0\.1:\d+/)")
        secrets = [secret_token, *_visit(url, token=secret_token)]
    finally:
        process.terminate()
        process.wait(20)
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    asked = [line for line in lines if line["message"].startswith(f"POST {JOB}: 200")]
    assert asked[0]["request_id"] == "visit-1"
    of_job = [line["job_id"] for line in lines if line["request_id"] == "visit-1" and line["job_id"]]
    assert of_job and set(of_job) == {of_job[0]} and of_job[0].startswith("job-")
    assert [secret for secret in secrets if secret in log.read_text()] == []


def _visit(url: str, *, token: str) -> list[str]:
    """Use every kind of secret; return them."""
    with httpx.Client(base_url=url, trust_env=False, timeout=PATIENCE_S) as browser:
        assert browser.get("/", params={"token": token}).status_code == 303
        body = {"name": "ada", "role": "admin", "password": PASSWORD}
        assert browser.post(f"{API}/users", json=body).status_code == 201
        named = {"name": "bob", "role": "operator"}
        code = browser.post(f"{API}/users", json=named).json()["invitation"]["path"].partition("code=")[2]
        assert browser.get("/join", params={"code": code}).status_code == 200
        made = browser.post(f"{API}/service_tokens", json={"name": "logger", "scopes": ["view", "operate"]})
        service = made.json()["token"]
        headers = {"Authorization": f"Bearer {service}", "X-Request-ID": "visit-1", "Prefer": "wait=60"}
        archived = browser.post(JOB, json={}, headers=headers)
        assert archived.status_code == 200, archived.text
        wrong = {"name": "ada", "password": "a wrong guess"}
        assert browser.post("/sign_in", data=wrong).status_code == 401
        cookies = [value for _, value in browser.cookies.items()]
        lease = browser.post(f"{API}/lease", json={"holder": "ada"}).json()["token"]
        browser.delete(f"{API}/lease", headers={"X-Lease": lease})
    return [PASSWORD, wrong["password"], code, service, lease, *cookies]
