"""Serves the 3D pane at the server's own origin: its page, and a relay of its WebSocket to a Unix socket.

viser has no access control; the security middleware checks each request before it comes here.
"""

import asyncio
import logging
from typing import Annotated, Literal

from fastapi import Query, WebSocket, WebSocketDisconnect
from fastapi.responses import RedirectResponse, Response
from websockets.asyncio.client import ClientConnection, unix_connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from foveacam_hardware.contract import NotConnected
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.console.page_policy import viser_policy
from foveacam_server.foundation.errors import AllTaken, PersonLimit
from foveacam_server.foundation.http.answers import server_places
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.persons.person_quota import PERSON, close_of
from foveacam_server.rig.ports import SceneViewer
from foveacam_web.viser_page import viser_page, viser_subprotocol

router = GuardedRouter(include_in_schema=False, reading=Right.VIEW, changing=Right.ADMINISTER)
_log = logging.getLogger(__name__)

_MAX_QUEUE = 2
"""Length of the queue of messages: short, so that a slow browser's backpressure reaches viser, which then
merges updates."""
_OPEN_TIMEOUT_S = 5.0
_GOING_AWAY, _TRY_AGAIN_LATER, _PROTOCOL_ERROR = 1001, 1013, 1002
_CLOSE_REASON_LENGTH = 120


EmbeddedQuery = Annotated[Literal["0", "1"], Query(description="1: without the docked camera views")]


@router.get("/viser")
async def redirect_to_page() -> RedirectResponse:
    """Redirect to the page's own folder, from which the page derives the WebSocket's URL."""
    return RedirectResponse("/viser/", status_code=308)


@router.get("/viser/")
async def page(viewer: Provided[SceneViewer | None], embedded: EmbeddedQuery = "0") -> Response:
    """Return viser's page; not cached, because page and server must have the same version."""
    if viewer is None:
        raise NotConnected(
            "the 3D pane is switched off or could not be started; the console works without it",
            found="no 3D pane",
            remedy="start the server with the viewer on; the log says why it did not start",
        )
    bare = embedded == "1"
    headers = {"Cache-Control": "no-store", "Content-Security-Policy": viser_policy(bare=bare)}
    return Response(viser_page(bare=bare), media_type="text/html; charset=utf-8", headers=headers)


@router.websocket("/viser")
@router.websocket("/viser/")
@needs(Right.VIEW)
async def relay(websocket: WebSocket, viewer: Provided[SceneViewer | None]) -> None:
    """Relay messages between one viewer and viser until either side closes."""
    wanted = viser_subprotocol()
    if wanted not in websocket.scope.get("subprotocols", []):
        await websocket.accept()
        await websocket.close(_PROTOCOL_ERROR, "this page is of another viser version; reload it")
        return
    await websocket.accept(subprotocol=wanted)
    if viewer is None:
        await websocket.close(_TRY_AGAIN_LATER, "the 3D pane is not running")
        return
    places = await server_places(websocket)
    try:
        with places.scene_viewers.hold(PERSON.get()):
            await _relay(websocket, viewer, protocol=wanted)
    except (AllTaken, PersonLimit) as refusal:
        await _close(websocket, *close_of(refusal))
    except (OSError, TimeoutError, WebSocketException) as error:
        _log.warning("the 3D pane does not answer: %s", error)
        await _close(websocket, _TRY_AGAIN_LATER, "the 3D pane does not answer")


async def _relay(websocket: WebSocket, viewer: SceneViewer, *, protocol: str) -> None:
    async with unix_connect(
        str(viewer.socket_path),
        "ws://viser/",
        subprotocols=[Subprotocol(protocol)],
        compression=None,
        max_size=None,
        max_queue=_MAX_QUEUE,
        open_timeout=_OPEN_TIMEOUT_S,
    ) as upstream:
        await _pump(websocket, upstream)


async def _pump(websocket: WebSocket, upstream: ClientConnection) -> None:
    """Relay messages in both directions; when one side closes, close the other and return."""
    tasks = [
        asyncio.create_task(_to_viser(websocket, upstream)),
        asyncio.create_task(_to_browser(websocket, upstream)),
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        ends = await asyncio.gather(*tasks, return_exceptions=True)
    for end in ends:
        if isinstance(end, Exception) and not isinstance(end, (ConnectionClosed, WebSocketDisconnect)):
            raise end
    if isinstance(ends[1], ConnectionClosed):
        code, reason = _GOING_AWAY, "the 3D pane closed"
        if upstream.close_code == _PROTOCOL_ERROR:
            code, reason = _PROTOCOL_ERROR, upstream.close_reason or reason
        await _close(websocket, code, reason)


async def _to_viser(websocket: WebSocket, upstream: ClientConnection) -> None:
    while True:
        message = await websocket.receive()
        data = message.get("bytes")
        if data is None:  # closed, or a text, which viser's client never sends
            raise WebSocketDisconnect(message.get("code", _PROTOCOL_ERROR))
        await upstream.send(data)


async def _to_browser(websocket: WebSocket, upstream: ClientConnection) -> None:
    while True:
        message = await upstream.recv()
        if isinstance(message, str):
            await websocket.send_text(message)
        else:
            await websocket.send_bytes(message)


async def _close(websocket: WebSocket, code: int, reason: str) -> None:
    try:
        await websocket.close(code, reason[:_CLOSE_REASON_LENGTH])
    except (RuntimeError, WebSocketDisconnect):
        return  # the browser has closed it already
