"""People, services, sign-ins and the log of a stub server: as the routes answer, kept in lists."""

from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any
from urllib.parse import parse_qs, urlsplit

Json = Any  # what tests put in and look at: any JSON value
Answer = tuple[int, Json]
RIGHTS = {"viewer": ["view"], "operator": ["view", "operate"], "admin": ["view", "operate", "administer"]}
OPEN = {"mode": "open", "name": "this machine", "kind": "local", "role": None, "rights": RIGHTS["admin"]}
OPEN |= {"expires_utc": None}
TOKEN = OPEN | {"mode": "token", "name": "the shared token", "kind": "shared_token"}
NOBODY = OPEN | {"mode": "users", "name": None, "kind": "nobody", "rights": []}
SECRET = "fcd_" + "k3J9" * 10
FIREFOX = "Mozilla/5.0 (X11; Linux x86_64; rv:140.0) Gecko/20100101 Firefox/140.0"
CHROME = "Mozilla/5.0 (Linux; Android 16) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/140.0 Safari/537.36"
PRESENT = "right password"
LOG_PART = 50


def utc(*, ago_s: float = 0.0) -> str:
    """Return a time before now as the server writes it."""
    moment = datetime.now(UTC) - timedelta(seconds=ago_s)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")


def user(name: str, role: str = "operator", **fields: Json) -> Json:
    known = {"name": name, "role": role, "state": "active", "created_utc": utc(ago_s=9e5)}
    return known | {"last_seen_utc": utc(ago_s=300), "guessed_at": False} | fields


def session(identity: str, name: str, *, current: bool = False, browser: str = FIREFOX) -> Json:
    times = {"created_utc": utc(ago_s=9000), "last_seen_utc": utc(ago_s=5), "expires_utc": utc(ago_s=-9e5)}
    document = {"id": identity, "user": name, "address": "192.168.1.20", "browser": browser}
    return document | times | {"current": current, "streams": 0 if current else 2}


def entry(number: int, who: str, what: str, *, outcome: str = "done", **fields: Json) -> Json:
    statuses = {"done": 200, "refused": 403, "failed": 500}
    document = {"id": number, "utc": utc(ago_s=1000.0 - number), "who": who, "kind": "user", "method": "POST"}
    document |= {"path": "/api/v1/captures", "what": what, "detail": "", "address": "192.168.1.20"}
    return document | {"status": statuses[outcome], "outcome": outcome, "repeated": 1} | fields


