"""The Content-Security-Policy of the server's pages: what they may load and run."""

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


def content_policy(path: str) -> str:
    """Return the Content-Security-Policy of what is served at `path`."""
    rules = _VISER if path.startswith("/viser") else _OWN
    return "; ".join(f"{name} {value}" for name, value in rules.items())


def bare_viser_policy() -> str:
    """Return the policy of the 3D pane inside the console, where it shows no copy of the views."""
    return "; ".join(f"{name} {value}" for name, value in (_VISER | {"frame-src": "'none'"}).items())
