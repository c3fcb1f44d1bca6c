"""Messages of the views' WebSocket: parses the client's, builds the server's."""

import json
import struct
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_server.rig.encoder import EncodedPicture, Scale
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.view_state import ViewPicture

HEADER = struct.Struct("<BBHIQIB3x")
"""View index, scale, flags, seq, capture time us, age us when sent, binning of the camera (1 of a computed
picture), 3 bytes reserved: 24 bytes, little endian."""
FLAG_FROZEN = 1
MAX_MESSAGE_LENGTH = 4096
U32 = 0xFFFF_FFFF


class _Message(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class ViewChoice(_Message):
    """The size of a subscribed view."""

    scale: Scale = 1


class Subscribe(_Message):
    """Replace the whole subscription."""

    type: Literal["subscribe"]
    views: dict[str, ViewChoice]


class Ack(_Message):
    """Acknowledges that a picture was drawn: the next one may be sent."""

    type: Literal["ack"]
    view: int = Field(ge=0, le=255)
    seq: int = Field(ge=0, le=U32)


_FROM_CLIENT: TypeAdapter[Subscribe | Ack] = TypeAdapter(
    Annotated[Subscribe | Ack, Field(discriminator="type")]
)


def parse(text: str) -> Subscribe | Ack:
    """Parse a client's message; raise `InvalidInput` when it cannot be used."""
    if len(text) > MAX_MESSAGE_LENGTH:
        raise InvalidInput(f"a message has at most {MAX_MESSAGE_LENGTH} characters, found {len(text)}")
    try:
        return _FROM_CLIENT.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"]) or "message"
        raise InvalidInput(
            f"{place}: {first['msg']}; send "
            '{"type":"subscribe","views":{"wide":{"scale":1}}} or {"type":"ack","view":0,"seq":1}'
        ) from error


def wire_seq(seq: int) -> int:
    """Return a picture's sequence number on the wire: modulo 2^32."""
    return seq & U32


def hello(hub: FrameHub, *, boot_id: str) -> str:
    """Return the server's first message: the views by index, and the server's identity."""
    statuses = [hub.status(name) for name in hub.names]
    views = [
        {"index": index, "name": status.spec.name, "width": status.width, "height": status.height}
        for index, status in enumerate(statuses)
    ]
    return json.dumps({"type": "hello", "views": views, "server": boot_id})


def overlay(picture: ViewPicture) -> str | None:
    """Return the overlay of `picture`; None when it has none."""
    if picture.meta is None:
        return None
    return json.dumps({"type": "overlay", "seq": wire_seq(picture.seq), **picture.meta.as_json()})


def stats(hub: FrameHub) -> str:
    """Return the statistics of every view: rate, age, how long frozen, whether slow."""
    views = {}
    for name in hub.names:
        status = hub.status(name)
        views[name] = {
            "rate_hz": round(status.rate_hz, 2),
            "age_ms": _rounded(status.age_ms),
            "frozen_since_ms": _rounded(status.frozen_since_ms),
            "expected_hz": _rounded(status.expected_hz),
            "slow_reason": status.slow_reason,
        }
    return json.dumps({"type": "stats", "views": views})


def problem(detail: str) -> str:
    """Return the answer to a message that could not be used."""
    return json.dumps({"type": "problem", "detail": detail})


def frame(encoded: EncodedPicture, hub: FrameHub) -> bytes:
    """Return a picture as a binary message: header, then JPEG."""
    picture = encoded.picture
    age_us = max(hub.clock.now_ns() - picture.t_ns, 0) // 1000
    frozen = hub.status(picture.view).frozen_since_ms is not None
    header = HEADER.pack(
        hub.index(picture.view),
        encoded.scale,
        FLAG_FROZEN if frozen else 0,
        wire_seq(picture.seq),
        max(picture.t_ns, 0) // 1000,
        min(age_us, U32),
        picture.binning,
    )
    return header + encoded.jpeg


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 1)


FrameSeq = Annotated[int, Field(ge=0, le=U32)]
"""Sequence number of a picture in the views' WebSocket."""
