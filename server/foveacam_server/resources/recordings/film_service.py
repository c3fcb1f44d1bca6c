"""Encodes films (MP4) of recordings as jobs that run in parallel with all others."""

import threading
from typing import Protocol

from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.resources.recordings.collection import RecordingCollection, StoredRecording
from foveacam_server.resources.recordings.films import (
    check_film,
    clear_unfinished,
    film_document,
    film_file,
    make_film,
)
from foveacam_server.resources.recordings.opened import OpenRecordings
from foveacam_server.resources.recordings.schema import FilmDocument, FilmOrder, FilmRequest

KIND = "film"
REPORT_EVERY = 25
"""Frames between two progress reports."""


class RecordingLibrary(Protocol):
    """The recordings, as the film service needs them."""

    @property
    def collection(self) -> RecordingCollection:
        """The recordings on the disk."""
        ...

    @property
    def opened(self) -> OpenRecordings:
        """The recordings that are open for reading."""
        ...

    def readable(self, recording_id: str) -> StoredRecording:
        """Return a recording that has ended and can be read."""
        ...


class FilmService:
    """Encodes films, one at a time, and finds the encoded ones."""

    def __init__(self, library: RecordingLibrary, jobs: JobRunner) -> None:
        self._library = library
        self._jobs = jobs
        self._encoding = threading.Lock()
        clear_unfinished(library.collection)
        jobs.handle(KIND, self._work, parallel=True)

    def start(self, recording_id: str, request: FilmRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a film of a recording; raise at once when the recording cannot show it."""
        with self._library.opened.reading(self._library.readable(recording_id).path) as recording:
            check_film(recording, request)
        order = FilmOrder(**request.model_dump(), recording_id=recording_id)
        return self._jobs.submit(KIND, order, idempotency_key=idempotency_key)

    def get_by_url(self, url: str) -> FilmDocument:
        """Return the film that a job's result URL names."""
        recording_id, _, name = url.rsplit("/", 3)[1:]
        kept = self._library.readable(recording_id)
        return film_document(kept, film_file(self._library.collection, kept, name))

    def _work(self, context: JobContext) -> str:
        order = context.job.parse_request(FilmOrder)
        kept = self._library.readable(order.recording_id)

        def progress(done: int, total: int) -> None:
            context.check()
            if done == total or done % REPORT_EVERY == 1:
                context.progress(done, total=total, note=f"a film of {kept.name}")

        with self._encoding:  # an encoder uses all cores
            context.check()
            path = make_film(self._library.collection, kept, order, progress=progress)
        return film_document(kept, path).url
