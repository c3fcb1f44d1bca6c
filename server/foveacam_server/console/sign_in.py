"""The pages and forms of signing in; they need no script, and send secrets only in a body.

The one-time link of an invitation has its code in the URL, which works only once.
"""

import asyncio
from html import escape
from urllib.parse import parse_qs

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from foveacam_hardware.contract import FoveaError
from foveacam_server.accounts.accounts import Accounts, Mode
from foveacam_server.accounts.audit import AuditNote
from foveacam_server.accounts.browser_sign_in import known_cookie_of, sign_in_browser
from foveacam_server.accounts.cookies import set_cookie
from foveacam_server.accounts.passwords import LEAST_CHARS
from foveacam_server.accounts.requests import address_of
from foveacam_server.accounts.rights import ANONYMOUS
from foveacam_server.accounts.route_rights import open_to_anybody
from foveacam_server.accounts.users import User
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.console.refusals import too_many_tries
from foveacam_server.foundation.errors import UNAUTHORIZED, WrongCredentials, problem_of

FORM_BYTES = 4096
OPENID_PATH = "/sign_in/openid"
_NO_USERS = "This server has no users."
_FORM_TYPE = "application/x-www-form-urlencoded"

# Their forms may name their origin, which `no-referrer` would make `null`, which the access rules refuse.
REFERRER_POLICY = "same-origin"

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>FoveaCam Duo</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif; }
body { display: grid; place-items: center; align-content: center; gap: 2rem; min-height: 100vh; margin: 0; }
form, main { display: grid; gap: .75rem; width: min(20rem, 90vw); }
h1 { font-size: 1.25rem; margin: 0; }
p { margin: 0; overflow-wrap: anywhere; }
input, button { font: inherit; padding: .5rem; }
.button { padding: .5rem; text-align: center; border: 1px solid; border-radius: .25rem; color: inherit; }
[role=alert] { color: light-dark(#a3140c, #ffb4a9); margin: 0; }
</style></head>
<body>__BODY__</body></html>
"""
# A link, since the policy allows forms to this server only
_OPENID = f"""<main><a class="button" href="{OPENID_PATH}">Sign in with __NAME__</a></main>"""
_NAME = """<label for="name">Name</label>
<input id="name" name="name" autocomplete="username" autocapitalize="none" value="__VALUE__"
required __FOCUS__>
"""


def page_of(gate: AccessRules, *, problem: str = "", name: str = "") -> str:
    """Return the sign-in page; `problem`: why the last attempt was refused."""
    mode = gate.mode
    if mode is Mode.FIRST_ADMIN:
        body = (
            "<main><h1>FoveaCam Duo</h1><p>This server has no user yet. Open the link that makes the first "
            "admin: its terminal names the file that has it.</p></main>"
        )
        return _PAGE.replace("__BODY__", body)
    forms = [_password_form(problem, name)] if mode is Mode.USERS else []
    if mode is Mode.USERS and gate.openid_name is not None:
        forms.append(_OPENID.replace("__NAME__", escape(gate.openid_name)))
    if gate.token is not None:
        forms.append(_token_form("" if forms else problem, focus=not forms))
    return _PAGE.replace("__BODY__", "\n".join(forms))


def _password_form(problem: str, name: str) -> str:
    return (
        '<form action="/sign_in" method="post"><h1>FoveaCam Duo</h1>\n'
        + _NAME.replace("__FOCUS__", "" if name else "autofocus").replace("__VALUE__", escape(name))
        + '<label for="password">Password</label>\n<input id="password" name="password" type="password" '
        f'autocomplete="current-password" required{" autofocus" if name else ""}>\n'
        f"{_alert(problem)}<button>Sign in</button></form>"
    )


def _token_form(problem: str, *, focus: bool) -> str:
    title = "<h1>FoveaCam Duo</h1>\n" if focus else ""
    return (
        f'<form action="/sign_in" method="post">{title}'
        '<label for="token">This rig asks for its token.</label>\n'
        '<input id="token" name="token" type="password" autocomplete="current-password" required'
        f"{' autofocus' if focus else ''}>\n{_alert(problem)}<button>Open the console</button></form>"
    )


def _join_page(code: str, *, first: bool, problem: str = "", name: str = "") -> str:
    asked = "Choose a name and a password: you are the first admin." if first else "Choose your password."
    field = _NAME.replace("__FOCUS__", "autofocus").replace("__VALUE__", escape(name)) if first else ""
    body = (
        '<form action="/join" method="post"><h1>FoveaCam Duo</h1>\n'
        f'<p>{asked}</p><input type="hidden" name="code" value="{escape(code)}">\n{field}'
        f'<label for="password">Password, at least {LEAST_CHARS} characters</label>\n'
        '<input id="password" name="password" type="password" autocomplete="new-password" required '
        f'minlength="{LEAST_CHARS}"{"" if first else " autofocus"}>\n'
        '<label for="again">The same again</label>\n'
        '<input id="again" name="again" type="password" autocomplete="new-password" required>\n'
        f"{_alert(problem)}<button>Sign in</button></form>"
    )
    return _PAGE.replace("__BODY__", body)


def _alert(problem: str) -> str:
    return f'<p role="alert">{escape(problem)}</p>\n' if problem else ""


def router(gate: AccessRules) -> APIRouter:
    """Return the routes of the sign-in pages, for a server with these rules."""
    forms, routes = _SignInForms(gate), APIRouter(include_in_schema=False)
    routes.add_api_route("/sign_in", forms.show, methods=["GET"])
    routes.add_api_route("/sign_in", forms.sign_in, methods=["POST"])
    routes.add_api_route("/join", forms.show_join, methods=["GET"])
    routes.add_api_route("/join", forms.join, methods=["POST"])
    return routes


class _SignInForms:
    """Handles the forms: answers with the console and the cookie, or with the form and the reason."""

    def __init__(self, gate: AccessRules) -> None:
        self._gate = gate

    @open_to_anybody
    async def show(self, request: Request) -> Response:
        if request.scope["principal"] is not ANONYMOUS:
            return RedirectResponse("/", status_code=303)
        return self._page("", status=200)

    @open_to_anybody
    async def sign_in(self, request: Request) -> Response:
        form, address = await read_form(request), address_of(request.scope)
        if "name" not in form or self._gate.accounts is None:
            return self._sign_in_by_token(request, form.get("token", ""), address)
        note: AuditNote = request.scope["audit_note"]
        name = form["name"].strip().lower()
        note.detail = f"sign in as {name[:64]}"
        try:
            user = await asyncio.to_thread(
                self._gate.accounts.authenticate,
                name,
                form.get("password", ""),
                address=address,
                known=known_cookie_of(request),
            )
            return await asyncio.to_thread(self._begin, request, self._gate.accounts, user)
        except FoveaError as error:
            return self._page(str(error), status=problem_of(error).kind.status, name=name)

    def _sign_in_by_token(self, request: Request, token: str, address: str) -> Response:
        if self._gate.admits_token(token, address=address):
            answer = RedirectResponse("/", status_code=303)
            set_cookie(answer, self._gate.cookie, secure=request.url.scheme == "https")
            return answer
        wait_s = self._gate.attempts.wait_s(address)
        if wait_s > 0.0:
            problem = too_many_tries(wait_s).problem
            return self._page(problem.detail, status=problem.kind.status)
        return self._page("This is not the token of this server.", status=UNAUTHORIZED.status)

    @open_to_anybody
    async def show_join(self, request: Request) -> Response:
        code, accounts = request.query_params.get("code", ""), self._gate.accounts
        if accounts is None:
            return self._page(_NO_USERS, status=UNAUTHORIZED.status)
        first = accounts.is_first_admin_code(code)
        try:
            if not first:
                await asyncio.to_thread(accounts.users.check_invitation, code)
        except WrongCredentials as error:
            return self._page(str(error), status=UNAUTHORIZED.status)
        return _html(_join_page(code, first=first), status=200)

    @open_to_anybody
    async def join(self, request: Request) -> Response:
        form, accounts = await read_form(request), self._gate.accounts
        code, name = form.get("code", ""), form.get("name", "").strip().lower() or None
        if accounts is None:
            return self._page(_NO_USERS, status=UNAUTHORIZED.status)
        first = accounts.is_first_admin_code(code)
        if form.get("password") != form.get("again"):
            page = _join_page(code, first=first, problem="The two passwords differ.", name=name or "")
            return _html(page, status=422)
        try:
            user = await asyncio.to_thread(accounts.join, code, form.get("password", ""), name=name)
            answer = await asyncio.to_thread(self._begin, request, accounts, user)
        except FoveaError as error:
            page = _join_page(code, first=first, problem=str(error), name=name or "")
            return _html(page, status=problem_of(error).kind.status)
        note: AuditNote = request.scope["audit_note"]
        note.detail = f"{user.name} set a password by a link"
        return answer

    def _begin(self, request: Request, accounts: Accounts, user: User) -> Response:
        answer = RedirectResponse("/", status_code=303)
        sign_in_browser(request, answer, accounts, user)
        return answer

    def _page(self, problem: str, *, status: int, name: str = "") -> Response:
        return _html(page_of(self._gate, problem=problem, name=name), status=status)


def _html(page: str, *, status: int) -> Response:
    headers = {"Referrer-Policy": REFERRER_POLICY, "Cache-Control": "no-store"}
    return HTMLResponse(page, status_code=status, headers=headers)


async def read_form(request: Request) -> dict[str, str]:
    """Return the fields of a form; none for a body that is not a form or too long."""
    if not request.headers.get("content-type", "").startswith(_FORM_TYPE):
        return {}
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > FORM_BYTES:
            return {}
    try:
        fields = parse_qs(body.decode("utf-8"), max_num_fields=8)
    except ValueError:  # not UTF-8, or too many fields
        return {}
    return {name: values[0] for name, values in fields.items()}
