"""A calibration session as one document: what was measured so far, and what came of it."""

from collections.abc import Callable
from functools import partial

from foveacam_hardware.contract import FoveaError
from foveacam_server.calibrating.pictures import picture_documents
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.settle_times import SettleTime
from foveacam_server.calibrating.sweep_documents import sweep_document, sweep_paths
from foveacam_server.calibrating.wide_documents import wide_documents
from foveacam_server.runtime.store import Document

FIT, CHECK, SETTLE, DRIFT = "fit-result.json", "check-result.json", "settle-result.json", "drift-result.json"
"""What the last run of each step found, as it is shown."""


def session_document(
    session: CalibrationSession, *, url: str, running: str | None, waits: SettleTime | None = None
) -> Document:
    """Return a session as REST shows it; a part that cannot be read is left out and named in `problems`.

    `waits`: the measured settle time that is in use, whichever session it is of.
    """
    head = session.head
    problems: list[str] = []

    def part(read: Callable[[], object]) -> object:
        try:
            return read()
        except FoveaError as error:
            problems.append(str(error))
            return None

    wide = part(lambda: wide_documents(session, url=url))
    board, stage = wide if isinstance(wide, tuple) else (None, None)
    sweeps = [part(partial(sweep_document, path)) for path in sweep_paths(session.folder)]
    return {
        "id": head.id,
        "label": head.label,
        "rig_id": head.rig_id,
        "created_utc": head.created_utc,
        "bytes": session.bytes,
        "board": board,
        "wide": stage,
        "sweeps": [sweep for sweep in sweeps if sweep is not None],
        "fit": part(lambda: session.read(FIT)),
        "closing": part(lambda: session.read(DRIFT)),
        "settle": part(lambda: _settle(session, waits)),
        "check": part(lambda: session.read(CHECK)),
        "pictures": picture_documents(session, url=url),
        "calibrations": list(head.calibrations),
        "running": running,
        "problems": problems,
    }


def _settle(session: CalibrationSession, waits: SettleTime | None) -> Document | None:
    found = session.read(SETTLE)
    if found is None:
        return None
    mine = (session.id, found.get("settle_us"))
    return found | {"applied": waits is not None and (waits.session_id, waits.settle_us) == mine}
