"""The notes of a recording in a file beside it: id, label, why it ended; a recording is readable without."""

import hashlib
import logging
from pathlib import Path

from pydantic import ConfigDict, Field

from foveacam_pipeline.capture.recording.bounds import EndCause
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.capturing.recordings.schema import StreamCounts

_log = logging.getLogger(__name__)

FORM, VERSION = "foveacam recording notes", 1
NOTES, LAYOUT = ".json", ".ui.json"


class RecordingNotes(ResponseModel):
    """`ended`: what ended it; `why`: in words, when that was unintended. `statistics`: of every stream."""

    model_config = ConfigDict(frozen=True)

    id: str
    label: str = ""
    created_utc: str = Field(default_factory=utc_now)
    ended: EndCause | None = None
    why: str = ""
    statistics: dict[str, StreamCounts] = Field(default={})


def notes_path(recording: Path) -> Path:
    """Return the path of a recording's notes."""
    return recording.with_name(recording.name + NOTES)


def layout_path(recording: Path) -> Path:
    """Return the path of the player's arrangement of a recording, where the authors' viewer has its own."""
    return recording.with_name(recording.name + LAYOUT)


def write_notes(recording: Path, notes: RecordingNotes) -> None:
    """Write a recording's notes; raise as `write_document`."""
    document = {"format": FORM, "version": VERSION, **notes.model_dump(mode="json")}
    write_document(notes_path(recording), document, what=f"the notes of recording {recording.stem}")


def read_notes(recording: Path) -> RecordingNotes | None:
    """Return the notes of a recording; None without readable ones."""
    try:
        return read_document(notes_path(recording), RecordingNotes, form=FORM, version=VERSION)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        _log.warning("%s: its notes cannot be read: %s", recording, error)
        return None


def id_without_notes(recording: Path) -> str:
    """Return the id of a recording without notes, derived from its file's name."""
    return "rec-" + hashlib.blake2s(recording.name.encode(), digest_size=5).hexdigest()
