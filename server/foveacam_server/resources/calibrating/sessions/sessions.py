"""Calibration sessions on disk: one folder holds everything measured for one calibration.

The steps and the pipeline write their own files into it; this module owns its head, its lock, the schemas of
its JSON files and the collection of all sessions.
"""

import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput
from foveacam_pipeline.calibrate.records.aggregate import combine_sessions
from foveacam_pipeline.capture.dataset.lock import LOCK, FolderLock
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.whole_file import write_document
from foveacam_server.resources.calibrating.sessions.schema import (
    CheckDocument,
    ClosingDocument,
    FitDocument,
    SettleDocument,
)

_Content = TypeVar("_Content", bound=BaseModel)


class SessionHead(BaseModel):
    """Identity of a session, and the ids of the calibrations fitted from it, oldest first.

    `baseline_m`: nominal distance between the rig's mirrors.
    """

    model_config = ConfigDict(frozen=True)

    format: Literal["foveacam-calibration-session"]
    version: Literal[1]
    id: str
    label: str
    rig_id: str
    created_utc: str
    baseline_m: float
    calibrations: tuple[str, ...]


class FinishedWide(BaseModel):
    """A completed stage 1, and the number of views it was to take."""

    views: int


class FinishedFit(BaseModel):
    """A completed fit; `of`: hash of its inputs."""

    of: str
    calibration_id: str


class FinishedCheck(BaseModel):
    """A completed check; `poses`: the number asked for; None: the usual one."""

    calibration_id: str
    poses: int | None


class FinishedSteps(BaseModel):
    """The completed steps, each with the options that a later run must share to be skipped."""

    wide: FinishedWide | None = None
    fit: FinishedFit | None = None
    check: FinishedCheck | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionFile(Generic[_Content]):
    """A JSON file in a session's folder: its name, its schema and what to do when it is damaged."""

    name: str
    schema: type[_Content]
    remedy: str = "restore it, or delete it and run its step again"


HEAD = SessionFile(name="session.json", schema=SessionHead, remedy="restore the file or delete the session")
FINISHED = SessionFile(name="finished.json", schema=FinishedSteps)
FIT = SessionFile(name="fit-result.json", schema=FitDocument)
CHECK = SessionFile(name="check-result.json", schema=CheckDocument)
SETTLE = SessionFile(name="settle-result.json", schema=SettleDocument)
DRIFT = SessionFile(name="drift-result.json", schema=ClosingDocument)
VIEWS = "wide.json"
"""The views of the board, written by the pipeline; absent before stage 1."""
SETTLE_REPORT = "settle.json"
"""The settle report, written by the pipeline."""
_ID = re.compile(r"ses-[0-9a-f]{1,32}")


