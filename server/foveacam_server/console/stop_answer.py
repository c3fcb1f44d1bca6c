"""Answers `POST /api/v1/stop` without the event loop, with the access rules of every other request."""

from http import HTTPStatus

import h11
from fastapi.responses import JSONResponse
from starlette.datastructures import Headers
from starlette.types import Scope

from foveacam_hardware.contract import InvalidInput
from foveacam_server.accounts.rights import who_at
from foveacam_server.console.access_rules import AccessRules
from foveacam_server.console.refusals import Refusal
from foveacam_server.console.security import put_security_headers
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.watching.work_ids import REQUEST_HEADER, begin_request, request_header
from foveacam_server.rig.stop import StopSwitch

STOP_PATH = "/api/v1/stop"


class StopAtDoor:
    """Answers `POST /api/v1/stop` like the route, with the same access rules, on a thread for stops."""

    def __init__(self, stop: StopSwitch, *, gate: AccessRules) -> None:
        self._stop = stop
        self._gate = gate

    def __call__(self, request: bytes, peer: str) -> bytes:
        """Engage the stop and return the HTTP response to a complete request; `peer`: client's address."""
        begin_request(None)  # a new id, not that of the thread's last stop
        connection = h11.Connection(h11.SERVER)
        connection.receive_data(request)
        try:
            event = connection.next_event()
        except h11.RemoteProtocolError as error:
            return _response_bytes(connection, _unreadable(str(error)))
        if not isinstance(event, h11.Request):
            return _response_bytes(connection, _unreadable("its headers do not end"))
        return _response_bytes(connection, self._answer(event, peer))

    def _answer(self, request: h11.Request, peer: str) -> JSONResponse:
        headers = [(name.lower(), value) for name, value in request.headers]
        scope: Scope = {"type": "http", "scheme": "http", "method": "POST", "path": STOP_PATH}
        scope.update(headers=headers, client=(peer, 0))
        begin_request(Headers(raw=headers).get(REQUEST_HEADER))
        found = self._gate.check(scope)
        answer = self._refused(found) if isinstance(found, Refusal) else self._engaged(who_at(found, peer))
        self._gate.audit(found, scope, status=answer.status_code)
        return answer

    def _refused(self, refusal: Refusal) -> JSONResponse:
        return refusal.problem.response(instance=STOP_PATH)

    def _engaged(self, who: str) -> JSONResponse:
        try:
            return JSONResponse(self._stop.engage(who).as_json())
        except Exception as error:  # noqa: BLE001 - the outermost frame of a request: it is answered
            return problem_of(error).response(instance=STOP_PATH)


def _unreadable(why: str) -> JSONResponse:
    error = InvalidInput(
        f"the request cannot be read: {why}", found=why, remedy="send POST /api/v1/stop as HTTP/1.1"
    )
    return problem_of(error).response(instance=STOP_PATH)


def _response_bytes(connection: h11.Connection, response: JSONResponse) -> bytes:
    put_security_headers(response.headers)
    response.headers.update(request_header())
    head = h11.Response(
        status_code=response.status_code,
        reason=HTTPStatus(response.status_code).phrase.encode(),
        headers=[*response.raw_headers, (b"connection", b"close")],
    )
    parts = [connection.send(head), connection.send(h11.Data(data=bytes(response.body)))]
    return b"".join(part or b"" for part in [*parts, connection.send(h11.EndOfMessage())])
