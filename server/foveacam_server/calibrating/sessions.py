"""Calibration sessions on disk: one folder holds everything measured for one calibration.

The procedures write their own files into it; here are its name, its label, and what came of it.
"""

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import InvalidInput
from foveacam_server.errors import NotFound
from foveacam_server.runtime.names import new_id, utc_now
from foveacam_server.runtime.store import Document
from foveacam_server.whole_file import write_document

FORMAT = "foveacam-calibration-session"
VERSION = 1
HEAD = "session.json"
_ID = re.compile(r"ses-[0-9a-f]{1,32}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionHead:
    """Who a session is, and the calibrations that were fitted from it, oldest first.

    `baseline_m`: nominal distance between the rig's mirrors.
    """

    id: str
    label: str
    rig_id: str
    created_utc: str
    baseline_m: float
    calibrations: tuple[str, ...] = ()


class CalibrationSession:
    """One session's folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def id(self) -> str:
        """Name of the session."""
        return self.folder.name

    @property
    def head(self) -> SessionHead:
        """Who it is, as written down."""
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
        """Write down that a calibration was fitted from this session; again makes it the newest."""
        document = self.read(HEAD) or {}
        earlier = [known for known in document.get("calibrations", []) if known != calibration_id]
        self.write(HEAD, document | {"calibrations": [*earlier, calibration_id]})

    def read(self, name: str) -> Document | None:
        """Return one of its JSON files; None when there is none, `InvalidInput` when it is damaged."""
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
        """Write one of its JSON files whole, then rename it into place."""
        write_document(self.folder / name, document)

    @property
    def empty(self) -> bool:
        """Whether nothing was measured in it yet."""
        return {path.name for path in self.folder.iterdir()} <= {HEAD}

    @property
    def bytes(self) -> int:
        """Size of everything in it."""
        return sum(path.stat().st_size for path in self.folder.rglob("*") if path.is_file())


class SessionShelf:
    """All sessions of one data directory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def create(self, *, label: str, rig_id: str, baseline_m: float) -> CalibrationSession:
        """Begin a session."""
        self.folder.mkdir(parents=True, exist_ok=True)
        session = CalibrationSession(self.folder / new_id("ses"))
        session.folder.mkdir()
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
        return session

    def every(self) -> list[CalibrationSession]:
        """Return all sessions, newest first; a folder whose head cannot be read is passed over."""
        found: list[tuple[str, CalibrationSession]] = []
        for path in self.folder.glob("ses-*"):
            session = CalibrationSession(path)
            try:
                found.append((session.head.created_utc, session))
            except InvalidInput:
                continue
        return [session for _, session in sorted(found, key=lambda pair: pair[0], reverse=True)]

    def get(self, session_id: str) -> CalibrationSession:
        """Return one by its id or raise `NotFound`."""
        session = CalibrationSession(self.folder / session_id)
        if not _ID.fullmatch(session_id) or not (session.folder / HEAD).is_file():
            raise NotFound(
                f"there is no calibration session {session_id}; see /api/v1/calibration_sessions",
                asked=session_id,
            )
        return session

    def remove(self, session_id: str) -> None:
        """Delete a session and everything measured in it; the calibrations fitted from it stay."""
        shutil.rmtree(self.get(session_id).folder)
