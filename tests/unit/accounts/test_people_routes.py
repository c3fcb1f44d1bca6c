"""The routes of people behind the access rules, in this process: no rig, no socket."""

import asyncio
from dataclasses import dataclass, field

import httpx
import pytest
from fastapi import FastAPI
from tests.support.servers.account_setup import PASSWORD, unwritable

from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.attempts import GUESSED_WRONG, MOST_WRONG
from foveacam_server.accounts.rights import UserRole
from foveacam_server.console import security
from foveacam_server.doors import error_handlers
from foveacam_server.foundation.http.provided import ServiceRegistry
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.operating.people import session_routes, token_routes, user_routes

API = "/api/v1"


@dataclass
class Lab:
    """A server that others can reach, without a rig."""

    app: FastAPI

    def browser(self, *, address: str = "10.0.0.1") -> "Browser":
        return Browser(self.app, address)


@dataclass
class Browser:
    """Asks the server from an address; keeps cookies."""

    app: FastAPI
    address: str
    cookies: httpx.Cookies = field(default_factory=httpx.Cookies)

    def send(
        self, method: str, path: str, body: object = None, *, form: dict[str, str] | None = None
    ) -> httpx.Response:
        async def ask() -> httpx.Response:
            transport = httpx.ASGITransport(app=self.app, client=(self.address, 1))
            async with httpx.AsyncClient(
                transport=transport, base_url="http://rig.example", cookies=self.cookies
            ) as session:
                answer = await session.request(method, path, json=body, data=form)
                self.cookies = session.cookies
                return answer

        return asyncio.run(ask())

    def sign_in(self, name: str, password: str = PASSWORD) -> int:
        return self.send("POST", f"{API}/session", {"name": name, "password": password}).status_code

    def is_known(self) -> bool:
        return self.send("GET", f"{API}/sessions").status_code == 200


@pytest.fixture
def lab(accounts: Accounts, ada: str) -> Lab:
    app = FastAPI()
    error_handlers.install(app)
    gate = security.install(app, Settings(host="0.0.0.0"))  # noqa: S104  # the guarded case
    gate.accounts = accounts
    app.state.provided = ServiceRegistry({Accounts: accounts})
    for module in (session_routes, user_routes, token_routes):
        app.include_router(module.router, prefix=API)
    return Lab(app)


@pytest.fixture
def admin(lab: Lab, ada: str) -> Browser:
    browser = lab.browser()
    assert browser.sign_in(ada) == 200
    return browser


def test_a_sign_out_is_answered_on_a_disk_that_takes_nothing(lab: Lab, store: Store, admin: Browser) -> None:
    thief = Browser(lab.app, "10.0.0.66", httpx.Cookies(admin.cookies))
    assert thief.is_known()
    with unwritable(store):
        assert admin.send("DELETE", f"{API}/session").status_code == 204
        assert not thief.is_known()
        assert lab.browser().sign_in("ada") == 507


def test_a_revoked_token_is_answered_on_a_disk_that_takes_nothing(
    lab: Lab, store: Store, admin: Browser
) -> None:
    made = admin.send("POST", f"{API}/service_tokens", {"name": "planner", "scopes": ["view"]}).json()
    path = f"{API}/service_tokens/{made['document']['id']}"
    with unwritable(store):
        assert admin.send("DELETE", path).status_code == 204
        assert admin.send("DELETE", path).status_code == 404


def test_a_used_link_signs_the_old_browser_out_and_the_new_one_in(
    lab: Lab, accounts: Accounts, admin: Browser
) -> None:
    accounts.users.add("otto", UserRole.OPERATOR, password=PASSWORD)
    old, new = lab.browser(), lab.browser()
    assert old.sign_in("otto") == 200
    code = admin.send("POST", f"{API}/users/otto/invitation").json()["path"].partition("code=")[2]
    body = {"code": code, "password": "another password"}
    assert new.send("POST", f"{API}/session/invitation", body).status_code == 200
    assert new.is_known() and not old.is_known()
    assert new.send("POST", f"{API}/session/invitation", body).status_code == 401


