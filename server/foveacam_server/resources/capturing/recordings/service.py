"""Makes recordings as jobs in parallel to all others, and serves those on the disk."""

import logging
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import (
    Busy,
    Cancelled,
    Clock,
    DeviceFault,
    FoveaError,
    InvalidInput,
    Role,
    StorageFull,
)
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.capture.recording.bounds import (
    DEFAULT_S,
    EndCause,
    RecordingBounds,
    early_end_message,
)
from foveacam_pipeline.capture.recording.recorder import Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.session import RecordingSession
from foveacam_pipeline.storage.free_space import free_bytes
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.report_pace import ReportPace
from foveacam_server.resources.capturing.recordings.begin import check_room, full_rates, identity_of
from foveacam_server.resources.capturing.recordings.collection import RecordingCollection, StoredRecording
from foveacam_server.resources.capturing.recordings.depth import BackendsByName, RecordedDepthService
from foveacam_server.resources.capturing.recordings.documents import (
    URL,
    counts_of,
    live_document,
    recording_document,
)
from foveacam_server.resources.capturing.recordings.films import FilmService
from foveacam_server.resources.capturing.recordings.imports.service import ImportService
from foveacam_server.resources.capturing.recordings.live import LiveRecording
from foveacam_server.resources.capturing.recordings.notes import RecordingNotes, notes_path, write_notes
from foveacam_server.resources.capturing.recordings.opened import OpenRecordings
from foveacam_server.resources.capturing.recordings.schema import (
    NameDocument,
    RecordingChange,
    RecordingDocument,
    RecordingEnded,
    RecordingRequest,
)
from foveacam_server.rig import refusals
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.frame_tap import FrameTap
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.live_views import LiveRates
from foveacam_server.rig.ports import CalibrationInForce

_log = logging.getLogger(__name__)

