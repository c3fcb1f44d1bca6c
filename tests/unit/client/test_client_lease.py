"""A lease that the client holds for a block; the server is a function in this process."""

import asyncio
import threading

import httpx
import pytest

from foveacam_client import AsyncRig, Connection, LeaseLost, RetryPolicy, Rig, RigBusy

TAKEN_OVER = "asked to keep the lease: otto holds the control lease"
ONCE = RetryPolicy(attempts=1)


def busy(detail: str) -> httpx.Response:
    document = {"type": "/problems/busy", "title": "Busy", "status": 409, "detail": detail}
    return httpx.Response(409, json=document)


class LeaseServer:
    """Grants a lease of 30 ms; `renewals`: answers to those that follow, in their order, the last again."""

    def __init__(self, *renewals: httpx.Response | Exception) -> None:
        self._renewals = list(renewals)
        self.requests: list[tuple[str, str | None]] = []
        self.renewed = threading.Event()

    def __call__(self, request: httpx.Request) -> httpx.Response:
        if request.url.path != "/api/v1/lease":
            self.requests.append((request.url.path, request.headers.get("X-Lease")))
            return busy("captures") if request.method == "POST" else httpx.Response(200, json=[])
        self.requests.append((request.method, request.headers.get("X-Lease")))
        granted = httpx.Response(200, json={"token": "t-1", "holder": "me", "expires_in_s": 0.03})
        if request.method == "PUT":
            self.renewed.set()
            answer = self._renewals.pop(0) if len(self._renewals) > 1 else (self._renewals or [granted])[0]
            if isinstance(answer, Exception):
                raise answer
            return answer
        return granted if request.method == "POST" else httpx.Response(204)

    @property
    def rig(self) -> Rig:
        return Rig(Connection(retries=ONCE), http_transport=httpx.MockTransport(self))


def ask_until_lost(rig: Rig) -> None:
    while True:
        rig.api.captures.list()


def test_a_lease_is_renewed_and_sent_during_the_block_and_given_back() -> None:
    server = LeaseServer()
    rig = server.rig

    with rig.hold_lease("me"):
        assert server.renewed.wait(10.0)
        rig.api.captures.list()
    rig.api.captures.list()

    assert server.requests[0] == ("POST", None)
    assert ("PUT", "t-1") in server.requests
    assert ("/api/v1/captures", "t-1") in server.requests
    assert server.requests[-2:] == [("DELETE", "t-1"), ("/api/v1/captures", None)]


@pytest.mark.parametrize(
    ("failure", "why"), [(busy(TAKEN_OVER), TAKEN_OVER), (httpx.ConnectError("refused"), "no server answers")]
)
def test_a_lost_lease_ends_the_blocks_calls_and_the_block(
    failure: httpx.Response | Exception, why: str
) -> None:
    server = LeaseServer(failure)
    rig = server.rig

    with pytest.raises(LeaseLost, match=why), rig.hold_lease("me"), pytest.raises(LeaseLost, match=why):
        ask_until_lost(rig)

    assert rig.api.captures.list() == []
    assert "DELETE" not in [word for word, _ in server.requests]


def test_one_renewal_that_fails_loses_nothing() -> None:
    granted = httpx.Response(200, json={"token": "t-1", "holder": "me", "expires_in_s": 60.0})
    server = LeaseServer(granted, httpx.ReadError("gone"), granted)

    with server.rig.hold_lease("me"):
        while [word for word, _ in server.requests].count("PUT") < 3:
            server.renewed.wait(10.0)
            server.renewed.clear()

    assert server.requests[-1] == ("DELETE", "t-1")


def test_a_move_that_is_refused_since_the_lease_is_lost_says_so() -> None:
    server = LeaseServer()

    def refuse(request: httpx.Request) -> httpx.Response:
        return busy(TAKEN_OVER) if request.method == "DELETE" else server(request)

    rig = Rig(Connection(retries=ONCE), http_transport=httpx.MockTransport(refuse))

    with pytest.raises(LeaseLost, match=TAKEN_OVER), rig.hold_lease("me"):
        rig.api.mirrors.park()


def test_a_rig_that_is_busy_for_another_reason_stays_so_and_the_lease_is_given_back() -> None:
    server = LeaseServer()

    with pytest.raises(RigBusy, match="captures"), server.rig.hold_lease("me"):
        server.rig.api.mirrors.park()

    assert server.requests[-1] == ("DELETE", "t-1")


def test_the_asynchronous_client_holds_and_loses_it_in_the_same_way() -> None:
    granted = httpx.Response(200, json={"token": "t-1", "holder": "me", "expires_in_s": 0.03})
    server = LeaseServer(granted, busy(TAKEN_OVER))

    async def hold() -> None:
        connection, transport = Connection(retries=ONCE), httpx.MockTransport(server)
        async with AsyncRig(connection, http_transport=transport) as rig, rig.hold_lease("me"):
            while True:
                await rig.api.captures.list()
                await asyncio.sleep(0.0)

    with pytest.raises(LeaseLost, match=TAKEN_OVER):
        asyncio.run(hold())
