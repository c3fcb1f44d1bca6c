"""Exports of recordings, such as films, and the service that makes them as jobs in parallel to all others.

They are stored beside the recordings until the trash is emptied.
"""

import hashlib
import threading
from pathlib import Path
from typing import Protocol

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.recording.formats import FORMATS, MovieCodec, check_format
from foveacam_pipeline.capture.recording.movie import (
    UNFINISHED,
    MovieLayout,
    MovieSpec,
    Progress,
    export_movie,
    undistorter,
)
from foveacam_pipeline.capture.recording.observations import stream_of
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.sequences import export_npy, export_png
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.resources.capturing.recordings.collection import (
    FILMS,
    RecordingCollection,
    StoredRecording,
)
from foveacam_server.resources.capturing.recordings.documents import URL
from foveacam_server.resources.capturing.recordings.opened import OpenRecordings
from foveacam_server.resources.capturing.recordings.schema import (
    FilmDocument,
    FilmOrder,
    FilmRequest,
    FormatDocument,
)

LAYOUTS = {layout.value for layout in MovieLayout}
SEQUENCES = {"png": export_png, "npy": export_npy}
KIND = "film"
REPORT_EVERY = 25
"""Frames between two progress reports."""


def film_name(spec: FilmRequest) -> str:
    """Return the file name of an export, equal for equal exports."""
    wanted = f"{spec.show} {spec.fps} {spec.start_s} {spec.end_s}"
    if spec.format != "h264" or spec.undistorted:
        wanted += f" {spec.format} {spec.undistorted}"
    digest = hashlib.blake2s(wanted.encode(), digest_size=4).hexdigest()
    return f"{spec.show}-{digest}{FORMATS[spec.format].suffix}"


def check_film(recording: Recording, spec: FilmRequest) -> None:
    """Raise `InvalidInput` for an export that the recording lacks data for or this machine cannot write."""
    check_format(FORMATS[spec.format])
    for role in (Role.LEFT, Role.RIGHT) if spec.show in LAYOUTS else (Role(spec.show),):
        stream_of(recording, role)
    if spec.end_s is not None and spec.end_s <= spec.start_s:
        raise InvalidInput(
            f"film: it would begin at {spec.start_s:g} s and end at {spec.end_s:g} s; give a later end"
        )
    if spec.format == "npy" and spec.show in LAYOUTS:
        raise InvalidInput(f"film: an array holds one camera, not {spec.show}; choose one")
    undistorter(recording, movie_spec(recording, spec))


def movie_spec(recording: Recording, spec: FilmRequest) -> MovieSpec:
    """Return the pipeline's specification of an export."""
    return MovieSpec(
        show=spec.show if spec.show in LAYOUTS else stream_of(recording, Role(spec.show)).name,
        fps=spec.fps,
        codec=FORMATS[spec.format].codec or MovieCodec.H264,
        start_s=spec.start_s,
        end_s=spec.end_s,
        undistorted=spec.undistorted,
    )


def make_film(
    collection: RecordingCollection, stored: StoredRecording, spec: FilmRequest, *, progress: Progress
) -> Path:
    """Make an export, unless it exists, and return its path."""
    folder = collection.films(stored.id)
    target = folder / film_name(spec)
    if target.exists():
        return target
    with disk_errors(f"a film of recording {stored.name}", collection.folder):
        folder.mkdir(parents=True, exist_ok=True)
        with Recording(stored.path) as recording:
            export = SEQUENCES.get(spec.format, export_movie)
            export(recording, movie_spec(recording, spec), target, progress=progress)
    return target


def format_documents() -> list[FormatDocument]:
    """Return every format, and whether this machine can write it."""
    return [
        FormatDocument(
            name=found.name,
            title=found.title,
            suffix=found.suffix,
            available=not found.missing,
            why=found.missing,
        )
        for found in FORMATS.values()
    ]


def clear_unfinished(collection: RecordingCollection) -> None:
    """Delete the unfinished films of a killed server; call it only while no film is made."""
    for left in (collection.folder / FILMS).glob(f"*/{UNFINISHED}"):
        left.unlink(missing_ok=True)


def film_file(collection: RecordingCollection, stored: StoredRecording, name: str) -> Path:
    """Return the path of a film or raise `NotFound`."""
    for path in collection.films(stored.id).glob("*"):
        if path.name == name and not name.startswith("."):
            return path
    raise NotFound(f"recording {stored.name} has no film {name}; ask for one", asked=name)


def film_document(stored: StoredRecording, path: Path) -> FilmDocument:
    """Return a film as a REST document."""
    return FilmDocument(
        name=path.name,
        recording_id=stored.id,
        size_bytes=path.stat().st_size,
        url=f"{URL}/{stored.id}/films/{path.name}",
    )


class RecordingLibrary(Protocol):
    """Access of the film service to the recordings."""

    @property
    def collection(self) -> RecordingCollection:
        """The recordings on the disk."""
        ...

    @property
    def opened(self) -> OpenRecordings:
        """The cache of open recordings."""
        ...

    def readable(self, recording_id: str) -> StoredRecording:
        """Return a recording that has ended and can be read."""
        ...


class FilmService:
    """Encodes films, one a person and two in all at a time, and finds the encoded ones."""

    def __init__(self, library: RecordingLibrary, jobs: JobRunner) -> None:
        self._library = library
        self._jobs = jobs
        self._lock = threading.Lock()
        self._encoding: dict[tuple[str, str], threading.Lock] = {}
        """A lock for each requested film, as two jobs may request the same one."""
        clear_unfinished(library.collection)
        jobs.handle(KIND, self._work, parallel=True, at_once=2)

    def start(self, recording_id: str, request: FilmRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a film of a recording; raise at once when the recording cannot show it."""
        with self._library.opened.reading(self._library.readable(recording_id).path) as recording:
            check_film(recording, request)
        order = FilmOrder(**request.model_dump(), recording_id=recording_id)
        return self._jobs.submit(KIND, order, idempotency_key=idempotency_key)

    def get(self, recording_id: str, name: str) -> FilmDocument:
        """Return a film of a recording or raise NotFound."""
        kept = self._library.readable(recording_id)
        return film_document(kept, film_file(self._library.collection, kept, name))

    def _work(self, context: JobContext) -> str:
        order = context.job.parse_request(FilmOrder)
        kept = self._library.readable(order.recording_id)

        def progress(done: int, total: int) -> None:
            context.check()
            if done == total or done % REPORT_EVERY == 1:
                context.progress(done, total=total, note=f"a film of {kept.name}")

        with self._lock:
            encoding = self._encoding.setdefault((kept.id, film_name(order)), threading.Lock())
        with encoding:
            context.check()
            path = make_film(self._library.collection, kept, order, progress=progress)
        return film_document(kept, path).url
