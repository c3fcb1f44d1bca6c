"""The notes of a recording in a file beside it: id, label, why it ended; it is readable without."""

import hashlib
import logging
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from foveacam_pipeline.capture.recording.bounds import EndCause
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.whole_file import read_document, write_document

_log = logging.getLogger(__name__)

FORM, VERSION = "foveacam recording notes", 1
NOTES = ".json"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingNotes:
    """`ended`: what ended it; `why`: in words, when that was unintended. `statistics`: of every stream."""

    id: str
    label: str = ""
    created_utc: str = field(default_factory=utc_now)
    ended: EndCause | None = None
    why: str = ""
    statistics: dict[str, dict[str, Any]] = field(default_factory=dict)


def notes_path(recording: Path) -> Path:
    """Return the path of a recording's notes."""
    return recording.with_name(recording.name + NOTES)


def write_notes(recording: Path, notes: RecordingNotes) -> None:
    """Write a recording's notes; raise as `write_document`."""
    document = {"format": FORM, "version": VERSION, **asdict(notes)}
    write_document(notes_path(recording), document, what=f"the notes of recording {recording.stem}")


def read_notes(recording: Path) -> RecordingNotes | None:
    """Return the notes of a recording; None without readable ones."""
    try:
        found = read_document(notes_path(recording), form=FORM, version=VERSION)
        ended = found.pop("ended", None)
        return RecordingNotes(**found, ended=None if ended is None else EndCause(ended))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError) as error:
        _log.warning("%s: its notes cannot be read: %s", recording, error)
        return None


def id_without_notes(recording: Path) -> str:
    """Return the id of a recording without notes, derived from its file's name."""
    return "rec-" + hashlib.blake2s(recording.name.encode(), digest_size=5).hexdigest()
