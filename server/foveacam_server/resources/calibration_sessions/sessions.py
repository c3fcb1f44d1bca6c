"""Calibration sessions on disk: one folder holds everything measured for one calibration.

The steps and the pipeline write their own files into it; this module owns its head, its lock and the
collection of all sessions.
"""

import json
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput
from foveacam_pipeline.calibrate.records.aggregate import combine_sessions
from foveacam_pipeline.capture.dataset.lock import LOCK, FolderLock
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.names import new_id, utc_now
from foveacam_server.foundation.store import Document
from foveacam_server.foundation.whole_file import write_document

FORMAT = "foveacam-calibration-session"
VERSION = 1
HEAD = "session.json"
VIEWS = "wide.json"
"""The views of the board; absent before stage 1."""
FIT, CHECK, SETTLE, DRIFT = "fit-result.json", "check-result.json", "settle-result.json", "drift-result.json"
"""The document of each step's last run, as REST shows it."""
SETTLE_REPORT = "settle.json"
"""The settle report that the pipeline wrote."""
FINISHED = "finished.json"
"""The steps that were completed, each with the options that it was completed with."""
_ID = re.compile(r"ses-[0-9a-f]{1,32}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionHead:
    """Identity of a session, and the ids of the calibrations fitted from it, oldest first.

    `baseline_m`: nominal distance between the rig's mirrors.
    """

    id: str
    label: str
    rig_id: str
    created_utc: str
    baseline_m: float
    calibrations: tuple[str, ...] = ()


class CalibrationSession:
    """One session's folder: its head, its JSON documents, its completed steps."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def id(self) -> str:
        """The session's id: its folder's name."""
        return self.folder.name

    @property
    def head(self) -> SessionHead:
        """The session's head; raise `InvalidInput` when its file is damaged."""
        document = self.read(HEAD) or {}
        if document.get("format") != FORMAT or document.get("version") != VERSION:
            raise InvalidInput(
                f"{self.folder / HEAD}: {FORMAT} version {VERSION} is needed; restore the file or delete the "
                "session"
            )
        try:
            return SessionHead(
                id=self.id,
                label=str(document["label"]),
                rig_id=str(document["rig_id"]),
                created_utc=str(document["created_utc"]),
                baseline_m=float(document["baseline_m"]),
                calibrations=tuple(str(known) for known in document["calibrations"]),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InvalidInput(
                f"{self.folder / HEAD}: {error} is wrong or missing; restore the file or delete the session"
            ) from error

    def add_calibration(self, calibration_id: str) -> None:
        """Record that a calibration was fitted from this session; a known one becomes the newest."""
        document = self.read(HEAD) or {}
        earlier = [known for known in document.get("calibrations", []) if known != calibration_id]
        self.write(HEAD, document | {"calibrations": [*earlier, calibration_id]})

    def read(self, name: str) -> Document | None:
        """Return one JSON file of the session; None without it; raise `InvalidInput` when it is damaged."""
        path = self.folder / name
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            raise InvalidInput(
                f"{path} cannot be read ({error}); restore it, or delete it and run its step again",
                asked=str(path),
                remedy="restore it, or delete it and run its step again",
            ) from error
        if not isinstance(found, dict):
            raise InvalidInput(f"{path}: an object is needed; delete the file and run its step again")
        return found

    def write(self, name: str, document: Document) -> None:
        """Write one JSON file of the session; raise as `write_document`."""
        write_document(self.folder / name, document, what=f"{name} of calibration session {self.id}")

    def finish_step(self, step: str, how: Document) -> None:
        """Record that a step was completed; `how`: what a later run must share to be skipped."""
        self.write(FINISHED, (self.read(FINISHED) or {}) | {step: how})

    def finished_step(self, step: str) -> Document | None:
        """Return the `how` that a step was completed with; None while it was not."""
        found: Document | None = (self.read(FINISHED) or {}).get(step)
        return found

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Lock the session for one step; raise `Busy` while a step of any program writes into it."""
        with disk_errors(f"locking calibration session {self.id}", self.folder):
            try:
                lock = FolderLock(self.folder)
            except Busy as error:
                raise Busy(
                    f"calibration session {self.id}: another step is writing into it; wait until it ends, or "
                    "begin another session",
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
        return {path.name for path in self.folder.iterdir()} <= {HEAD, LOCK}

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
        """Create a session with the sweeps of several, and the lens of the newest that has one.

        Raise `NotFound` for an unknown id, `InvalidInput` for fewer than two sessions or for several rigs.
        """
        sessions = [self.get(one) for one in dict.fromkeys(ids)]
        heads = sorted((session.head for session in sessions), key=lambda head: head.created_utc)
        if len(heads) < 2:
            raise InvalidInput(f"{len(heads)} session was given to be put together; name two or more")
        with_lens = [self.folder / head.id for head in heads if (self.folder / head.id / VIEWS).is_file()]
        combined = CalibrationSession(self.folder / new_id("ses"))
        with _deleted_on_failure(combined):
            found = combine_sessions(
                [session.folder for session in sessions],
                combined.folder,
                rig_id=heads[-1].rig_id,
                wide_from=(with_lens or [self.folder / heads[-1].id])[-1],
            )
            _write_head(
                combined, label=label or found.label, rig_id=found.rig_id, baseline_m=heads[-1].baseline_m
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
        if not _ID.fullmatch(session_id) or not (session.folder / HEAD).is_file():
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
    session.write(
        HEAD,
        {
            "format": FORMAT,
            "version": VERSION,
            "id": session.id,
            "label": label,
            "rig_id": rig_id,
            "created_utc": utc_now(),
            "baseline_m": baseline_m,
            "calibrations": [],
        },
    )
