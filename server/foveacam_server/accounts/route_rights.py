"""The right that every route and stream needs: a row for each resource, and its exceptions.

A path that has no row needs the right to administer, so that a forgotten one is open to nobody by mistake.
"""

import re
from dataclasses import dataclass

from foveacam_server.accounts.rights import Right

API = "/api/v1/"
_SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
_VIEW, _OPERATE, _ADMINISTER = Right.VIEW, Right.OPERATE, Right.ADMINISTER


@dataclass(frozen=True, slots=True)
class _Row:
    """What reading a resource needs, and what changing it needs."""

    read: Right
    change: Right


_SEEN_BY_ALL = _Row(_VIEW, _OPERATE)
_OWN = _Row(_VIEW, _VIEW)
"""Computed for whoever asks, or one's own: nothing of the rig changes."""
_OF_ADMINS = _Row(_ADMINISTER, _ADMINISTER)

RESOURCES: dict[str, _Row] = {
    "archive": _SEEN_BY_ALL,
    "audit": _OF_ADMINS,
    "audit.jsonl": _OF_ADMINS,
    "batches": _SEEN_BY_ALL,
    "calibration_sessions": _SEEN_BY_ALL,
    "calibrations": _SEEN_BY_ALL,
    "cameras": _SEEN_BY_ALL,
    "captures": _SEEN_BY_ALL,
    "clouds": _SEEN_BY_ALL,
    "depth": _SEEN_BY_ALL,
    "displays": _SEEN_BY_ALL,
    "drift_checks": _SEEN_BY_ALL,
    "engine": _SEEN_BY_ALL,
    "events": _SEEN_BY_ALL,
    "faults": _SEEN_BY_ALL,
    "fixations": _SEEN_BY_ALL,
    "follows": _SEEN_BY_ALL,
    "jobs": _SEEN_BY_ALL,
    "lease": _SEEN_BY_ALL,
    "loop": _SEEN_BY_ALL,
    "measurements": _SEEN_BY_ALL,
    "measurements.csv": _SEEN_BY_ALL,
    "measurements.json": _SEEN_BY_ALL,
    "mirrors": _SEEN_BY_ALL,
    "pan_tilt": _SEEN_BY_ALL,
    "planner": _OWN,
    "rail": _SEEN_BY_ALL,
    "reach": _SEEN_BY_ALL,
    "recordings": _SEEN_BY_ALL,
    "rig": _Row(_VIEW, _ADMINISTER),
    "rigs": _SEEN_BY_ALL,
    "retention": _SEEN_BY_ALL,
    "service_tokens": _OF_ADMINS,
    "session": _OWN,
    "sessions": _OWN,
    "settle_time": _SEEN_BY_ALL,
    "simulation": _SEEN_BY_ALL,
    "stills": _SEEN_BY_ALL,
    "stop": _SEEN_BY_ALL,
    "suggestions": _SEEN_BY_ALL,
    "targets": _SEEN_BY_ALL,
    "users": _OF_ADMINS,
    "views": _SEEN_BY_ALL,
    "wide_depth": _SEEN_BY_ALL,
    "wide_depth.ply": _SEEN_BY_ALL,
    "wide_depth.png": _SEEN_BY_ALL,
}
"""By the first part of the path after `/api/v1/`."""

EXCEPTIONS: dict[tuple[str, str], Right] = {
    ("DELETE", "captures/trash"): _ADMINISTER,  # deletes for good
    ("DELETE", "recordings/trash"): _ADMINISTER,
    ("DELETE", "stills/trash"): _ADMINISTER,
    ("POST", "calibrations/{id}/activate"): _ADMINISTER,
    ("POST", "captures/estimates"): _VIEW,
    ("PUT", "displays/{id}"): _VIEW,  # a screen says that it shows the pattern
    ("DELETE", "displays/{id}"): _VIEW,
    ("PUT", "displays/pattern"): _OPERATE,
}
"""By method and path after `/api/v1/`; `{id}` is any one part."""

WEBSOCKETS: dict[str, Right] = {
    "/api/v1/views/ws": _VIEW,
    "/api/v1/mirrors/steering": _OPERATE,
    "/viser": _VIEW,
    "/viser/": _VIEW,
}

PAGES: dict[str, Right] = {
    "/": _VIEW,
    "/view": _VIEW,
    "/windows": _VIEW,
    "/replay": _VIEW,
    "/display": _VIEW,
    "/docs": _VIEW,
    "/redoc": _VIEW,
    "/openapi.json": _VIEW,
    "/favicon.ico": _VIEW,
    "/viser": _VIEW,
    "/viser/": _VIEW,
    "/readyz": _VIEW,
    "/metrics": _VIEW,
}
FOLDERS = ("/static/", "/docs/parts/")
"""Files of the pages; whoever is let in sees them."""
OPEN_PATHS = frozenset({"/healthz"})
"""Served to anybody: a probe has no token."""
OPEN_CALLS = frozenset(
    {
        ("GET", "/api/v1/session"),
        ("POST", "/api/v1/session"),
        ("POST", "/api/v1/session/invitation"),
    }
)
"""How one signs in."""


def declared_right(method: str, path: str) -> Right | None:
    """Return the right that a request needs; None for a path that no row declares."""
    if not path.startswith(API):
        return _VIEW if path.startswith(FOLDERS) and method in _SAFE else PAGES.get(path)
    rest = path.removeprefix(API)
    for (of_method, pattern), right in _PATTERNS.get(rest.partition("/")[0], ()):
        if of_method == method and pattern.fullmatch(rest):
            return right
    row = RESOURCES.get(rest.partition("/")[0])
    if row is None:
        return None
    return row.read if method in _SAFE else row.change


def needed_right(kind: str, method: str, path: str) -> Right:
    """Return the right that a request (`http`) or WebSocket (`websocket`) needs."""
    declared = WEBSOCKETS.get(path) if kind == "websocket" else declared_right(method, path)
    return _ADMINISTER if declared is None else declared


def _compiled() -> dict[str, list[tuple[tuple[str, re.Pattern[str]], Right]]]:
    """Return the exceptions by resource: those without an id first, which an id's pattern would match too."""
    found: dict[str, list[tuple[tuple[str, re.Pattern[str]], Right]]] = {}
    for (method, path), right in sorted(EXCEPTIONS.items(), key=lambda item: "{id}" in item[0][1]):
        pattern = re.compile("[^/]+".join(re.escape(part) for part in path.split("{id}")))
        found.setdefault(path.partition("/")[0], []).append(((method, pattern), right))
    return found


_PATTERNS = _compiled()
