"""Films of recordings: made by a job, kept beside them until the trash is emptied."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.recording.movie import (
    SUFFIX,
    UNFINISHED,
    MovieLayout,
    MovieSpec,
    Progress,
    export_movie,
)
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.errors import NotFound
from foveacam_server.recording_command.export import quiet_encoders
from foveacam_server.recordings.documents import URL
from foveacam_server.recordings.moments import stream_of
from foveacam_server.recordings.recording_collection import FILMS, RecordingCollection, StoredRecording
from foveacam_server.runtime.store import Document

LAYOUTS = {layout.value for layout in MovieLayout}


@dataclass(frozen=True, slots=True, kw_only=True)
class FilmSpec:
    """What is asked: a role, side-by-side or anaglyph; a part of the recording, seconds from its begin."""

    show: str
    fps: float | None = None
    start_s: float = 0.0
    end_s: float | None = None

    @property
    def name(self) -> str:
        """Name of its file: the same wish has the same one."""
        told = f"{self.show} {self.fps} {self.start_s} {self.end_s}"
        return f"{self.show}-{hashlib.blake2s(told.encode(), digest_size=4).hexdigest()}{SUFFIX}"


def check_film(recording: Recording, wish: FilmSpec) -> None:
    """Raise InvalidInput for a film that the recording cannot give, before a job is queued."""
    for role in (Role.LEFT, Role.RIGHT) if wish.show in LAYOUTS else (Role(wish.show),):
        stream_of(recording, role)
    if wish.end_s is not None and wish.end_s <= wish.start_s:
        raise InvalidInput(
            f"film: it would begin at {wish.start_s:g} s and end at {wish.end_s:g} s; give a later end"
        )


def make_film(
    shelf: RecordingCollection, kept: StoredRecording, wish: FilmSpec, *, progress: Progress
) -> Path:
    """Make a film, unless there is one already, and return its file."""
    folder = shelf.films(kept.id)
    target = folder / wish.name
    if target.exists():
        return target
    quiet_encoders()
    with disk_errors(f"a film of recording {kept.name}", shelf.folder):
        folder.mkdir(parents=True, exist_ok=True)
        with Recording(kept.path) as recording:
            show = wish.show if wish.show in LAYOUTS else stream_of(recording, Role(wish.show)).name
            asked = MovieSpec(show=show, fps=wish.fps, start_s=wish.start_s, end_s=wish.end_s)
            export_movie(recording, asked, target, progress=progress)
    return target


def clear_unfinished(shelf: RecordingCollection) -> None:
    """Remove the films that a killed server left unfinished; only while no film is made."""
    for left in (shelf.folder / FILMS).glob(f"*/{UNFINISHED}"):
        left.unlink(missing_ok=True)


def film_file(shelf: RecordingCollection, kept: StoredRecording, name: str) -> Path:
    """Return the file of a film that was made; raise NotFound where there is none."""
    for path in shelf.films(kept.id).glob(f"*{SUFFIX}"):
        if path.name == name and not name.startswith("."):
            return path
    raise NotFound(f"recording {kept.name} has no film {name}; ask for one", asked=name)


def film_document(kept: StoredRecording, path: Path) -> Document:
    """Return a film as REST shows it."""
    return {
        "name": path.name,
        "recording_id": kept.id,
        "size_bytes": path.stat().st_size,
        "url": f"{URL}/{kept.id}/films/{path.name}",
    }
