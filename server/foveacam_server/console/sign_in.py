"""The sign-in page and its form, which sends the token in a body and never in a URL."""

from html import escape
from urllib.parse import parse_qs

from starlette.types import Receive, Scope

PATH = "/sign_in"
_FORM_BYTES = 4096
_FORM_TYPE = b"application/x-www-form-urlencoded"

# Its form may name its origin, which `no-referrer` would turn into `null`, which the access rules refuse.
REFERRER_POLICY = "same-origin"

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>FoveaCam Duo</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif; }
body { display: grid; place-items: center; min-height: 100vh; margin: 0; }
form { display: grid; gap: .75rem; width: min(20rem, 90vw); }
h1 { font-size: 1.25rem; margin: 0; }
input, button { font: inherit; padding: .5rem; }
[role=alert] { color: light-dark(#a3140c, #ffb4a9); margin: 0; }
</style></head>
<body><form action="/sign_in" method="post">
<h1>FoveaCam Duo</h1>
<label for="token">This rig asks for its token.</label>
<input id="token" name="token" type="password" autocomplete="current-password" required autofocus>
__PROBLEM__<button>Open the console</button>
</form></body></html>
"""


def sign_in_page(problem: str = "") -> str:
    """Return the sign-in page; `problem`: why the last token was refused."""
    alert = f'<p role="alert">{escape(problem)}</p>\n' if problem else ""
    return _PAGE.replace("__PROBLEM__", alert)


async def read_form_token(scope: Scope, receive: Receive) -> str | None:
    """Return the token in the body of the sign-in form; None for any other request."""
    if scope["type"] != "http" or (scope["method"], scope["path"]) != ("POST", PATH):
        return None
    if not dict(scope["headers"]).get(b"content-type", b"").startswith(_FORM_TYPE):
        return None
    body, more = b"", True
    while more and len(body) <= _FORM_BYTES:
        message = await receive()
        body += message.get("body", b"")
        more = message.get("more_body", False)
    return parse_qs(body.decode("latin-1"), max_num_fields=4).get("token", [""])[0] if not more else ""
