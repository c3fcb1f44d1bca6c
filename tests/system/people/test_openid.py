"""Signing in by an OpenID Connect provider that the test starts."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import httpx
import pytest
from fastapi import FastAPI, Request
from pydantic import SecretStr

from foveacam_hardware.contract import InvalidInput
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.accounts.rights import Right, UserRole
from foveacam_server.accounts.route_rights import needs
from foveacam_server.console import openid, security
from foveacam_server.foundation.settings import OpenIdSettings, Settings, checked_settings
from foveacam_server.foundation.store import Store
from tests.support.servers.local_server import serving
from tests.support.servers.openid_provider import CLIENT_ID, CLIENT_SECRET, Provider, serving_provider

ANNA = {"email": "Anna@Lab.example", "email_verified": True}
PASSWORD = "correct horse battery"  # noqa: S105  # a password of this test alone


@pytest.fixture(scope="module")
def shared_provider() -> Iterator[Provider]:
    with serving_provider() as found:
        yield found


@pytest.fixture
def provider(shared_provider: Provider) -> Provider:
    shared_provider.claims = dict(ANNA)
    shared_provider.wrong_nonce = shared_provider.foreign_key = False
    return shared_provider


@pytest.fixture
def accounts(tmp_path: Path) -> Iterator[Accounts]:
    with Store(tmp_path) as store:
        found = Accounts(store, guarded=True)
        found.users.add("ada", UserRole.ADMIN, password=PASSWORD)
        yield found
        found.close()


@pytest.fixture
def browser(provider: Provider, accounts: Accounts) -> Iterator[httpx.Client]:
    with serving(guarded_app(provider, accounts)) as port:
        base = f"http://127.0.0.1:{port}"
        with httpx.Client(base_url=base, follow_redirects=True, trust_env=False, timeout=60.0) as found:
            yield found


def guarded_app(
    provider: Provider, accounts: Accounts, *, new_role: Literal["viewer"] | None = None
) -> FastAPI:
    app = FastAPI()

    @app.get("/")
    @needs(Right.VIEW)
    async def page(request: Request) -> str:
        return str(request.scope["principal"].title)

    chosen = OpenIdSettings(
        issuer=provider.issuer,
        client_id=CLIENT_ID,
        client_secret=SecretStr(CLIENT_SECRET),
        name="Lab & Co",
        new_role=new_role,
    )
    gate = security.install(app, Settings(host="0.0.0.0", openid=chosen))  # noqa: S104 - the guarded case
    gate.accounts = accounts
    return app


def test_a_person_whom_an_admin_added_comes_in(browser: httpx.Client, accounts: Accounts) -> None:
    accounts.users.add("anna@lab.example", UserRole.OPERATOR)
    asked = browser.get("/", headers={"Accept": "text/html"})
    assert asked.status_code == 401
    assert '<a class="button" href="/sign_in/openid">Sign in with Lab &amp; Co</a>' in asked.text
    assert browser.get("/sign_in/openid").json() == "anna@lab.example, an operator"
    (sign_in, _) = accounts.sign_ins.all()[0]
    assert sign_in.user == "anna@lab.example"
    assert accounts.users.get("anna@lab.example").state == "active"
    accounts.change_user("anna@lab.example", role=None, disabled=True)
    assert browser.get("/").status_code == 401
    assert "is disabled" in browser.get("/sign_in/openid").text


def test_a_stranger_is_refused(browser: httpx.Client, accounts: Accounts) -> None:
    refused = browser.get("/sign_in/openid")
    assert refused.status_code == 401 and "was not added by an admin" in refused.text
    assert [user.name for user in accounts.users.all()] == ["ada"]
    assert accounts.sign_ins.all() == []


def test_a_stranger_is_added_where_the_settings_say_so(provider: Provider, accounts: Accounts) -> None:
    with serving(guarded_app(provider, accounts, new_role="viewer")) as port:
        base = f"http://127.0.0.1:{port}"
        with httpx.Client(base_url=base, follow_redirects=True, trust_env=False) as browser:
            assert browser.get("/sign_in/openid").json() == "anna@lab.example, a viewer"


def test_a_token_that_proves_nothing_is_refused(
    browser: httpx.Client, provider: Provider, accounts: Accounts
) -> None:
    accounts.users.add("anna@lab.example", UserRole.OPERATOR)
    unproven: list[tuple[dict[str, object], str]] = [
        ({"email": "anna@lab.example", "email_verified": False}, "has not verified"),
        ({"email": "anna@lab.example"}, "has not verified"),
        ({"email": "", "email_verified": True}, "sent no email"),
        ({}, "sent no email"),
        ({**ANNA, "exp": 1}, "answer is not good"),
        ({**ANNA, "aud": "another"}, "answer is not good"),
        ({**ANNA, "iss": "http://evil.example"}, "answer is not good"),
    ]
    for claims, why in unproven:
        provider.claims = claims
        refused = browser.get("/sign_in/openid")
        assert (refused.status_code, why in refused.text) == (401, True), claims
    assert accounts.sign_ins.all() == []


def test_a_forged_token_and_a_replayed_answer_are_refused(
    browser: httpx.Client, provider: Provider, accounts: Accounts
) -> None:
    accounts.users.add("anna@lab.example", UserRole.OPERATOR)
    provider.foreign_key = True
    assert browser.get("/sign_in/openid").status_code == 401
    provider.foreign_key, provider.wrong_nonce = False, True
    assert browser.get("/sign_in/openid").status_code == 401
    provider.wrong_nonce = False
    followed = browser.get("/sign_in/openid")
    callback = next(step.url for step in followed.history if "callback" in str(step.url))
    browser.cookies.delete("foveacam_session")
    assert browser.get(callback).status_code == 401
    assert browser.get("/sign_in/openid/callback?code=x&state=y").status_code == 401
    assert len(accounts.sign_ins.all()) == 1


def test_a_provider_that_does_not_answer_is_named(provider: Provider, accounts: Accounts) -> None:
    gone = Provider(port=9)
    with serving(guarded_app(gone, accounts)) as port, httpx.Client(trust_env=False) as browser:
        refused = browser.get(f"http://127.0.0.1:{port}/sign_in/openid")
    assert refused.status_code == 502 and "http://127.0.0.1:9 does not answer" in refused.text


def test_the_provider_is_named_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("ISSUER", "https://id.example"), ("CLIENT_ID", "a"), ("CLIENT_SECRET", "b")):
        monkeypatch.setenv(f"FOVEACAM_OPENID__{name}", value)
    found = checked_settings({}).openid
    assert found is not None and (found.issuer, found.claim) == ("https://id.example", "email")
    assert "b" not in repr(found.client_secret)
    monkeypatch.setenv("FOVEACAM_OPENID__NEW_ROLE", "king")
    with pytest.raises(InvalidInput, match="viewer"):
        checked_settings({})


def test_without_authlib_one_sentence_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "authlib.integrations.starlette_client", None)
    chosen = OpenIdSettings(issuer="https://id.example", client_id="a", client_secret=SecretStr("b"))
    with pytest.raises(InvalidInput, match=r"foveacam-duo\[openid\]"):
        openid._provider(chosen)
