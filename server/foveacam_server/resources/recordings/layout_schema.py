"""Schemas of the player's arrangement of a recording."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.foundation.quantities import Seconds
from foveacam_server.foundation.schema import RequestModel, ResponseModel

AnaglyphName = Literal["red_cyan", "red_blue", "cyan_red", "blue_red"]
StereoMode = Literal["off", "left", "right", "anaglyph", "difference"]
Name = Annotated[str, Field(max_length=300)]


class TrackLayout(RequestModel):
    """One track of the timeline, in its place; one that is off is not shown in a pane."""

    name: Name
    on: bool


class PlayerLayout(RequestModel):
    """How the player shows a recording. `panes`: as in the address of a window of views.

    `from_s`, `to_s`: the part of the recording that the timeline shows.
    """

    tracks: Annotated[list[TrackLayout], Field(max_length=200)]
    panes: Annotated[str, Field(max_length=1000)]
    stereo: StereoMode
    style: AnaglyphName
    boxes: bool
    footprints: bool
    depth: bool
    speed: Annotated[float, Field(ge=0.1, le=16.0)]
    from_s: Seconds
    to_s: Seconds


class LayoutRequest(RequestModel):
    """An arrangement to keep; `replace`: also over one that cannot be used."""

    layout: PlayerLayout
    replace: bool = False


class LayoutDocument(ResponseModel):
    """The arrangement that is kept. `state`: `none`, `kept`, or why it cannot be used; `why`: in words."""

    state: Literal["none", "kept", "unreadable", "of another recording"]
    why: str
    layout: PlayerLayout | None