class CalibrationSession:
    """One session's folder: its head, its JSON files, its completed steps."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def id(self) -> str:
        """The session's id: its folder's name."""
        return self.folder.name

    @property
    def head(self) -> SessionHead:
        """The session's head; raise `InvalidInput` when its file is damaged."""
        head = self.read(HEAD)
        if head is None:
            raise InvalidInput(f"{self.folder / HEAD.name} is missing; {HEAD.remedy}")
        return head

    def add_calibration(self, calibration_id: str) -> None:
        """Record that a calibration was fitted from this session; a known one becomes the newest."""
        head = self.head
        earlier = [known for known in head.calibrations if known != calibration_id]
        self.write(HEAD, head.model_copy(update={"calibrations": (*earlier, calibration_id)}))

    def read(self, file: SessionFile[_Content]) -> _Content | None:
        """Return the content of a file; None without it; raise `InvalidInput` when it is damaged."""
        path = self.folder / file.name
        try:
            return file.schema.model_validate_json(path.read_bytes())
        except FileNotFoundError:
            return None
        except (OSError, ValidationError) as error:
            found = _first_failure(error) if isinstance(error, ValidationError) else str(error)
            raise InvalidInput(
                f"{path} cannot be read ({found})",
                asked=str(path),
                remedy=file.remedy,
            ) from error

    def write(self, file: SessionFile[_Content], content: _Content) -> None:
        """Write a file, without the fields that were never set; raise as `write_document`."""
        document = content.model_dump(mode="json", exclude_unset=True)
        what = f"{file.name} of calibration session {self.id}"
        write_document(self.folder / file.name, document, what=what)

    @property
    def finished(self) -> FinishedSteps:
        """The completed steps."""
        return self.read(FINISHED) or FinishedSteps()

    def finish_steps(self, steps: FinishedSteps) -> None:
        """Record that the steps that `steps` holds were completed."""
        completed = {name: getattr(steps, name) for name in steps.model_fields_set}
        self.write(FINISHED, self.finished.model_copy(update=completed))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Lock the session for one step; raise `Busy` while a step of any program writes into it."""
        with disk_errors(f"locking calibration session {self.id}", self.folder):
            try:
                lock = FolderLock(self.folder)
            except Busy as error:
                raise Busy(
                    f"calibration session {self.id}: another step is writing into it",
                    asked=f"a step in session {self.id}",
                    found="another step writes into it",
                    remedy="wait until it ends, or begin another session",
                ) from error
        try:
            yield
        finally:
            lock.release()

    @property
    def empty(self) -> bool:
        """Whether nothing was measured yet."""
        return {path.name for path in self.folder.iterdir()} <= {HEAD.name, LOCK}

    @property
    def bytes(self) -> int:
        """Size of all files of the session."""
        return sum(path.stat().st_size for path in self.folder.rglob("*") if path.is_file())


class SessionCollection:
    """All sessions of one data directory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def create(self, *, label: str, rig_id: str, baseline_m: float) -> CalibrationSession:
        """Create a session."""
        session = CalibrationSession(self.folder / new_id("ses"))
        with _deleted_on_failure(session):
            session.folder.mkdir(parents=True)
            _write_head(session, label=label, rig_id=rig_id, baseline_m=baseline_m)
        return session

    def combine(self, ids: Sequence[str], *, label: str | None = None) -> CalibrationSession:
        """Create a session that combines the sweeps of several, and the lens of the newest that has one.

        Raise `NotFound` for an unknown id, `InvalidInput` for fewer than two sessions or for several rigs.
        """
        sessions = [self.get(one) for one in dict.fromkeys(ids)]
        if len(sessions) < 2:
            raise InvalidInput(f"{len(sessions)} session was given to be put together; name two or more")
        by_age = sorted(sessions, key=lambda session: session.head.created_utc)
        with_lens = [session.folder for session in by_age if (session.folder / VIEWS).is_file()]
        newest = by_age[-1]
        combined = CalibrationSession(self.folder / new_id("ses"))
        with _deleted_on_failure(combined):
            found = combine_sessions(
                [session.folder for session in sessions],
                combined.folder,
                rig_id=newest.head.rig_id,
                wide_from=(with_lens or [newest.folder])[-1],
            )
            _write_head(
                combined, label=label or found.label, rig_id=found.rig_id, baseline_m=newest.head.baseline_m
            )
        return combined

    def every(self) -> list[CalibrationSession]:
        """Return all sessions, newest first; skip folders whose head cannot be read."""
        found: list[tuple[str, CalibrationSession]] = []
        for path in self.folder.glob("ses-*"):
            session = CalibrationSession(path)
            try:
                found.append((session.head.created_utc, session))
            except InvalidInput:
                continue
        return [session for _, session in sorted(found, key=lambda pair: pair[0], reverse=True)]

    def get(self, session_id: str) -> CalibrationSession:
        """Return one session by its id or raise `NotFound`."""
        session = CalibrationSession(self.folder / session_id)
        if not _ID.fullmatch(session_id) or not (session.folder / HEAD.name).is_file():
            raise NotFound(
                f"there is no calibration session {session_id}; see /api/v1/calibration_sessions",
                asked=session_id,
            )
        return session

    def remove(self, session_id: str) -> None:
        """Delete a session; its calibrations stay. Raise `Busy` while a step writes into it."""
        session = self.get(session_id)
        with session.writing(), disk_errors(f"removing calibration session {session.id}", self.folder):
            shutil.rmtree(session.folder)


@contextmanager
def _deleted_on_failure(session: CalibrationSession) -> Iterator[None]:
    """Delete a new session that could not be written; raise `StorageFull` or `DeviceFault`."""
    try:
        with disk_errors("a calibration session", session.folder.parent):
            yield
    except FoveaError:
        shutil.rmtree(session.folder, ignore_errors=True)
        raise


def _write_head(session: CalibrationSession, *, label: str, rig_id: str, baseline_m: float) -> None:
    head = SessionHead(
        format="foveacam-calibration-session",
        version=1,
        id=session.id,
        label=label,
        rig_id=rig_id,
        created_utc=utc_now(),
        baseline_m=baseline_m,
        calibrations=(),
    )
    session.write(HEAD, head)


def _first_failure(error: ValidationError) -> str:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    return f"{where}: {first['msg']}" if where else first["msg"]
