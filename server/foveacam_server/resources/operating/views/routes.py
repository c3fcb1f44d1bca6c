"""Routes of views: the list, a snapshot, MJPEG for programs such as VLC, and the WebSocket of the page."""

from collections.abc import AsyncIterator
from contextlib import aclosing
from typing import Annotated, Literal

from fastapi import Query, WebSocket, WebSocketDisconnect
from fastapi.responses import Response, StreamingResponse
from pydantic import BaseModel
from starlette.types import Receive, Scope, Send

from foveacam_hardware.contract import NotConnected
from foveacam_pipeline.stereo.pictures import AnaglyphStyle
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.errors import AllTaken, NotFound, PersonLimit
from foveacam_server.foundation.http.answers import file_responses, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.persons.person_quota import PERSON, close_of
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.resources.operating.views.live_stereo import LiveStereo
from foveacam_server.rig import refusals
from foveacam_server.rig.encoder import EncodedPicture, Scale
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.stream import LiveStreams, StreamSession

router = GuardedRouter(tags=["views"], reading=Right.VIEW, changing=Right.OPERATE)

_BOUNDARY = "foveacam-frame"


class _MjpegResponse(StreamingResponse):
    """An endless multipart answer; its MJPEG seat is held from the first byte to the last."""

    def __init__(self, streams: LiveStreams, *, view: str, scale: Scale) -> None:
        super().__init__(
            self._parts(streams, view=view, scale=scale),
            media_type=f"multipart/x-mixed-replace; boundary={_BOUNDARY}",
            headers={"Cache-Control": "no-store"},
        )
        self._streams = streams

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        with self._streams.mjpeg_seats.hold(PERSON.get()):
            await super().__call__(scope, receive, send)

    @staticmethod
    async def _parts(streams: LiveStreams, *, view: str, scale: Scale) -> AsyncIterator[bytes]:
        async with aclosing(streams.pictures(view, scale)) as pictures:
            async for encoded in pictures:
                yield _part(encoded)


class ViewDocument(BaseModel):
    """One live view."""

    name: str
    width: int
    """Width of the unbinned sensor for views of cameras, px; all pixels in REST refer to it."""
    height: int
    picture_scale: int
    """Sensor pixels along each side of a pixel of the picture at full size: `width` over the picture's."""
    description: str
    rate_hz: float
    age_ms: float | None
    frozen_since_ms: float | None
    expected_hz: float | None
    """Rate at which it should come; null where none is promised: nobody watches it, or a job has the rig."""
    slow_reason: str | None
    """Why it comes at less than half of that rate; null while it does not."""


ScaleQuery = Annotated[
    Literal["1", "2", "4"], Query(description="1: full size; 2, 4: half and a quarter of it each way")
]
_SCALES: dict[str, Scale] = {"1": 1, "2": 2, "4": 4}


@router.get("/views", summary="List the live views")
async def list_views(streams: Provided[LiveStreams]) -> list[ViewDocument]:
    """Return every view with its measured rate and the age of its newest picture."""
    statuses = [streams.hub.status(name) for name in streams.hub.names]
    return [
        ViewDocument(
            name=status.spec.name,
            width=status.width,
            height=status.height,
            picture_scale=status.picture_scale,
            description=status.spec.description,
            rate_hz=round(status.rate_hz, 2),
            age_ms=status.age_ms,
            frozen_since_ms=status.frozen_since_ms,
            expected_hz=status.expected_hz,
            slow_reason=status.slow_reason,
        )
        for status in statuses
        if status.published or not status.spec.passing
    ]


class AnaglyphColours(RequestModel):
    """Colours of the anaglyph: of the left and of the right eye's glass."""

    style: Literal["red_cyan", "red_blue", "cyan_red", "blue_red"]


@router.get("/views/anaglyph/style", summary="Colours of the anaglyph")
async def anaglyph_style(stereo: Provided[LiveStereo]) -> AnaglyphColours:
    """Return the colours of the anaglyph, for all viewers."""
    return AnaglyphColours(style=stereo.style.value)


@router.put("/views/anaglyph/style", summary="Choose the colours of the anaglyph")
async def choose_anaglyph_style(request: AnaglyphColours, stereo: Provided[LiveStereo]) -> AnaglyphColours:
    """Set the colours of the anaglyph for all viewers, from the next picture on."""
    stereo.style = AnaglyphStyle(request.style)
    return request


@router.get(
    "/views/{name}/snapshot.jpg",
    summary="Newest picture of a view",
    response_class=Response,
    responses=file_responses("image/jpeg") | problems(503),
)
async def snapshot(
    name: str, streams: Provided[LiveStreams], hardware: Provided[HardwareThread], scale: ScaleQuery = "1"
) -> Response:
    """Return the newest picture of a view as JPEG; its number, capture time and scale are in the headers.

    If it is older than 1.5 s, as without viewers, the answer waits up to a second for the next one.
    """
    encoded = await streams.snapshot(_known(streams, name), _SCALES[scale])
    if encoded is None and not hardware.status.opened:
        raise refusals.not_open(hardware.status)
    if encoded is None:
        raise NotConnected(
            f"view '{name}' has no picture yet: it comes with the first frame, or, for computed views, with "
            "the first fixation or calibration",
            asked=f"a snapshot of '{name}'",
            found="no picture yet",
            remedy="wait for the camera, foveate something, or calibrate",
        )
    headers = {
        "Cache-Control": "no-store",
        "X-Frame-Seq": str(encoded.picture.seq),
        "X-Frame-Time-Ns": str(encoded.picture.t_ns),
        "X-Picture-Scale": str(encoded.scale),
    }
    return Response(encoded.jpeg, media_type="image/jpeg", headers=headers)


@router.get(
    "/views/{name}/stream.mjpeg",
    summary="Live view as MJPEG, for curl and VLC",
    response_class=StreamingResponse,
    responses={
        200: {"content": {"multipart/x-mixed-replace": {"schema": {"type": "string"}}}},
        **problems(404),
    },
)
async def stream_mjpeg(
    name: str, streams: Provided[LiveStreams], scale: ScaleQuery = "1"
) -> StreamingResponse:
    """Stream a view endlessly; at most two per person; the delay of a slow client grows without bound."""
    return _MjpegResponse(streams, view=_known(streams, name), scale=_SCALES[scale])


@router.websocket("/views/ws")
@needs(Right.VIEW)
async def views_socket(websocket: WebSocket, streams: Provided[LiveStreams]) -> None:
    """Serve all views to one page: one credit a view, newest picture wins."""
    await websocket.accept()
    try:
        with streams.seats.hold(PERSON.get()):
            await StreamSession(streams, websocket).run()
    except (AllTaken, PersonLimit) as refusal:
        await websocket.close(*close_of(refusal))
    except WebSocketDisconnect:
        return  # the client has left


def _known(streams: LiveStreams, name: str) -> str:
    if name not in streams.hub.names:
        raise NotFound(
            f"there is no view '{name}'",
            asked=f"view '{name}'",
            remedy=f"use one of {', '.join(streams.hub.names)}",
        )
    return name


def _part(encoded: EncodedPicture) -> bytes:
    head = (
        f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(encoded.jpeg)}\r\n"
        f"X-Frame-Seq: {encoded.picture.seq}\r\nX-Frame-Time-Ns: {encoded.picture.t_ns}\r\n"
        f"X-Picture-Scale: {encoded.scale}\r\n\r\n"
    )
    return head.encode() + encoded.jpeg + b"\r\n"