KIND = "recording"
ID_PREFIX = "rec-"
CHECK_S = 0.1
"""Interval at which the job checks whether to end: well within 2 s of a disk's failure."""
REPORT_PERIOD_NS = 5_000_000_000
STOP_WAIT_S = 40.0
"""Timeout of `stop` for the completion of the file; the recorder's own timeout is shorter."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingTools:
    """Services that recordings need."""

    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    tap: FrameTap
    hub: FrameHub
    rates: LiveRates
    backends: BackendsByName
    events: EventLog
    clock: Clock
    free_bytes: Callable[[Path], int] = free_bytes
    """Returns the free space on the disk of a folder."""
    folders: Sequence[Path] = ()
    """Further folders from which recordings are opened, besides that of the data directory."""


class RecordingService:
    """The recordings of this data directory: make, list, change, remove.

    One is made at a time; it does not reserve the rig.
    """

    def __init__(self, folder: Path, tools: RecordingTools) -> None:
        self.collection = RecordingCollection(folder)
        self.opened = OpenRecordings()
        self.depth = RecordedDepthService(self.opened, tools.backends)
        self._tools = tools
        self._lock = threading.Lock()
        self._live: LiveRecording | None = None
        tools.jobs.handle(KIND, self._work, parallel=True)
        self.films = FilmService(self, tools.jobs)
        self.imports = ImportService(
            self.collection, folders=tools.folders, free_bytes=tools.free_bytes, report=self._report_import
        )

    def close(self) -> None:
        """Close the files that are open for reading; call after the jobs have ended."""
        self.opened.close()

    # Recording ---------------------------------------------------------------------------------------------

    def start(self, request: RecordingRequest, *, idempotency_key: str | None = None) -> Job:
        """Start a recording; raise at once where it cannot be made now."""
        jobs = self._tools.jobs
        with self._lock:
            if jobs.has_key(idempotency_key):
                return jobs.submit(KIND, request, idempotency_key=idempotency_key)
            self._check_free()
            path = self.collection.new_file(request.name, numbered=request.numbered)
            roles = _roles(request.roles)
            every, calibration = request.rate == "full", self._tools.calibration.current
            rig, full = answer_of(
                self._tools.hardware.submit(lambda rig: (identity_of(rig, calibration), full_rates(rig))),
                asked="who it is",
            )
            self._check_room(roles, request.duration_s, full if every else self._tools.rates)
            bounds = self._bounds(request.duration_s)
            job = jobs.submit(  # its thread waits for the lock
                KIND,
                request,
                idempotency_key=idempotency_key,
                total=_whole(bounds.longest_s),
                note=f"ends by itself after {bounds.longest_s:g} s",
            )
            self._live = LiveRecording(
                boxes=self._tools.tap.boxes,
                id=ID_PREFIX + job.id.partition("-")[2],
                job_id=job.id,
                path=path,
                roles=roles,
                rig=rig,
                label=request.label,
                bounds=bounds,
                every=every,
                packed=request.packed,
                options=RecordingOptions(compress=request.compress),
                begun_ns=self._tools.clock.now_ns(),
            )
        begun = f"recording {path.stem} has begun; it ends by itself after {bounds.longest_s:g} s"
        self._emit("recording.created", begun, self._live.id)
        return job

    def name_of(self, name: str, *, numbered: bool) -> NameDocument:
        """Return the name that a recording would get, and why none could be made now, if so."""
        try:
            self.collection.check_writable()
            path = self.collection.new_file(name, numbered=numbered)
        except FoveaError as error:
            return NameDocument(name=name, free=False, why=str(error))
        return NameDocument(name=path.stem, free=True, why="")

    def stop(self, recording_id: str) -> RecordingDocument:
        """End a recording and return it when its file is complete; an ended one is returned as it is."""
        live = self._current()
        if live is not None and live.id == recording_id:
            live.stopping.set()
            live.ended.wait(STOP_WAIT_S)
        return self.get(recording_id)

    def _report_import(self, stored: StoredRecording) -> None:
        self._emit("recording.imported", f"recording {stored.name} was added", stored.id)

    # Recordings on the disk ------------------------------------------------------------------------------

    def search(self, *, text: str = "", removed: bool = False) -> list[RecordingDocument]:
        """Return recordings whose name, label, id or state contains all words of `text`, newest first.

        `removed`: those in the trash instead.
        """
        if removed:
            found = [recording_document(stored) for stored in self.collection.trash()]
        else:
            live = self._current()
            found = [] if live is None else [self._shown(live)]
            found += [recording_document(stored) for stored in self._ended()]
        words = text.casefold().split()
        return [known for known in found if all(word in _searched(known) for word in words)]

    def get(self, recording_id: str) -> RecordingDocument:
        """Return a recording by its id or raise NotFound."""
        live = self._current()
        if live is not None and live.id == recording_id:
            return self._shown(live)
        return recording_document(self.collection.get(recording_id, but=None if live is None else live.path))

    def is_in_use(self, recording_id: str) -> bool:
        """Return whether a recording is being made, or open for reading."""
        live = self._current()
        if live is not None and live.id == recording_id:
            return True
        return self.opened.is_open(self.collection.get(recording_id).path)

    def readable(self, recording_id: str) -> StoredRecording:
        """Return a recording that has ended and can be read; raise Busy or InvalidInput otherwise."""
        live = self._current()
        if live is not None and live.id == recording_id:
            raise Busy(
                f"recording {live.name} is still being made",
                asked=f"recording {live.name}",
                found="it is still being made",
                remedy=f"stop it first: POST {URL}/{live.id}/stop",
            )
        kept = self.collection.get(recording_id, but=None if live is None else live.path)
        if kept.contents is None:
            raise InvalidInput(f"recording {kept.name} cannot be read: {kept.trouble}")
        return kept

    def edit(self, recording_id: str, *, label: str) -> RecordingDocument:
        """Change the label, also while it is being made."""
        live = self._current()
        if live is not None and live.id == recording_id:
            live.label = label  # written to its notes when it ends
        else:
            self.collection.set_label(self.collection.get(recording_id), label=label)
        self.report_update(recording_id, "the label of a recording was changed")
        return self.get(recording_id)

    def remove(self, recording_id: str) -> None:
        """Move a recording to the trash; raise `Busy` while it is being made."""
        live = self._current()
        if live is not None and live.id == recording_id:
            raise refusals.in_use(f"remove recording {live.name}", f"recording {live.name}")
        kept = self.collection.get(recording_id)
        self.opened.forget(kept.path)
        self.collection.remove(kept)
        self._emit("recording.removed", f"recording {kept.name} is in the trash", recording_id)

    def restore(self, recording_id: str) -> RecordingDocument:
        """Restore a recording from the trash."""
        kept = self.collection.restore(recording_id)
        self.report_update(recording_id, f"recording {kept.name} is out of the trash")
        return self.get(recording_id)

    def report_update(self, recording_id: str, message: str) -> None:
        """Emit that a recording was changed."""
        self._emit("recording.updated", message, recording_id)

    # The job -----------------------------------------------------------------------------------------------

    def _work(self, context: JobContext) -> str:
        with self._lock:
            live = self._live
        if live is None or live.job_id != context.job.id:
            raise AssertionError("a recording is begun under the lock that it is known by")
        ended, why = EndCause.FAILED, "an unexpected error; the cause is in the server's log"
        try:
            ended = self._record(context, live)
            why = early_end_message(live.path) if ended is EndCause.DISK_RESERVE else ""
        except FoveaError as error:
            ended = EndCause.CANCELLED if isinstance(error, Cancelled) else EndCause.FAILED
            why = str(error)
            raise
        finally:
            self._end(live, ended=ended, why=why)
        return f"{URL}/{live.id}"

    def _record(self, context: JobContext, live: LiveRecording) -> EndCause:
        """Record until the end and return its cause; raise the error that made it fail."""
        live.recorder = recorder = _create_file(live)
        try:
            with (
                self._tools.hardware.recorded_at(1),
                self._tools.tap.listening(live.roles, live.record_frame, every=live.every),
            ):
                ended = self._wait(context, live)
        finally:
            with span("close the file"):
                recorder.close(finalize=not context.cancelled() and live.failure is None)
            self._report(context, live)
        if live.failure is not None:
            raise live.failure
        context.check()
        return ended

    def _wait(self, context: JobContext, live: LiveRecording) -> EndCause:
        """Wait for the end of a recording and return its cause, unless it was cancelled or failed."""
        pace = ReportPace(self._tools.clock, period_ns=REPORT_PERIOD_NS)
        while not (context.cancelled() or live.broken or live.stopping.wait(CHECK_S)):
            now_ns = self._tools.clock.now_ns()
            if (bound := live.bounds.reached((now_ns - live.begun_ns) / 1e9)) is not None:
                return bound
            if pace.is_due():
                self._report(context, live)
        return EndCause.STOPPED

    def _report(self, context: JobContext, live: LiveRecording) -> None:
        elapsed_s = (self._tools.clock.now_ns() - live.begun_ns) / 1e9
        longest_s = live.bounds.longest_s
        left_s = max(0.0, longest_s - elapsed_s)
        context.progress(round(elapsed_s), total=_whole(longest_s), note=live.summary(), left_s=left_s)

    def _end(self, live: LiveRecording, *, ended: EndCause, why: str) -> None:
        """Write the notes of its end, which may fail on a full disk, and emit an event."""
        counts = {stream: counts_of(found) for stream, found in live.statistics.items()}
        notes = RecordingNotes(
            id=live.id,
            label=live.label,
            created_utc=live.created_utc,
            ended=ended,
            why=why,
            statistics=counts,
        )
        try:
            if live.recorder is not None:  # otherwise there is no file
                write_notes(live.path, notes)
        except FoveaError as error:
            _log.warning("recording %s: its notes could not be written: %s", live.name, error)
        with self._lock:
            self._live = None
        live.ended.set()
        message = f"recording {live.name} has ended: {why or live.summary()}"
        data = RecordingEnded(recording_id=live.id, name=live.name, ended=ended, why=why)
        level = EventLevel.ERROR if why else EventLevel.INFO
        self._tools.events.emit("recording.ended", message, level=level, data=data)

    # Helpers -----------------------------------------------------------------------------------------------

    def _current(self) -> LiveRecording | None:
        """Return the recording in progress; None also after its job was cancelled while queued."""
        live = self._live
        if live is None or self._tools.jobs.get(live.job_id).state.ended:
            return None
        return live

    def _ended(self) -> list[StoredRecording]:
        live = self._current()
        return self.collection.every(but=None if live is None else live.path)

    def _check_free(self) -> None:
        live = self._current()
        if live is not None:
            raise Busy(
                f"asked to record: recording {live.name} is being made",
                asked="record",
                found=f"recording {live.name} is being made",
                remedy=f"stop it first: POST {URL}/{live.id}/stop",
            )

    def _check_room(self, roles: tuple[Role, ...], duration_s: float | None, rates: LiveRates) -> None:
        frames = []
        for role in roles:
            newest = self._tools.hub.newest(role.value)
            rate_hz = rates.wide_hz if role is Role.WIDE else rates.fovea_hz
            frames.append((0 if newest is None else newest.image.nbytes, rate_hz))
        check_room(frames, duration_s=duration_s, free_bytes=self._free_bytes())

    def _bounds(self, duration_s: float | None) -> RecordingBounds:
        return RecordingBounds(
            longest_s=DEFAULT_S if duration_s is None else duration_s, free_bytes=self._free_bytes
        )

    def _free_bytes(self) -> int:
        return self._tools.free_bytes(self.collection.folder)

    def _shown(self, live: LiveRecording) -> RecordingDocument:
        elapsed_s = (self._tools.clock.now_ns() - live.begun_ns) / 1e9
        return live_document(live, elapsed_s=elapsed_s)

    def _emit(self, kind: str, message: str, recording_id: str) -> None:
        self._tools.events.emit(kind, message, data=RecordingChange(recording_id=recording_id))


def _create_file(live: LiveRecording) -> Recorder:
    """Create the file and its notes and return the recorder; on an error remove both."""
    try:
        write_notes(live.path, RecordingNotes(id=live.id, label=live.label, created_utc=live.created_utc))
        session = RecordingSession(timestamp=live.created_utc, rig=live.rig)
        return Recorder(live.path, session, options=live.options)
    except (StorageFull, DeviceFault):
        with suppress(OSError):
            notes_path(live.path).unlink(missing_ok=True)
            live.path.unlink(missing_ok=True)
        raise


def _whole(seconds: float) -> int:
    return max(1, round(seconds))


def _roles(names: Sequence[str]) -> tuple[Role, ...]:
    return tuple(role for role in Role if role.value in names)


def _searched(recording: RecordingDocument) -> str:
    return f"{recording.name} {recording.label} {recording.id} {recording.state}".casefold()