@dataclass
class StubPeople:
    """Who uses the stub server; `sign_in`: who the browser is."""

    sign_in: Json = field(default_factory=lambda: OPEN)
    signed_out: bool = False
    """Whether the server knows the browser no more: every request is answered by 401."""
    users: list[Json] = field(default_factory=list)
    tokens: list[Json] = field(default_factory=list)
    sessions: list[Json] = field(default_factory=list)
    log: list[Json] = field(default_factory=list)
    made: int = 0

    def sign(self, name: str, role: str) -> None:
        """Let the browser be signed in by this name."""
        named = {"mode": "users", "name": name, "kind": "user", "role": role, "rights": RIGHTS[role]}
        self.sign_in = named | {"expires_utc": utc(ago_s=-9e5)}
        self.users = [user(name, role)]
        self.sessions = [session("here", name, current=True, browser=CHROME)]

    def answer(self, method: str, path: str, body: Json) -> Answer | None:
        """Return status and document; None for what is about something else."""
        address = urlsplit(path)
        steps = address.path.strip("/").split("/")
        if self.signed_out:
            refused = problem(401, "Sign in first", "nobody is signed in here", slug="unauthorized")
            return (200, NOBODY) if (method, path) == ("GET", "/session") else (401, refused)
        if steps == ["session", "password"]:
            wrong = problem(401, "Wrong", "the present password is wrong", slug="wrong-credentials")
            return (204, None) if body["password"] == PRESENT else (401, wrong)
        if steps == ["session"] and method == "DELETE":
            self.signed_out = True
            return 204, None
        if steps == ["audit"]:
            return self._read_log({name: values[0] for name, values in parse_qs(address.query).items()})
        reads = {
            "session": self.sign_in,
            "users": {"users": self.users},
            "sessions": {"sessions": self.sessions},
        }
        reads["service_tokens"] = {"tokens": self.tokens}
        if method == "GET":
            return (200, reads[steps[0]]) if steps[0] in reads else None
        if steps[0] == "users":
            return self._user(method, steps[1:], body, query=address.query)
        orders = {"sessions": self._session, "service_tokens": self._token}
        return orders[steps[0]](method, steps[1:], body) if steps[0] in orders else None

    def _user(self, method: str, steps: list[str], body: Json, *, query: str) -> Answer:
        if not steps:
            return self._add_user(body)
        found = next(each for each in self.users if each["name"] == steps[0])
        if steps[1:] == ["invitation"]:
            return 200, self._invitation()
        admins = [each for each in self.users if each["role"] == "admin" and each["state"] == "active"]
        if admins == [found] and (
            method == "DELETE" or body.get("role", "admin") != "admin" or body.get("disabled")
        ):
            detail = f"{found['name']} is the last admin"
            return 409, problem(409, "The last admin", detail, "make somebody else one first")
        if method == "DELETE":
            return 200, self._remove_user(found, keep="tokens=keep" in query)
        found |= {"role": body.get("role", found["role"])}
        if "disabled" in body:
            found["state"] = "disabled" if body["disabled"] else "active"
        return 200, found

    def _remove_user(self, found: Json, *, keep: bool) -> Json:
        self.users.remove(found)
        theirs = [each for each in self.tokens if each["owner"] == found["name"]]
        for each in theirs:
            each["owner"] = self.sign_in["name"]
        if not keep:
            self.tokens = [each for each in self.tokens if each not in theirs]
        return {"tokens_revoked": [] if keep else theirs, "tokens_kept": theirs if keep else []}

    def _add_user(self, body: Json) -> Answer:
        if any(each["name"] == body["name"] for each in self.users):
            detail = f"the name {body['name']} is taken"
            return 409, problem(409, "The name is taken", detail, "choose another one")
        invited = "password" not in body
        made = user(body["name"], body["role"], state="invited" if invited else "active", last_seen_utc=None)
        if self.sign_in["mode"] != "users":
            self.sign(body["name"], body["role"])
        else:
            self.users.append(made)
        return 201, {"user": made, "invitation": self._invitation() if invited else None}

    def _invitation(self) -> Json:
        self.made += 1
        return {"path": f"/join?code=invitation-{self.made}", "expires_utc": utc(ago_s=-48 * 3600.0)}

    def _session(self, method: str, steps: list[str], body: Json) -> Answer:
        self.sessions = [each for each in self.sessions if each["id"] != steps[0]]
        return 204, None

    def _token(self, method: str, steps: list[str], body: Json) -> Answer:
        if method == "DELETE":
            self.tokens = [each for each in self.tokens if each["id"] != steps[0]]
            return 204, None
        self.made += 1
        days = body["days"]
        document = {
            "id": f"token-{self.made}",
            "name": body["name"],
            "prefix": SECRET[:8],
            "scopes": body["scopes"],
        }
        name = self.sign_in["name"]
        document |= {"created_by": name, "owner": name, "created_utc": utc(), "last_used_utc": None}
        document["expires_utc"] = None if days is None else utc(ago_s=-86_400.0 * days)
        self.tokens.append(document)
        return 201, {"token": SECRET, "document": document}

    def _read_log(self, query: dict[str, str]) -> Answer:
        found = [
            each
            for each in sorted(self.log, key=lambda each: each["id"], reverse=True)
            if query.get("text", "") in each["what"] + each["path"] + each["detail"]
            and query.get("who", each["who"]) == each["who"]
            and query.get("outcome", each["outcome"]) == each["outcome"]
            and each["id"] < int(query.get("before", 10**9))
        ]
        part = found[:LOG_PART]
        return 200, {"entries": part, "next_before": part[-1]["id"] if len(found) > len(part) else None}


def problem(status: int, title: str, detail: str, remedy: str | None = None, *, slug: str = "test") -> Json:
    """Return a problem document."""
    document = {"type": f"/problems/{slug}", "title": title, "status": status, "detail": detail}
    return document if remedy is None else document | {"remedy": remedy}
