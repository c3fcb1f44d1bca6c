"""Sign-in by an OpenID Connect provider: the lab's accounts instead of passwords stored here.

Authlib implements the protocol (discovery, PKCE, state, nonce, signature); this module decides who is
admitted.
"""

import asyncio
import secrets
from dataclasses import dataclass
from typing import Any

from fastapi import FastAPI, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.middleware.sessions import SessionMiddleware

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_server.accounts.audit import AuditNote
from foveacam_server.accounts.browser_sign_in import sign_in_browser
from foveacam_server.accounts.rights import UserRole
from foveacam_server.accounts.route_rights import open_to_anybody
from foveacam_server.accounts.users import User
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.console.sign_in import OPENID_PATH, REFERRER_POLICY, page_of
from foveacam_server.foundation.errors import WrongCredentials, problem_of
from foveacam_server.foundation.http.addresses import join_address
from foveacam_server.foundation.settings import OpenIdSettings, Settings

OPENID_CALLBACK = f"{OPENID_PATH}/callback"
STATE_COOKIE = "foveacam_openid"
STATE_S = 600
"""Timeout of a sign-in at the provider."""
INSTALL = "pip install 'foveacam-duo[openid]'"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Provider:
    """The provider's client (Authlib's) and the settings."""

    client: Any  # Authlib has no types
    settings: OpenIdSettings


def install(app: FastAPI, settings: Settings, gate: AccessRules) -> None:
    """Serve the sign-in by the settings' provider; do nothing without one.

    Raise `InvalidInput` where Authlib is not installed.
    """
    chosen = settings.openid
    if chosen is None:
        return
    gate.openid_name = chosen.name
    routes = _OpenIdRoutes(_provider(chosen), gate, root_path=settings.root_path)
    app.add_middleware(
        SessionMiddleware,
        secret_key=secrets.token_hex(32),
        session_cookie=STATE_COOKIE,
        max_age=STATE_S,
        path=OPENID_PATH,
        same_site="lax",
    )
    app.add_api_route(OPENID_PATH, routes.ask, methods=["GET"], include_in_schema=False)
    app.add_api_route(OPENID_CALLBACK, routes.answer, methods=["GET"], include_in_schema=False)


def _provider(chosen: OpenIdSettings) -> _Provider:
    try:
        from authlib.integrations.starlette_client import OAuth  # only needed with a provider
    except ImportError as error:
        raise InvalidInput(
            f"signing in by {chosen.issuer} needs Authlib, which is not installed",
            asked=chosen.issuer,
            found="no Authlib",
            remedy=INSTALL,
        ) from error
    client = OAuth().register(
        "provider",
        client_id=chosen.client_id,
        client_secret=chosen.client_secret.get_secret_value(),
        server_metadata_url=f"{chosen.issuer.rstrip('/')}/.well-known/openid-configuration",
        client_kwargs={"scope": "openid email profile", "code_challenge_method": "S256"},
    )
    return _Provider(client=client, settings=chosen)


class _OpenIdRoutes:
    """Redirects a browser to the provider, and signs it in on its return."""

    def __init__(self, provider: _Provider, gate: AccessRules, *, root_path: str) -> None:
        self._provider = provider
        self._callback = f"{root_path}{OPENID_CALLBACK}"
        self._gate = gate

    @open_to_anybody
    async def ask(self, request: Request) -> Response:
        callback = join_address(str(request.base_url), self._callback)
        try:
            found: Response = await self._provider.client.authorize_redirect(request, callback)
        except Exception as error:  # noqa: BLE001 - whatever a foreign server and its client library raise
            return self._refused(
                f"the provider {self._provider.settings.issuer} does not answer: {error}", 502
            )
        return found

    @open_to_anybody
    async def answer(self, request: Request) -> Response:
        note: AuditNote = request.scope["audit_note"]
        try:
            token = await self._provider.client.authorize_access_token(request)
            claims: dict[str, object] = dict(token["userinfo"])  # object: the provider's own, checked below
        except Exception as error:  # noqa: BLE001 - as above
            return self._refused(f"the provider's answer is not good: {error}", 401)
        try:
            name = _name_of(claims, claim=self._provider.settings.claim)
            note.detail = f"sign in as {name} by {self._provider.settings.issuer}"
            return await asyncio.to_thread(self._begin, name, request)
        except FoveaError as error:
            return self._refused(str(error), problem_of(error).kind.status)

    def _begin(self, name: str, request: Request) -> Response:
        accounts = self._gate.accounts
        if accounts is None:
            raise WrongCredentials("the server has not started")
        user: User = accounts.users.come_by_provider(name, new_role=self._new_role)
        answer = RedirectResponse("/", status_code=303)
        sign_in_browser(request, answer, accounts, user)
        return answer

    @property
    def _new_role(self) -> UserRole | None:
        chosen = self._provider.settings.new_role
        return None if chosen is None else UserRole(chosen)

    def _refused(self, problem: str, status: int) -> Response:
        page = page_of(self._gate, problem=problem)
        return HTMLResponse(page, status_code=status, headers={"Referrer-Policy": REFERRER_POLICY})


def _name_of(claims: dict[str, object], *, claim: str) -> str:  # object: the provider's own
    """Return the user's name of an ID token; raise `WrongCredentials` for one without a verified name."""
    name = claims.get(claim)
    if not isinstance(name, str) or not name:
        raise WrongCredentials(f"the provider sent no {claim}; choose another FOVEACAM_OPENID__CLAIM")
    if claim == "email" and claims.get("email_verified") is not True:
        raise WrongCredentials(f"the provider has not verified the address {name}")
    return name.strip().lower()
