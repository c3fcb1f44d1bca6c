"""The player's arrangement of a recording, kept in a file beside it."""

import hashlib
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.recordings.collection import StoredRecording
from foveacam_server.resources.recordings.layout_schema import LayoutDocument, LayoutRequest, PlayerLayout
from foveacam_server.resources.recordings.notes import layout_path

FORM, VERSION = "foveacam player layout", 1


class _LayoutFile(BaseModel):
    """`recording`: digest of what the recording holds, so that a layout is not used for another one."""

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
    """Keep an arrangement; raise `InvalidInput` for one that would overwrite a file that is not its own."""
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
