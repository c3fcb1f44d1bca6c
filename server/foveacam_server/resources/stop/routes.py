"""The stop as routes, and as HTTP without the event loop; it needs no lease, no queue and no database."""

import asyncio
from http import HTTPStatus

import h11
from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse
from starlette.types import Scope

from foveacam_hardware.contract import InvalidInput
from foveacam_server.assembly.services import ServicesDep
from foveacam_server.console.security import AccessRules, put_security_headers
from foveacam_server.foundation.errors import problem_of
from foveacam_server.rig.schema import StopAnswer, StopDocument
from foveacam_server.rig.stop import StopSwitch

router = APIRouter(prefix="/stop", tags=["stop"])
PATH = "/api/v1/stop"


@router.get("", summary="Is the stop engaged?")
async def state(services: ServicesDep) -> StopDocument:
    """Return whether the stop is engaged, since when and by whom."""
    return services.stop.state


@router.post("", summary="Stop: park the mirrors now")
async def engage(request: Request, services: ServicesDep) -> StopAnswer:
    """Park the mirrors, cancel every job, and refuse all moves until released.

    Answered when the mirrors' controller has confirmed, or its driver has given up.
    """
    return await asyncio.wrap_future(services.stopping.submit(services.stop.engage, _who(request)))


@router.delete("", summary="Release the stop")
async def release(request: Request, services: ServicesDep) -> StopDocument:
    """Allow moves again."""
    return services.stop.release(_who(request))


def _who(request: Request) -> str:
    return request.client.host if request.client is not None else "unknown"


class StopAtDoor:
    """Answers `POST /api/v1/stop` like the route, with the same access rules, on a thread for stops."""

    def __init__(self, stop: StopSwitch, *, gate: AccessRules) -> None:
        self._stop = stop
        self._gate = gate

    def __call__(self, request: bytes, peer: str) -> bytes:
        """Engage the stop and return the HTTP response to a complete request; `peer`: client's address."""
        connection = h11.Connection(h11.SERVER)
        connection.receive_data(request)
        try:
            asked = connection.next_event()
        except h11.RemoteProtocolError as error:
            return _sent(connection, _unreadable(str(error)))
        if not isinstance(asked, h11.Request):
            return _sent(connection, _unreadable("its headers do not end"))
        return _sent(connection, self._answer(asked, peer))

    def _answer(self, asked: h11.Request, peer: str) -> JSONResponse:
        headers = [(name.lower(), value) for name, value in asked.headers]
        scope: Scope = {"type": "http", "scheme": "http", "method": "POST", "path": PATH, "headers": headers}
        scope["client"] = (peer, 0)
        refusal = self._gate.check(scope)
        if refusal is not None:
            return refusal.problem.response(instance=PATH)
        try:
            return JSONResponse(self._stop.engage(peer).as_json())
        except Exception as error:  # noqa: BLE001 - the outermost frame of a request: it is answered
            return problem_of(error).response(instance=PATH)


def _unreadable(why: str) -> JSONResponse:
    error = InvalidInput(
        f"the request cannot be read: {why}", found=why, remedy="send POST /api/v1/stop as HTTP/1.1"
    )
    return problem_of(error).response(instance=PATH)


def _sent(connection: h11.Connection, response: JSONResponse) -> bytes:
    put_security_headers(response.headers, path=PATH)
    head = h11.Response(
        status_code=response.status_code,
        reason=HTTPStatus(response.status_code).phrase.encode(),
        headers=[*response.raw_headers, (b"connection", b"close")],
    )
    parts = [connection.send(head), connection.send(h11.Data(data=bytes(response.body)))]
    return b"".join(part or b"" for part in [*parts, connection.send(h11.EndOfMessage())])
