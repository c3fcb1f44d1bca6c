"""How long a first request blocks the event loop: each route is requested once on a fresh server."""

import re
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path

import httpx
from websockets.sync.client import connect

from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess, free_port

PROGRAM = ("foveacam_bench.doors.timed_server", "{port}", "{data}")
LONG_MS = 50.0
PATIENCE_S = 20.0
PAGES = ("/", "/docs", "/view", "/join", "/metrics", "/healthz", "/readyz", "/viser/", "/nowhere")
GRID = {"kind": "grid", "columns": 3, "rows": 3}
POINT = {"pixel": {"x_px": 700.0, "y_px": 500.0}}
CHANGES = (
    ("POST", "/api/v1/lease", {"holder": "bench"}),
    ("POST", "/api/v1/fixations", POINT),
    ("POST", "/api/v1/captures/estimates", {"plan": {"points": GRID}, "distance_m": 5.0}),
    ("POST", "/api/v1/planner/standoff", {"detection_range_m": 5.0}),
    ("POST", "/api/v1/planner/map", {"kind": "open", "size_m": 60.0}),
    ("POST", "/api/v1/captures", {"name": "first", "plan": {"points": GRID}}),
    ("POST", "/api/v1/recordings", {"name": "first", "duration_s": 0.5}),
    ("POST", "/api/v1/stills", {"name": "first"}),
    ("POST", "/api/v1/follows", POINT),
    ("POST", "/api/v1/calibration_sessions", {"label": "first"}),
    ("POST", "/api/v1/calibrations/import", {"format": "none"}),
    ("POST", "/api/v1/session", {"name": "nobody", "password": "not the right one"}),
    ("POST", "/api/v1/service_tokens", {"name": "first", "scopes": ["view"], "days": 1}),
    ("POST", "/api/v1/fixations", {"pixel": "wrong"}),
    ("POST", "/api/v1/stop", None),
    ("DELETE", "/api/v1/stop", None),
)
SOCKETS = ("/api/v1/views/ws", "/api/v1/mirrors/steering")
_PARAMETER = re.compile(r"\{[^}]*\}")


def first_use_figures(folder: Path, *, every: int = 1) -> Figures:
    """Return the longest block of the event loop by a first request, and which requests held it too long.

    A block is measured by the clock, and by the processor time of the loop's thread: on a busy machine the
    clock counts what other programs do too. `every`: step through the requests; n sends every n-th one.
    """
    folder.mkdir(exist_ok=True)
    log = folder / "callbacks.txt"
    asked: dict[str, str] = {}
    server = ServerProcess(folder, port=free_port(), options=(str(log),), program=PROGRAM)
    with server, httpx.Client(base_url=server.url, timeout=PATIENCE_S, trust_env=False) as http:
        begin = len(log.read_text().splitlines()) if log.exists() else 0  # the start itself serves nobody
        for number, (method, path, body) in enumerate(islice(first_requests(http), 0, None, every)):
            request_id = f"first-{number}"
            asked[request_id] = f"{method} {path}"
            _ask(http, method, path, body, request_id=request_id)
        for path in SOCKETS:
            request_id = path.replace("/", "-")[1:]
            asked[request_id] = path
            _open_socket(server.url.replace("http", "ws", 1) + path[1:], request_id=request_id)
    lines = [line.split() for line in log.read_text().splitlines()[begin:]]
    blocks = sorted(((float(took), asked.get(who, "no request")) for took, _, who in lines), reverse=True)
    return {
        "first_uses": len(asked),
        "first_use_block_computing_ms": max((float(work) for _, work, _ in lines), default=0.0),
        "first_use_block_ms": blocks[0][0] if blocks else 0.0,
        "first_use_blocks": [f"{name}: {took:.0f} ms" for took, name in blocks if took > LONG_MS],
    }


def first_requests(http: httpx.Client) -> Iterator[tuple[str, str, object]]:
    """Yield every page, the document itself, typical changes, and every operation that reads."""
    yield from (("GET", path, None) for path in PAGES)
    yield "GET", "/openapi.json", None
    yield from CHANGES
    for path, operations in http.get("/openapi.json").json()["paths"].items():
        if "get" in operations:
            yield "GET", _PARAMETER.sub("1", path), None


def _ask(http: httpx.Client, method: str, path: str, body: object, *, request_id: str) -> None:
    """Send a request; a response that never ends is read at its beginning only."""
    headers = {"X-Request-ID": request_id}
    request = http.build_request(method, path, json=body, headers=headers)
    with suppress(httpx.HTTPError):
        answer = http.send(request, stream=True)
        endless = answer.headers.get("Content-Type", "").startswith(("text/event-stream", "multipart/"))
        if endless:
            next(answer.iter_raw(), b"")
        else:
            answer.read()
        answer.close()


def _open_socket(url: str, *, request_id: str) -> None:
    """Open a WebSocket and send a message that it refuses."""
    with suppress(OSError), connect(url, additional_headers={"X-Request-ID": request_id}) as one:
        one.send("{}")
