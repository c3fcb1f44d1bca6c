"""The Content-Security-Policy of the server's pages."""

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


def content_policy() -> str:
    """Return the policy of every answer without a specific one."""
    return _joined(_OWN)


def viser_policy(*, bare: bool) -> str:
    """Return the policy of the 3D pane; `bare`: inside the console, where it shows no copy of the views."""
    return _joined(_VISER | {"frame-src": "'none'"} if bare else _VISER)


def _joined(rules: dict[str, str]) -> str:
    return "; ".join(f"{name} {value}" for name, value in rules.items())
