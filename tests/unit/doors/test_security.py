import asyncio
import json
import socket
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import TypedDict, Unpack

import httpx
import pytest
from fastapi import FastAPI, WebSocket
from pydantic import SecretStr
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from foveacam_hardware.contract import InvalidInput
from foveacam_server.accounts.attempts import MOST_WRONG, WINDOW_S
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import RouteTable, needs, open_to_anybody
from foveacam_server.console import security, viser_relay
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.foundation.settings import Settings, checked_settings
from foveacam_server.rig.ports import SceneViewer

OWN = "http://127.0.0.1:8000"
TOKEN = "correct horse"  # noqa: S105  # a token of this test alone


class Choices(TypedDict, total=False):
    host: str
    token: SecretStr
    insecure: bool
    allowed_origins: tuple[str, ...]


@dataclass
class Browser:
    """Asks an application in this process; keeps cookies."""

    app: ASGIApp
    base_url: str
    cookies: httpx.Cookies = field(default_factory=httpx.Cookies)

    def request(
        self,
        method: str,
        path: str,
        headers: dict[str, str] | None = None,
        data: dict[str, str] | None = None,
    ) -> httpx.Response:
        async def ask() -> httpx.Response:
            transport = httpx.ASGITransport(app=self.app)
            async with httpx.AsyncClient(
                transport=transport, base_url=self.base_url, cookies=self.cookies
            ) as session:
                answer = await session.request(method, path, headers=headers, data=data)
                self.cookies = session.cookies
                return answer

        return asyncio.run(ask())

    def get(self, path: str, headers: dict[str, str] | None = None) -> httpx.Response:
        return self.request("GET", path, headers)

    def post(self, path: str, headers: dict[str, str] | None = None) -> httpx.Response:
        return self.request("POST", path, headers)

    def open_websocket(self, headers: dict[str, str]) -> list[Message]:
        """Return what the application sends to a WebSocket that connects and says nothing."""
        host = httpx.URL(self.base_url).netloc.decode()
        named = {"host": host, **{name.lower(): value for name, value in headers.items()}}
        scope: Scope = {
            "type": "websocket",
            "path": "/ws",
            "raw_path": b"/ws",
            "query_string": b"",
            "headers": [(name.encode(), value.encode("latin-1")) for name, value in named.items()],
            "subprotocols": [],
            "extensions": {"websocket.http.response": {}},
        }
        sent: list[Message] = []

        async def receive() -> Message:
            return {"type": "websocket.connect"}

        async def send(message: Message) -> None:
            sent.append(message)

        asyncio.run(_call(self.app, scope, receive, send))
        return sent

    def greeting(self, headers: dict[str, str]) -> str:
        accepted, greeting, _closed = self.open_websocket(headers)
        assert accepted["type"] == "websocket.accept"
        return str(greeting["text"])

    def websocket_refusal(self, headers: dict[str, str]) -> tuple[int, str]:
        """Return status and problem type of a refused WebSocket."""
        start, body = self.open_websocket(headers)
        return int(start["status"]), str(json.loads(body["body"])["type"])


async def _call(app: ASGIApp, scope: Scope, receive: Receive, send: Send) -> None:
    await app(scope, receive, send)


def client(base_url: str = OWN, **choices: Unpack[Choices]) -> Browser:
    app = FastAPI()

    @app.get("/")
    @needs(Right.VIEW, takes_token=True)
    async def page() -> str:
        return "page"

    @app.get("/healthz")
    @open_to_anybody
    async def health() -> str:
        return "ok"

    app.include_router(viser_relay.router)
    app.state.provided = ServiceRegistry({SceneViewer | None: SimpleNamespace()})

    @app.post("/api/v1/stop")
    @needs(Right.OPERATE, stops=True)
    async def stop() -> str:
        return "stopped"

    @app.post("/park")
    async def park() -> str:
        return "parked"

    @app.websocket("/ws")
    async def socket(websocket: WebSocket) -> None:
        await websocket.accept()
        await websocket.send_text("hello")
        await websocket.close()

    security.install(app, Settings(**choices))
    return Browser(app, base_url)


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE"])
@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "http://127.0.0.1:8001",
        "https://127.0.0.1:8000",
        "https://127.0.0.1.evil",
    ],
)
def test_a_foreign_page_changes_nothing(method: str, origin: str) -> None:
    answer = client().request(method, "/park", headers={"Origin": origin})
    assert answer.status_code == 403
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "/problems/forbidden-origin"
    assert origin in answer.json()["detail"]


