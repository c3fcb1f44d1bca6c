"""Routes of events: a live stream (SSE) that continues after a client's last id, and the newest as JSON."""

import json
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import Header
from fastapi.responses import StreamingResponse
from sse_starlette import EventSourceResponse, ServerSentEvent

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import EVENT_STREAM, Limit
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.schema import EventDocument

router = GuardedRouter("/events", tags=["events"], reading=Right.VIEW, changing=Right.OPERATE)


PING_S = 10
LAST_ID_LIMIT = 2**62

LastEventId = Annotated[
    int | None, Header(alias="Last-Event-ID", ge=0, le=LAST_ID_LIMIT, description="replay what followed")
]

_SENT = {
    "type": "object",
    "properties": {
        "id": {"type": "string"},
        "event": {"type": "string"},
        "data": {
            "type": "string",
            "contentMediaType": "application/json",
            "contentSchema": {"$ref": "#/components/schemas/EventDocument"},
        },
    },
}


@router.get(
    "",
    summary="Live events",
    response_class=StreamingResponse,
    responses={
        200: {
            "content": {"text/event-stream": {"schema": _SENT}},
            "description": "events without end; the schema is that of each",
        }
    },
    dependencies=[EVENT_STREAM],
)
async def stream(events: Provided[EventLog], last_event_id: LastEventId = None) -> EventSourceResponse:
    """Stream events as they come; with `Last-Event-ID`, first those after it."""
    return EventSourceResponse(_sent(events, last_event_id), ping=PING_S, sep="\n")


@router.get("/recent", summary="The newest events, oldest first")
async def recent(events: Provided[EventLog], limit: Limit = 50) -> list[EventDocument]:
    """Return the newest events."""
    return [event.describe() for event in events.recent(limit)]


async def _sent(events: EventLog, last_id: int | None) -> AsyncIterator[ServerSentEvent]:
    async for event in events.listen(last_id):
        yield ServerSentEvent(json.dumps(event.describe().as_json()), id=str(event.id), event=event.kind)
