"""Checks a running server as a client: reachability, version, rights, readiness, clock, streams, TLS."""

import socket
import ssl
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime

import httpx
from pydantic import SecretStr
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from foveacam_server import __version__
from foveacam_server.checks.findings import Finding, Severity, attempt, fine, problem, warning
from foveacam_server.foundation.http.addresses import server_address, websocket_address

PATIENCE_S = 10.0
PROBES = 9
SLOW_MS = 100.0
CLOCK_OFF_S = 5.0
DAYS_LEFT = 14
_LATE = "a busy machine, or a proxy that holds answers back: ask again, then see the server's log"
_CUT = "a server that is ending, or a proxy between that refuses it: ask again, then see the server's log"
_OTHER = "is it a FoveaCam server, of this version? Does a proxy answer in its place?"
_SIGN_IN = "add a token on its page People (a scope to view is enough) and set FOVEACAM_TOKEN to it"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Client:
    http: httpx.Client
    token: str | None
    trusted: ssl.SSLContext

    @property
    def websocket_url(self) -> str:
        return websocket_address(str(self.http.base_url), "/api/v1/views/ws")

    @property
    def encrypted(self) -> bool:
        return self.http.base_url.scheme == "https"


def examine_server(
    url: str, *, token: SecretStr | None, trusted: ssl.SSLContext | None = None
) -> list[Finding]:
    """Run all checks on the server at `url`; those that depend on a failed one are left out.

    `trusted`: certificates to trust; None: the system's. Raise `InvalidInput` for an invalid address.
    """
    secret = None if token is None else token.get_secret_value()
    headers = {} if secret is None else {"X-Api-Token": secret}
    verified = trusted or ssl.create_default_context()
    with httpx.Client(
        base_url=server_address(url), headers=headers, timeout=PATIENCE_S, trust_env=False, verify=verified
    ) as http:
        return _findings(_Client(http=http, token=secret, trusted=verified))


def _findings(client: _Client) -> list[Finding]:
    """Return one finding of each check, whatever the server answers and however late."""
    reached = _attempt("server", _check_reached, client)
    if reached.level is Severity.PROBLEM:
        return [reached]
    found = [reached, _attempt("clock", _check_clock, client)]
    if client.encrypted:
        found.append(_attempt("certificate", _check_certificate, client))
    known = _attempt("sign_in", _check_known, client)
    if known.level is Severity.PROBLEM:
        return [*found, known]
    checks: dict[str, Callable[[_Client], Finding]] = {
        "version": _check_version,
        "rig": _check_ready,
        "calibration": _check_calibration,
        "events": _check_events,
        "views": _check_views,
    }
    return [*found, known, *(_attempt(name, check, client) for name, check in checks.items())]


def _attempt(name: str, check: Callable[[_Client], Finding], client: _Client) -> Finding:
    """Return the finding of a check; an answer that is late, cut off or of another kind is a problem."""

    def asked() -> Finding:
        try:
            return check(client)
        except httpx.TimeoutException:
            return problem(name, f"no answer in {PATIENCE_S:g} s", _LATE)
        except (httpx.HTTPError, OSError, WebSocketException) as error:
            return problem(name, f"no answer: {error or type(error).__name__}", _CUT)
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            found = f"the answer is not as this server's is ({type(error).__name__}: {error})"
            return problem(name, found, _OTHER)

    return attempt(name, asked)


def _check_reached(client: _Client) -> Finding:
    took_ms = []
    try:
        for _ in range(PROBES):
            began_s = time.perf_counter()
            answer = client.http.get("/healthz")
            took_ms.append(1e3 * (time.perf_counter() - began_s))
    except httpx.HTTPError as error:
        remedy = "is it started, the port right, a firewall or proxy between? By https: its certificate?"
        return problem("server", f"no answer from {client.http.base_url}: {error}", remedy)
    if answer.status_code != 200 or "status" not in answer.text:
        return problem(
            "server", f"{client.http.base_url} answers {answer.status_code}, and not as this server does"
        )
    median_ms = statistics.median(took_ms)
    text = f"{client.http.base_url} answers in {median_ms:.1f} ms"
    if median_ms > SLOW_MS:
        return warning("server", text, "a slow network or a busy machine: live views will lag")
    return fine("server", text)