@pytest.mark.parametrize("origin", ["http://evil.example", "null", ""])
def test_a_foreign_page_opens_no_websocket(origin: str) -> None:
    assert client().websocket_refusal({"Origin": origin}) == (403, "/problems/forbidden-origin")


def test_the_own_page_may_do_both() -> None:
    browser = client()
    assert browser.post("/park", headers={"Origin": OWN}).json() == "parked"
    assert browser.greeting({"Origin": OWN}) == "hello"


def test_a_program_that_sends_no_origin_may_do_both() -> None:
    program = client()
    assert program.post("/park").json() == "parked"
    assert program.greeting({}) == "hello"


def test_a_configured_origin_may_do_both() -> None:
    browser = client(allowed_origins=("https://lab.example",))
    headers = {"Origin": "https://lab.example"}
    assert browser.post("/park", headers=headers).json() == "parked"
    assert browser.greeting(headers) == "hello"


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "127.evil.example:8000", "", "[::1", "10.0.0.1"]
)
def test_a_foreign_name_that_points_here_is_refused(host: str) -> None:
    answer = client().get("/", headers={"Host": host})
    assert answer.status_code == 403
    assert "localhost" in answer.json()["detail"]


@pytest.mark.parametrize("host", ["localhost", "localhost:9000", "127.0.0.1:8000", "127.0.0.2", "[::1]:8000"])
def test_the_names_of_this_machine_are_answered(host: str) -> None:
    assert client().get("/", headers={"Host": host}).status_code == 200


def test_another_address_serves_nothing_before_there_is_a_user_or_a_token() -> None:
    browser = client("http://rig.example", host="0.0.0.0")  # noqa: S104  # the mistake under test
    answer = browser.get("/")
    assert (answer.status_code, answer.json()["type"]) == (401, "/problems/unauthorized")
    assert "the file that the server named" in answer.json()["remedy"]
    assert "no user yet" in browser.get("/", headers={"Accept": "text/html"}).text
    assert browser.post("/park").status_code == browser.post("/api/v1/stop").status_code == 401
    assert browser.websocket_refusal({}) == (401, "/problems/unauthorized")


def test_another_address_is_open_to_everybody_when_that_is_said_aloud() -> None:
    browser = client("http://10.0.0.5:8000", host="0.0.0.0", insecure=True)  # noqa: S104  # declared open
    assert browser.post("/park").json() == "parked"
    assert browser.post("/park", headers={"Origin": "http://evil.example"}).status_code == 403


def test_an_open_server_is_no_page_of_a_name_that_was_made_to_point_at_it() -> None:
    browser = client("http://evil.example:8000", host="0.0.0.0", insecure=True)  # noqa: S104  # declared open
    answer = browser.post("/park", headers={"Origin": "http://evil.example:8000"})
    assert (answer.status_code, answer.json()["type"]) == (403, "/problems/forbidden-origin")
    assert "evil.example" in answer.json()["detail"]
    assert "FOVEACAM_ALLOWED_ORIGINS" in answer.json()["remedy"]
    assert browser.get("/").status_code == 403
    assert browser.websocket_refusal({"Origin": "http://evil.example:8000"})[0] == 403