def test_a_removal_names_the_tokens_and_keeps_them_when_asked(
    lab: Lab, accounts: Accounts, admin: Browser
) -> None:
    for name, asked in (("iris", ""), ("mia", "?tokens=keep")):
        accounts.users.add(name, UserRole.ADMIN, password=PASSWORD)
        theirs = lab.browser()
        theirs.sign_in(name)
        theirs.send("POST", f"{API}/service_tokens", {"name": f"of {name}", "scopes": ["view"]})
        removed = admin.send("DELETE", f"{API}/users/{name}{asked}")
        assert removed.status_code == 200, removed.text
        kept, revoked = removed.json()["tokens_kept"], removed.json()["tokens_revoked"]
        assert [one["name"] for one in (kept if asked else revoked)] == [f"of {name}"]
        assert (revoked if asked else kept) == []
    (left,) = admin.send("GET", f"{API}/service_tokens").json()["tokens"]
    assert (left["name"], left["owner"], left["created_by"]) == ("of mia", "ada", "mia")


def test_strangers_hold_up_neither_a_known_browser_nor_who_is_signed_in(
    lab: Lab, accounts: Accounts, admin: Browser
) -> None:
    stranger = lab.browser()
    statuses = [stranger.sign_in("ada", "a wrong password") for _ in range(MOST_WRONG + 1)]
    assert statuses == [401] * MOST_WRONG + [429]
    for number in range(GUESSED_WRONG):
        lab.browser(address=f"10.1.0.{number}").sign_in("ada", "a wrong password")
    assert lab.browser(address="10.2.0.1").sign_in("ada") == 429
    listed = {user["name"]: user["guessed_at"] for user in admin.send("GET", f"{API}/users").json()["users"]}
    assert listed == {"ada": True}

    change = {"password": PASSWORD, "new_password": "another password"}
    assert admin.send("PUT", f"{API}/session/password", change).status_code == 204
    for number in range(GUESSED_WRONG):
        lab.browser(address=f"10.3.0.{number}").sign_in("ada", "a wrong password")
    assert admin.send("DELETE", f"{API}/session").status_code == 204
    assert admin.sign_in("ada", "another password") == 200
    form = {"name": "ada", "password": "another password"}
    assert admin.send("POST", "/sign_in", form=form).status_code == 303


def test_the_cookie_of_a_known_browser_is_out_of_reach_of_scripts_and_signs_nobody_in(
    lab: Lab, admin: Browser
) -> None:
    answer = admin.send("POST", f"{API}/session", {"name": "ada", "password": PASSWORD})
    (known,) = [text for text in answer.headers.get_list("set-cookie") if text.startswith("foveacam_known=")]
    assert "HttpOnly" in known and "SameSite=lax" in known
    only = Browser(lab.app, "10.0.0.1", httpx.Cookies({"foveacam_known": admin.cookies["foveacam_known"]}))
    assert not only.is_known()


def test_the_first_admins_link_is_used_by_the_form_once(accounts: Accounts) -> None:
    app = FastAPI()
    gate = security.install(app, Settings(host="0.0.0.0"))  # noqa: S104  # the guarded case
    gate.accounts = accounts
    browser = Browser(app, "10.0.0.1")
    code = accounts.first_admin.write("http://rig.example/").read_text().strip().partition("code=")[2]
    assert "names the file" in browser.send("GET", "/sign_in").text
    form = {"code": code, "name": "ada", "password": PASSWORD, "again": PASSWORD}
    assert browser.send("POST", "/join", form=form).status_code == 303
    assert browser.send("POST", "/join", form=form | {"name": "eve"}).status_code == 401
    assert [user.name for user in accounts.users.all()] == ["ada"]
