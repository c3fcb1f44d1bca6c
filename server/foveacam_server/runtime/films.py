"""Films of recordings as jobs, beside all others."""

import threading
from typing import Protocol

from foveacam_server.recordings.films import (
    FilmSpec,
    check_film,
    clear_unfinished,
    film_document,
    film_file,
    make_film,
)
from foveacam_server.recordings.opened import OpenRecordings
from foveacam_server.recordings.recording_collection import RecordingCollection, StoredRecording
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.jobs import JobContext, JobRunner
from foveacam_server.runtime.store import Document

KIND = "film"
TELL_EVERY = 25
"""Frames between two reports."""


class RecordingLibrary(Protocol):
    """Where the recordings are."""

    @property
    def shelf(self) -> RecordingCollection:
        """Their files."""
        ...

    @property
    def opened(self) -> OpenRecordings:
        """Those that are being looked at."""
        ...

    def kept(self, recording_id: str) -> StoredRecording:
        """Return a recording that has ended and can be read."""
        ...


class FilmService:
    """Makes films, one at a time, and finds those that were made."""

    def __init__(self, library: RecordingLibrary, jobs: JobRunner) -> None:
        self._library = library
        self._jobs = jobs
        self._encoding = threading.Lock()
        clear_unfinished(library.shelf)
        jobs.handle(KIND, self._work, beside=True)

    def start(self, recording_id: str, request: Document, *, idempotency_key: str | None = None) -> Job:
        """Queue a film of a recording; refuse at once what it cannot show."""
        with self._library.opened.reading(self._library.kept(recording_id).path) as recording:
            check_film(recording, _wish(request))
        asked = {**request, "recording_id": recording_id}
        return self._jobs.submit(KIND, asked, idempotency_key=idempotency_key)

    def at_url(self, url: str) -> Document:
        """Return the film that a job's result URL names."""
        recording_id, _, name = url.rsplit("/", 3)[1:]
        kept = self._library.kept(recording_id)
        return film_document(kept, film_file(self._library.shelf, kept, name))

    def _work(self, context: JobContext) -> str:
        request = context.job.request
        kept = self._library.kept(request["recording_id"])

        def progress(done: int, total: int) -> None:
            context.check()
            if done == total or done % TELL_EVERY == 1:
                context.progress(done, total=total, note=f"a film of {kept.name}")

        with self._encoding:  # an encoder takes all the cores that there are
            context.check()
            path = make_film(self._library.shelf, kept, _wish(request), progress=progress)
        return str(film_document(kept, path)["url"])


def _wish(request: Document) -> FilmSpec:
    return FilmSpec(
        show=request["show"], fps=request["fps"], start_s=request["start_s"], end_s=request["end_s"]
    )
