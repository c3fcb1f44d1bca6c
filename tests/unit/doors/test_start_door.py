"""What a browser and a program are told while the server's program is loaded."""

import re
import socket
import ssl
from base64 import b64encode
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import httpx
import pytest
from tests.support.servers.certificates import written_certificate

from foveacam_hardware.contract import Busy
from foveacam_server.doors.start_door import StartDoor
from foveacam_server.foundation.settings import Settings

PATIENCE_S = 10.0
HTML = {"Accept": "text/html,application/xhtml+xml"}


@pytest.fixture
def door(tmp_path: Path) -> Iterator[StartDoor]:
    with StartDoor(Settings(port=0, data=tmp_path)) as opened:
        yield opened


def asked(door: StartDoor, path: str, **wanted: object) -> httpx.Response:
    url = f"http://127.0.0.1:{door.port}{path}"
    headers = wanted.get("headers")
    method = str(wanted.get("method", "GET"))
    with httpx.Client(trust_env=False, timeout=PATIENCE_S) as http:
        return http.request(method, url, headers=headers if isinstance(headers, dict) else None)


def test_a_browser_gets_a_page_that_renews_itself_with_or_without_scripts(door: StartDoor) -> None:
    answer = asked(door, "/", headers=HTML)
    assert (answer.status_code, answer.headers["retry-after"]) == (503, "1")
    assert '<noscript><meta http-equiv="refresh" content="1; url=?"></noscript>' in answer.text
    assert "being loaded" in answer.text and "half a minute" in answer.text
    (script,) = re.findall("<script>(.*?)</script>", answer.text)
    allowed = b64encode(sha256(script.encode()).digest()).decode()
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy and f"script-src 'sha256-{allowed}'" in policy


def test_readiness_says_what_is_missing_and_when_to_ask_again(door: StartDoor) -> None:
    answer = asked(door, "/readyz")
    assert (answer.status_code, answer.headers["retry-after"]) == (503, "1")
    assert answer.json() == {
        "ready": False,
        "problems": [{"device": "server", "detail": "the program is being loaded"}],
        "start": None,
    }


def test_the_process_is_alive(door: StartDoor) -> None:
    assert asked(door, "/healthz").json() == {"status": "ok"}


def test_any_other_request_is_refused_by_a_problem_document(door: StartDoor) -> None:
    answer = asked(door, "/api/v1/rig?x=1", method="POST")
    assert (answer.status_code, answer.headers["content-type"]) == (503, "application/problem+json")
    assert answer.json()["type"] == "/problems/not-connected"
    assert answer.json()["instance"] == "/api/v1/rig" and answer.json()["remedy"] == "try again in a moment"


def test_an_answer_to_head_has_no_body(door: StartDoor) -> None:
    answer = asked(door, "/", method="HEAD")
    assert answer.status_code == 503 and answer.content == b""


def test_silent_connections_keep_no_other_from_being_answered(door: StartDoor) -> None:
    silent = [socket.create_connection(("127.0.0.1", door.port)) for _ in range(6)]
    try:
        assert asked(door, "/healthz").status_code == 200
    finally:
        for each in silent:
            each.close()


def test_a_connection_made_after_the_hand_over_waits_for_who_listens_next(door: StartDoor) -> None:
    door.hand_over()
    with socket.create_connection(("127.0.0.1", door.port), timeout=PATIENCE_S) as client:
        door.listener.setblocking(True)
        accepted, _ = door.listener.accept()
        with accepted:
            accepted.sendall(b"next")
        assert client.recv(4) == b"next"


def test_a_port_in_use_is_refused_before_the_program_is_loaded(door: StartDoor, tmp_path: Path) -> None:
    with pytest.raises(Busy, match=f"port {door.port}"), StartDoor(Settings(port=door.port, data=tmp_path)):
        pass


def test_it_speaks_https_with_the_servers_certificate(tmp_path: Path) -> None:
    certificate, key = written_certificate(tmp_path, "127.0.0.1")
    trusted = ssl.create_default_context(cafile=certificate)
    with StartDoor(Settings(port=0, data=tmp_path, tls_cert=certificate, tls_key=key)) as door:
        url = f"https://127.0.0.1:{door.port}/readyz"
        with httpx.Client(trust_env=False, timeout=PATIENCE_S, verify=trusted) as http:
            assert http.get(url).status_code == 503
