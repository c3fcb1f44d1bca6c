"""What our pages may load and run (Content-Security-Policy), and the page that asks for the token."""

_OWN = {
    "default-src": "'self'",
    "script-src": "'self'",
    "style-src": "'self' 'unsafe-inline'",
    "img-src": "'self' blob: data:",
    "connect-src": "'self'",
    "worker-src": "'self' blob:",
    "frame-src": "'self'",
    "object-src": "'none'",
    "base-uri": "'none'",
    "form-action": "'self'",
    "frame-ancestors": "'self'",
}
# viser's client is one page that unpacks its own script, style and WebAssembly, and loads textures from blobs
_VISER = _OWN | {
    "script-src": "'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob:",
    "font-src": "'self' data:",
    "connect-src": "'self' blob: data:",
}
# FastAPI's own documentation pages take Swagger UI and ReDoc from a CDN
_DOCS = _OWN | {
    "script-src": "'self' 'unsafe-inline' https://cdn.jsdelivr.net",
    "style-src": "'self' 'unsafe-inline' https://cdn.jsdelivr.net https://fonts.googleapis.com",
    "img-src": "'self' data: https://fastapi.tiangolo.com https://cdn.redoc.ly",
    "font-src": "'self' https://fonts.gstatic.com",
}

_SIGN_IN_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>FoveaCam Duo</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
:root { color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif; }
body { display: grid; place-items: center; min-height: 100vh; margin: 0; }
form { display: grid; gap: .75rem; width: min(20rem, 90vw); }
h1 { font-size: 1.25rem; margin: 0; }
input, button { font: inherit; padding: .5rem; }
</style></head>
<body><form action="/" method="get">
<h1>FoveaCam Duo</h1>
<label for="token">This rig asks for its token.</label>
<input id="token" name="token" type="password" autocomplete="current-password" required autofocus>
<button>Open the console</button>
</form></body></html>
"""


def content_policy(path: str) -> str:
    """Return the Content-Security-Policy of what is served at `path`."""
    if path.startswith("/viser"):
        rules = _VISER
    elif path.startswith(("/docs", "/redoc")):
        rules = _DOCS
    else:
        rules = _OWN
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def bare_viser_policy() -> str:
    """Return the policy of the 3D pane inside the console: it shows no second copy of the views."""
    return "; ".join(f"{name} {value}" for name, value in (_VISER | {"frame-src": "'none'"}).items())


def sign_in_page() -> str:
    """Return the page that asks for the token and opens the console with it."""
    return _SIGN_IN_PAGE