@pytest.mark.parametrize(
    "host", ["10.0.0.5", "[fd00::5]:8000", "localhost", "rig-pc", "rig-pc.local:8000", "lab.example"]
)
def test_an_open_server_answers_to_its_machine_and_to_addresses(
    host: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "Rig-PC")
    browser = client(host="0.0.0.0", insecure=True, allowed_origins=("https://lab.example:8443",))  # noqa: S104
    own = {"Host": host, "Origin": f"http://{host}"}
    assert browser.post("/park", headers=own).json() == "parked"


def test_a_server_that_asks_for_a_token_is_called_by_any_name() -> None:
    assert guarded().get("/", headers={"Host": "any.example", "X-Api-Token": TOKEN}).status_code == 200


@pytest.mark.parametrize(
    "origin",
    ["*", "https://*.lab.example", "lab.example", "https://lab.example/console", "null", "ftp://lab.example"],
)
def test_what_is_no_origin_is_refused_at_the_start(origin: str) -> None:
    with pytest.raises(InvalidInput, match="origin"):
        checked_settings({"allowed_origins": (origin,)})


LISTED = "https://lab.example"
PREFLIGHT = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "x-api-token,x-lease"}


def test_a_page_of_a_listed_origin_asks_first_and_reads_the_answer() -> None:
    browser = client("http://rig.example", host="0.0.0.0", token=SecretStr(TOKEN), allowed_origins=(LISTED,))  # noqa: S104
    asked = browser.request("OPTIONS", "/park", headers={"Origin": LISTED, **PREFLIGHT})
    assert asked.status_code == 200
    assert asked.headers["access-control-allow-origin"] == LISTED
    assert asked.headers["access-control-allow-credentials"] == "true"
    assert "POST" in asked.headers["access-control-allow-methods"]
    refused = browser.post("/park", headers={"Origin": LISTED})
    assert (refused.status_code, refused.headers["access-control-allow-origin"]) == (401, LISTED)
    done = browser.post("/park", headers={"Origin": LISTED, "X-Api-Token": TOKEN})
    assert (done.json(), done.headers["access-control-allow-origin"]) == ("parked", LISTED)
    assert "Origin" in done.headers["vary"]
    assert "access-control-allow-origin" not in browser.get("/healthz").headers


@pytest.mark.parametrize(
    "origin", ["http://lab.example", "https://lab.example:8443", "https://lab.example.evil", "null"]
)
def test_a_page_of_any_other_origin_is_told_nothing_of_it(origin: str) -> None:
    for allowed in ((LISTED,), ()):
        browser = client(allowed_origins=allowed)
        asked = browser.request("OPTIONS", "/park", headers={"Origin": origin, **PREFLIGHT})
        read = browser.get("/", headers={"Origin": origin})
        assert asked.status_code == 405
        assert not [name for name in (*asked.headers, *read.headers) if name.startswith("access-control")]


def guarded() -> Browser:
    return client("http://rig.example", host="0.0.0.0", token=SecretStr(TOKEN))  # noqa: S104  # with a token


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Authorization": "Bearer wrong"},
        {"Authorization": f"Basic {TOKEN}"},
        {"X-Api-Token": ""},
        {"Cookie": f"foveacam_session={TOKEN}"},
        {"Cookie": "\x01;;="},
    ],
)
def test_without_the_token_nothing_is_served(headers: dict[str, str]) -> None:
    answer = guarded().get("/", headers=headers)
    assert answer.status_code == 401
    assert answer.json()["type"] == "/problems/unauthorized"
    assert TOKEN not in answer.text
    assert guarded().websocket_refusal(headers) == (401, "/problems/unauthorized")


@pytest.mark.parametrize("headers", [{"Authorization": f"Bearer {TOKEN}"}, {"X-Api-Token": TOKEN}])
def test_a_program_shows_the_token_in_a_header(headers: dict[str, str]) -> None:
    program = guarded()
    assert program.post("/park", headers=headers).json() == "parked"
    assert program.greeting(headers) == "hello"


def test_a_route_whose_right_was_forgotten_is_for_admins_alone() -> None:
    app = FastAPI()
    app.add_api_route("/forgotten", lambda: None)

    access = RouteTable(app.routes).access({"type": "http", "method": "GET", "path": "/forgotten"})

    assert access is not None
    assert access.right is Right.ADMINISTER