def _check_clock(client: _Client) -> Finding:
    date = client.http.get("/healthz").headers.get("date")
    if date is None:
        return warning("clock", "the server does not state its time", "does a proxy remove the header Date?")
    off_s = (datetime.now(UTC) - parsedate_to_datetime(date)).total_seconds()
    text = f"the clocks differ by {abs(off_s):.0f} s"
    if abs(off_s) > CLOCK_OFF_S:
        return warning("clock", text, "times of records and the life of sign-ins go by it: set both by NTP")
    return fine("clock", text)


def _check_certificate(client: _Client) -> Finding:
    where = client.http.base_url.host, client.http.base_url.port or 443
    with (
        socket.create_connection(where, timeout=PATIENCE_S) as peer,
        client.trusted.wrap_socket(peer, server_hostname=where[0]) as encrypted,
    ):
        end = str((encrypted.getpeercert() or {})["notAfter"])
    until = datetime.fromtimestamp(ssl.cert_time_to_seconds(end), UTC)
    left_days = (until - datetime.now(UTC)).days
    text = f"the certificate is good until {until:%Y-%m-%d}"
    if left_days < DAYS_LEFT:
        return warning("certificate", f"{text}, {left_days} days", "renew it, then start the server again")
    return fine("certificate", text)


def _check_known(client: _Client) -> Finding:
    answer = client.http.get("/api/v1/session")
    if answer.status_code == 401 or answer.json().get("kind") == "nobody":
        return problem("sign_in", "the server asks who you are", _SIGN_IN)
    session = answer.json()
    if "view" not in session["rights"]:
        return problem("sign_in", f"{session['name']} may not view", _SIGN_IN)
    return fine("sign_in", f"{session['name']} may {', '.join(session['rights'])}")


def _check_version(client: _Client) -> Finding:
    version = client.http.get("/openapi.json").json()["info"]["version"]
    if version != __version__:
        text = f"the server is {version}, this program {__version__}"
        return warning("version", text, "install the same version on both")
    return fine("version", version)


def _check_ready(client: _Client) -> Finding:
    answer = client.http.get("/readyz").json()
    stop = client.http.get("/api/v1/stop").json()
    if stop["engaged"]:
        return warning("rig", f"the stop is engaged, by {stop['by']}", "release it on the console")
    if answer["ready"]:
        return fine("rig", "it can foveate now")
    missing = "; ".join(f"{each['device']}: {each['detail']}" for each in answer["problems"])
    return problem("rig", missing, "see the page Rig; `foveacam doctor` on its own machine shows more")


def _check_calibration(client: _Client) -> Finding:
    health = client.http.get("/api/v1/calibrations/health").json()
    if health["verdict"] == "recalibrate":
        return warning("calibration", health["detail"], "check the drift, or calibrate again")
    return fine("calibration", health["detail"])


def _check_events(client: _Client) -> Finding:
    """Check that an event stream begins at once: a buffering proxy would delay it."""
    began_s = time.perf_counter()
    try:
        with client.http.stream("GET", "/api/v1/events", headers={"Last-Event-ID": "0"}) as stream:
            next(stream.iter_bytes())
    except (httpx.HTTPError, StopIteration) as error:
        remedy = "does a proxy collect answers? Switch its buffering off for /api/v1/events"
        return problem("events", f"no event came: {type(error).__name__}", remedy)
    return fine("events", f"the first came after {1e3 * (time.perf_counter() - began_s):.0f} ms")


def _check_views(client: _Client) -> Finding:
    headers = {} if client.token is None else {"X-Api-Token": client.token}
    try:
        trusted = client.trusted if client.encrypted else None
        with connect(client.websocket_url, additional_headers=headers, open_timeout=PATIENCE_S, ssl=trusted):
            return fine("views", "WebSockets pass")
    except (OSError, TimeoutError, WebSocketException) as error:
        return problem("views", f"no WebSocket: {error}", "let the proxy pass Upgrade and Connection on")
