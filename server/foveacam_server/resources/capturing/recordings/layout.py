"""The player's arrangement of a recording, kept in a file beside it."""

import hashlib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.quantities import Seconds
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.capturing.recordings.collection import StoredRecording
from foveacam_server.resources.capturing.recordings.notes import layout_path

FORM, VERSION = "foveacam player layout", 1
AnaglyphName = Literal["red_cyan", "red_blue", "cyan_red", "blue_red"]
StereoMode = Literal["off", "left", "right", "anaglyph", "difference"]
Name = Annotated[str, Field(max_length=300)]


class TrackLayout(RequestModel):
    """One track of the timeline, in order; a track that is off has no pane."""

    name: Name
    on: bool


class PlayerLayout(RequestModel):
    """Arrangement of the player. `panes`: as in the address of a window of views.

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
    """An arrangement to store; `replace`: also over one that cannot be used."""

    layout: PlayerLayout
    replace: bool = False


class LayoutDocument(ResponseModel):
    """The stored arrangement. `state`: `none`, `kept`, or why it cannot be used; `why`: in words."""

    state: Literal["none", "kept", "unreadable", "of another recording"]
    why: str
    layout: PlayerLayout | None


class _LayoutFile(BaseModel):
    """`recording`: digest of the recording's content, so that a layout is not used for another one."""

    model_config = ConfigDict(extra="forbid")

    recording: str
    layout: PlayerLayout


def read_layout(stored: StoredRecording) -> LayoutDocument:
    """Return the arrangement of a recording, or why it cannot be used."""
    path = layout_path(stored.path)
    try:
        found = read_document(path, _LayoutFile, form=FORM, version=VERSION)
    except FileNotFoundError:
        return LayoutDocument(state="none", why="", layout=None)
    except (OSError, ValueError, RecursionError) as error:
        return LayoutDocument(state="unreadable", why=_unreadable(path, error), layout=None)
    if found.recording != _digest(stored):
        why = f"{path.name} belongs to another recording; keep it elsewhere, or overwrite it"
        return LayoutDocument(state="of another recording", why=why, layout=None)
    return LayoutDocument(state="kept", why="", layout=found.layout)


def write_layout(stored: StoredRecording, change: LayoutRequest) -> LayoutDocument:
    """Store an arrangement; raise `InvalidInput` for a foreign or damaged file without `replace`."""
    before = read_layout(stored)
    if before.layout is None and before.state != "none" and not change.replace:
        raise InvalidInput(
            f"layout of recording {stored.name}: {before.why}",
            asked="keep the arrangement of the player",
            found=f"a file that is {before.state}",
            remedy="send it with `replace`, or move the file",
        )
    document = {
        "format": FORM,
        "version": VERSION,
        "recording": _digest(stored),
        "layout": change.layout.as_json(),
    }
    write_document(layout_path(stored.path), document, what=f"the layout of recording {stored.name}")
    return LayoutDocument(state="kept", why="", layout=change.layout)


def _unreadable(path: Path, error: Exception) -> str:
    reason = str(error).splitlines()[0]
    return f"{path.name} cannot be read ({reason}); overwrite it, or keep it elsewhere"


def _digest(stored: StoredRecording) -> str:
    """Return a digest of a recording's time, length and streams, which moving it does not change."""
    held = stored.contents
    streams = {} if held is None else {name: facts.frames for name, facts in held.streams.items()}
    known = None if held is None else (held.recorded, round(held.duration_s, 6))
    return hashlib.blake2s(repr((known, sorted(streams.items()))).encode(), digest_size=16).hexdigest()