def test_a_browser_shows_the_token_once() -> None:
    browser = guarded()
    answer = browser.get("/?token=correct%20horse&theme=dark")
    assert (answer.status_code, answer.headers["location"]) == (303, "/?theme=dark")
    kept = answer.headers["set-cookie"]
    assert "HttpOnly" in kept
    assert "SameSite=lax" in kept
    assert TOKEN not in kept
    assert browser.get("/").json() == "page"
    assert browser.post("/park", headers={"Origin": "http://rig.example"}).json() == "parked"
    assert browser.post("/park", headers={"Origin": "http://evil.example"}).status_code == 403


def test_a_wrong_token_in_the_address_sets_no_cookie() -> None:
    answer = guarded().get("/?token=wrong")
    assert answer.status_code == 401
    assert "set-cookie" not in answer.headers


def test_a_browser_without_token_is_asked_for_it() -> None:
    answer = guarded().get("/", headers={"Accept": "text/html,*/*"})
    assert answer.status_code == 401
    assert 'name="token"' in answer.text


def test_the_form_signs_a_browser_in() -> None:
    browser = guarded()
    asked = browser.get("/", headers={"Accept": "text/html"})
    assert asked.headers["referrer-policy"] == "same-origin"  # else the form's own origin would read null
    answer = browser.request("POST", "/sign_in", {"Origin": "http://rig.example"}, data={"token": TOKEN})
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    assert browser.get("/").json() == "page"


@pytest.mark.parametrize("token", ["wrong", "", "x" * 10_000])
def test_the_form_says_that_the_token_is_wrong(token: str) -> None:
    browser = guarded()
    answer = browser.request("POST", "/sign_in", data={"token": token})
    assert answer.status_code == 401
    assert "not the token" in answer.text and "set-cookie" not in answer.headers
    assert browser.get("/").status_code == 401


def test_a_foreign_page_signs_nobody_in() -> None:
    foreign = {"Origin": "http://evil.example"}
    assert guarded().request("POST", "/sign_in", foreign, data={"token": TOKEN}).status_code == 403


def test_after_ten_wrong_tokens_none_is_looked_at_but_who_is_signed_in_goes_on() -> None:
    browser = guarded()
    browser.request("POST", "/sign_in", data={"token": TOKEN})
    for _ in range(MOST_WRONG):
        assert browser.get("/?token=wrong").status_code == 200  # signed in: it is not asked
    signed_out = Browser(browser.app, browser.base_url)
    answer = signed_out.get("/", headers={"X-Api-Token": TOKEN})
    assert (answer.status_code, answer.json()["type"]) == (429, "/problems/too-many-tries")
    assert 0 < int(answer.headers["retry-after"]) <= WINDOW_S
    form = signed_out.request("POST", "/sign_in", data={"token": TOKEN})
    assert form.status_code == 429 and "wrong tokens" in form.text
    assert signed_out.post("/api/v1/stop", headers={"X-Api-Token": TOKEN}).json() == "stopped"
    assert signed_out.post("/api/v1/stop", headers={"X-Api-Token": "wrong"}).status_code == 429
    assert browser.get("/").json() == "page"


def test_health_needs_no_token() -> None:
    assert guarded().get("/healthz").json() == "ok"


def test_every_answer_carries_the_security_headers() -> None:
    answer = client().get("/missing")
    assert answer.status_code == 404
    assert answer.headers["x-content-type-options"] == "nosniff"
    policy = answer.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "worker-src 'self' blob:" in policy
    assert "frame-ancestors 'self'" in policy


def test_only_the_3d_page_may_run_its_own_inline_script() -> None:
    browser = client()
    assert "unsafe-inline' 'unsafe-eval'" in browser.get("/viser/").headers["content-security-policy"]
    assert "unsafe-eval" not in browser.get("/").headers["content-security-policy"]
